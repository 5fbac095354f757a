"""``hma_gripper calibrate``: from a log with known parameters back to them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from hma_gripper_sim.cli.main import cli
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.replay.course import planned
from hma_gripper_sim.replay.simulated_log import replay
from hma_gripper_sim.replay.simulated_settings import SimulatedSettings

EXPERIMENT = """
title: A cup
source: made up
scene:
  contour: {name: cylinder, type: circle, radius: 15 mm}
  clearance: 5 mm
  friction: 0.5
  contact: continuous
log:
  path: log
"""


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["calibrate", *map(str, arguments)])


@pytest.fixture(scope="module")
def cup(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An experiment whose log was made with a friction of 0.7; its file says 0.5."""
    folder = tmp_path_factory.mktemp("cup")
    parameters = SimulatedSettings.parse(
        {"contour": "cylinder", "friction": 0.7, "travel_max": 0.016}
    )
    segments = [segment for segment in read_experiment("thesis_2013_cylinder").motion]
    motion = [type(s)(s.velocity, 4.0) for s in segments]
    replay(planned(motion, parameters.limits, 0.01), parameters, folder / "log", 10_000_000)
    file = folder / "cup.yaml"
    file.write_text(EXPERIMENT)
    return file


def test_the_friction_of_a_log_is_found(cup: Path, tmp_path: Path) -> None:
    result = run(cup, "--free", "friction", "--json", tmp_path / "found.json")
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["converged"]
    friction = found["parameters"]["friction"]
    assert friction["start"] == 0.5
    assert found["start"]["Friction"] == "0.5"
    assert found["version"].startswith("hma_gripper_sim ")
    assert friction["value"] == pytest.approx(0.7, abs=2e-3)
    force = found["signals"]["actuator_force"]
    assert force["rmse_after"] < 0.02 * force["rmse_before"]
    assert "friction" in result.output
    assert result.stderr == ""  # the progress bar is for terminals only


def test_a_terminal_shows_that_it_goes_on(cup: Path) -> None:
    """With FORCE_COLOR rich takes what it writes to for a terminal; its bar is made of these."""
    arguments = ["calibrate", str(cup), "--free", "friction"]
    shown = CliRunner(env={"FORCE_COLOR": "1"}).invoke(cli, arguments).stderr
    assert "simulations, weighted RMS error" in shown
    assert "━" in shown


def test_a_bound_that_holds_is_remarked(cup: Path) -> None:
    result = run(cup, "--free", "mu", "--bound", "mu=0.3..0.6")
    assert result.exit_code == 0
    assert "friction is held by its bound" in result.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere.yaml", "--free", "mu"), "nowhere.yaml"),
        (("{cup}", "--free", "speed"), "--free: unknown parameter 'speed'"),
        (("{cup}", "--free", "mu", "--bound", "mu"), "--bound"),
        (("{cup}", "--free", "mu", "--travel-tolerance", "fine"), "--travel-tolerance"),
        (("thesis_2013_box", "--free", "mu,E,width"), "2 measurements cannot tell 3 parameters"),
        (("thesis_2013_box", "--free", "mu,E"), "cannot tell the parameters apart"),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_bad_input_is_one_line_and_exit_code_2(
    cup: Path, arguments: tuple[str, ...], said: str
) -> None:
    result = run(*(argument.format(cup=cup) for argument in arguments))
    assert result.exit_code == 2, result.output
    assert said in result.stderr
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1


def test_what_the_experiment_cannot_tell_is_refused(cup: Path, tmp_path: Path) -> None:
    """The bounds are so narrow that they say more than the log; the tables show it."""
    text = cup.read_text().replace("path: log", f"path: {cup.parent / 'log'}")
    noisy = tmp_path / "noisy.yaml"
    noisy.write_text(text)
    file = tmp_path / "found.json"
    result = run(noisy, "--free", "mu", "--bound", "mu=0.4999..0.5001", "--json", file)
    assert result.exit_code == 2, result.output
    assert "Identifiability" in result.output
    assert "the experiment cannot tell friction: the standard error is comparable" in result.stderr
    assert json.loads(file.read_text())["parameters"]["friction"]["told"] is False


def test_log_that_begins_in_motion_is_refused_before_the_search(
    cup: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its first half second is taken as zero, in which it goes down at 4 mm/s."""
    monkeypatch.setattr(Scene, "__init__", None)  # nothing may be simulated
    (tmp_path / "map.yaml").write_text(
        "travel: {topic: /joint_states, field: position, joint: slide, tare: 0.5 s}\n"
        "actuator_force: {topic: /hma_gripper_sim/actuator_wrench, field: wrench.force.z}\n"
    )
    text = cup.read_text().replace(
        "path: log", f"path: {cup.parent / 'log'}\n  signals: {tmp_path / 'map.yaml'}"
    )
    (tmp_path / "tared.yaml").write_text(text)
    result = run(tmp_path / "tared.yaml", "--free", "friction")
    assert result.exit_code == 2
    assert "log: travel: its tare was taken in motion throughout" in result.stderr
    assert result.stderr.count("\n") == 1


def test_log_in_place_of_an_experiment_is_pointed_out(cup: Path) -> None:
    result = run(cup.parent / "log", "--free", "mu")
    assert result.exit_code == 2
    assert "is a log: wanted is an experiment file (YAML), with a scene and 'log:" in result.stderr
