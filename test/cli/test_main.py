"""The command line: help, and bad input that ends in one line and exit code 2."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from hma_gripper_sim import GripperDesign, config_directory
from hma_gripper_sim.cli.main import cli

Demo = Callable[..., Result]

BOX = config_directory() / "experiments" / "thesis_2013_box.yaml"


@pytest.fixture
def demo(tmp_path: Path) -> Demo:
    """Run ``hma_gripper demo`` with arguments, its report below the test's directory."""

    def run(*arguments: str | Path) -> Result:
        report = ["--report", str(tmp_path / "report")]
        return CliRunner().invoke(cli, ["demo", *report, *map(str, arguments)])

    return run


def refused(result: Result, *parts: str | Path) -> None:
    """One line on stderr: ``error:`` and these parts, in this order."""
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: " + ": ".join(map(str, parts)))
    assert result.stderr.count("\n") == 1
    assert result.exc_info is None or result.exc_info[0] is SystemExit


def test_help_names_the_commands_and_loads_nothing_slow() -> None:
    program = (
        "import sys; from hma_gripper_sim.cli.main import cli;"
        "cli(['--help'], standalone_mode=False);"
        "print({'matplotlib', 'rosbags', 'rich', 'rclpy'} & set(sys.modules))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert "demo" in shown
    assert shown.endswith("set()\n")


@pytest.mark.parametrize(
    "arguments", [("inspect", "{log}"), ("compare", "{log}", "{log}", "--max-error", "force=1%")]
)
def test_commands_without_physics_load_no_solver(arguments: tuple[str, ...]) -> None:
    """It took most of their time, and three quarters of their memory."""
    log = Path(__file__).parents[1] / "data" / "golden" / "box"
    given = [argument.format(log=log) for argument in arguments]
    program = (
        "import sys; from hma_gripper_sim.cli.main import cli;"
        f"cli({given!r}, standalone_mode=False);"
        "print({'matplotlib', 'numba', 'scipy.linalg', 'rclpy'} & set(sys.modules))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    ).stdout
    assert "/joint_states" in shown or "travel" in shown
    assert shown.endswith("set()\n")


@pytest.mark.parametrize(
    "arguments",
    [("replay", "{file}", "--output", "{file}.sim"), ("calibrate", "{file}", "--free", "friction")],
)
def test_bad_input_is_refused_before_the_solver_is_loaded(
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    """An experiment whose log is none."""
    (tmp_path / "no.mcap").write_bytes(b"nothing")
    file = tmp_path / "cup.yaml"
    file.write_text(
        "{title: T, source: S, scene: {contour: {name: c, type: circle, radius: 15 mm},"
        " clearance: 5 mm, friction: 0.5, contact: continuous}, log: {path: no.mcap}}"
    )
    given = [argument.format(file=file) for argument in arguments]
    program = (
        "import sys; from hma_gripper_sim.cli.main import cli;"
        f"code = cli({given!r}, standalone_mode=False);"
        "print(code, {'matplotlib', 'numba', 'rclpy'} & set(sys.modules))"
    )
    shown = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "error: " + str(tmp_path / "no.mcap") in shown.stderr
    assert shown.stdout == "2 set()\n"


def test_help_of_the_demo_explains_exit_codes_and_gives_examples() -> None:
    shown = CliRunner().invoke(cli, ["demo", "--help"])
    assert shown.exit_code == 0
    for text in ("Exit code: 0", "hma_gripper demo --experiment", "--real-time-factor"):
        assert text in shown.stdout


@pytest.mark.parametrize("command", list(cli.commands))
def test_help_of_every_command_keeps_the_lines_of_its_examples(command: str) -> None:
    shown = CliRunner().invoke(cli, [command, "--help"], terminal_width=100).stdout
    assert f"\n    hma_gripper {command}" in shown
    assert "\\b" not in shown


@pytest.mark.parametrize(
    ("old", "new", "field", "reason"),
    [
        ("width: 28 mm", "width: 28 kg", "scene.contour.width", "expected a number in m"),
        ("width: 28 mm", "width: -28 mm", "scene.contour.width", "must be at least"),
        ("clearance: 4 mm", "clearance: .nan", "scene.clearance", "must be finite"),
        ("friction: 0.6", "fiction: 0.6", "scene.fiction", "unknown field"),
    ],
)
def test_bad_experiment_is_refused(
    demo: Demo, tmp_path: Path, old: str, new: str, field: str, reason: str
) -> None:
    text = BOX.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "bad.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    refused(demo("--experiment", path), path, field, reason)


def test_unreadable_experiment_is_refused(demo: Demo, tmp_path: Path) -> None:
    refused(
        demo("--experiment", tmp_path / "absent.yaml"), tmp_path / "absent.yaml", "cannot be read"
    )
    refused(demo("--experiment", tmp_path), tmp_path, "cannot be read")


def test_bad_design_is_refused(demo: Demo, tmp_path: Path) -> None:
    path = tmp_path / "design.yaml"
    GripperDesign.thesis_2013().to_yaml(path)
    path.write_text(path.read_text(encoding="utf-8").replace("width: 0.004", "width: -4 mm"))
    refused(demo("--design", path), path, "width", "must be greater than 0")


@pytest.mark.parametrize("factor", ["0", "-1", "nan", "inf", "1e9"])
def test_bad_real_time_factor_is_refused(demo: Demo, factor: str) -> None:
    refused(demo(f"--real-time-factor={factor}"), "--real-time-factor", "must be")


def test_experiments_that_need_different_nodes_are_refused(demo: Demo, tmp_path: Path) -> None:
    text = BOX.read_text(encoding="utf-8")
    for name, old, new, field in (
        ("slippery", "friction: 0.6", "friction: 0.3", "scene.friction"),
        ("smooth", "contact: sampled", "contact: continuous", "scene.contact"),
        ("wide", "width: 28 mm", "width: 29 mm", "scene.contour.name"),
    ):
        other = tmp_path / f"{name}.yaml"
        other.write_text(text.replace(old, new), encoding="utf-8")
        refused(demo("--experiment", BOX, "--experiment", other), other, field)
    refused(demo("--experiment", BOX, "--experiment", BOX), BOX, "--experiment")


def test_without_ros_the_remedy_is_named(demo: Demo, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hma_gripper_sim.ros.client.demo_client", None)
    result = demo()
    refused(result, "ROS 2 is missing")
    assert "pip install 'hma_gripper_sim[ros]'" in result.stderr


def test_report_that_cannot_be_written_is_refused(
    demo: Demo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hma_gripper_sim.demo.demo._ros_client", lambda: None)
    (tmp_path / "report").touch()
    refused(demo(), tmp_path / "report" / "thesis_2013_box", "--report", "cannot be prepared")


def test_log_that_is_not_the_demos_is_kept(
    demo: Demo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hma_gripper_sim.demo.demo._ros_client", lambda: None)
    log = tmp_path / "report" / "thesis_2013_box" / "log"
    log.mkdir(parents=True)
    (log / "valuable.mcap").touch()
    refused(demo(), log, "--report", "cannot be prepared")
    assert (log / "valuable.mcap").exists()


def test_failure_to_write_is_one_line(
    demo: Demo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hma_gripper_sim.demo.demo._ros_client", lambda: None)
    (tmp_path / "report" / "sim_node.yaml").mkdir(parents=True)
    result = demo()
    assert result.exit_code == 1
    assert result.stderr.startswith("error: ")
    assert "sim_node.yaml" in result.stderr
    assert result.stderr.count("\n") == 1


def test_bad_input_leaves_nothing_behind(demo: Demo, tmp_path: Path) -> None:
    demo("--real-time-factor=0")
    assert list(tmp_path.iterdir()) == []
