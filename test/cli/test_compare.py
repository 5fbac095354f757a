"""``hma_gripper compare``: verdicts, files and exit codes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim import config_directory
from hma_gripper_sim.bags.log_metadata import REMARKS_KEY, remarks_text
from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.cli.main import cli
from hma_gripper_sim.comparison.html_page import html_page
from hma_gripper_sim.comparison.log_comparison import compare_files
from hma_gripper_sim.device.topics import ACTUATOR_WRENCH, JOINT_STATES, PHI

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
START = 1_700_000_000_000_000_000

WriteLog = Callable[..., Path]


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["compare", *map(str, arguments)])


def replay(log: Path, output: Path) -> Result:
    arguments = ["replay", str(log), "--contour", "box", "--output", str(output)]
    return CliRunner().invoke(cli, arguments)


def test_a_log_compared_with_itself_has_no_error_at_all(
    write_log: WriteLog, tmp_path: Path
) -> None:
    """Not small: exactly zero, in every signal, phase and instant."""
    log = write_log("log")
    file = tmp_path / "result.json"
    bounds = [f"--max-error={name}=0%" for name in ("phi", "force", "travel", "bending_moment")]
    assert run(log, log, "--json", file, "--at", "5", *bounds).exit_code == 0
    result = json.loads(file.read_text())
    assert set(result["signals"]) >= {"travel", "actuator_force", "phi_left", "phi_mean"}
    for signal in result["signals"].values():
        for errors in (signal["overall"], *signal["phases"].values()):
            assert errors["rmse"] == errors["maximum"] == errors["bias"] == 0.0
        assert [i["relative_error"] for i in signal["instants"]] == [0.0]
    assert set(result["signals"]["travel"]["phases"]) == {"approach", "enveloping", "hold", "lift"}


def test_what_a_log_says_about_its_error_is_shown(write_log: WriteLog) -> None:
    """Replays leave remarks in the metadata of their logs."""
    log = write_log("log")
    metadata = log / "metadata.yaml"
    remarks = {REMARKS_KEY: remarks_text(["estimated error: 0.1 %"])}
    content = yaml.safe_load(metadata.read_text())
    content["rosbag2_bagfile_information"]["custom_data"] = remarks
    metadata.write_text(yaml.safe_dump(content))
    shown = run(log, log).output
    assert f"note: {log}: estimated error: 0.1 %" in shown


@pytest.mark.parametrize("prefix", ["left_", "right_"])
def test_log_of_a_node_with_a_prefix_is_refused_with_the_way_to_read_it(
    write_log: WriteLog, tmp_path: Path, prefix: str
) -> None:
    """The remedy is followed: both logs are of one motion, so that no error is left."""
    log, plain, map_file = (
        write_log("log", prefix=prefix),
        write_log("plain"),
        tmp_path / "map.yaml",
    )
    for refused in (run(log, plain), run(plain, log), replay(log, tmp_path / "out")):
        assert refused.exit_code == 2
        assert refused.output.count("\n") == 1
        assert f"no message is about joint 'slide' (there are: {prefix}slide" in refused.output
        assert "hma_gripper inspect LOG --map FILE" in refused.output
    made = CliRunner().invoke(cli, ["inspect", str(log), "--map", str(map_file)])
    assert made.exit_code == 0, made.output
    bounds = [f"--max-error={name}=0%" for name in ("phi", "force", "travel")]
    assert run(plain, log, "--signals", map_file, *bounds).exit_code == 0
    assert run(log, plain, "--sim-signals", map_file, *bounds).exit_code == 0


@pytest.mark.parametrize(("limit", "code"), [("0.02N", 0), ("0.005N", 1), ("3%", 0), ("2%", 1)])
def test_a_bound_sets_the_exit_code(write_log: WriteLog, limit: str, code: int) -> None:
    """The force is 0.01 N off throughout: 2.3 % of the largest, -0.044 + 20 · 0.024 N."""
    result = run(
        write_log("new", force_offset=0.01), write_log("old"), "--max-error", f"force={limit}"
    )
    assert result.exit_code == code, result.output
    assert ("NO" in result.output) == bool(code)


def test_other_clocks_are_aligned_and_said(write_log: WriteLog, tmp_path: Path) -> None:
    file = tmp_path / "r.json"
    log = write_log("log")
    later = write_log("later", start=5_000_000_000_000_000, phi_offset=0.01)
    assert run(later, log, "--json", file).exit_code == 0
    result = json.loads(file.read_text())
    assert "aligned by the travel" in result["alignment"]
    assert result["signals"]["phi_mean"]["overall"]["bias"] == pytest.approx(0.01, abs=1e-4)
    assert run(later, log, "--align", "stamps").exit_code == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("{log}", "nowhere"), "nowhere"),
        (("nowhere", "{log}"), "nowhere"),
        (("{log}", "{log}", "--max-error", "mass=1%"), "--max-error"),
        (("{log}", "{log}", "--at", "soon"), "--at"),
        (("{log}", "{log}", "--signals", "none.yaml"), "none.yaml"),
        (("{log}", "thesis_2013_box", "--signals", "none.yaml"), "--signals"),
        (("{log}", "thesis_2013_box", "--at", "3 s"), "its own instants"),
        (("{log}", "{log}", "--json", "{log}"), "cannot be written"),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_bad_input_is_one_line_and_exit_code_2(
    write_log: WriteLog, arguments: tuple[str, ...], said: str
) -> None:
    log = write_log("log")
    result = run(*(argument.format(log=log) for argument in arguments))
    assert result.exit_code == 2, result.output
    (line,) = [line for line in result.stderr.splitlines() if line.startswith("error")]
    assert said in line
    assert "Traceback" not in result.output


class Page(HTMLParser):
    """What a browser would do with a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [v or "" for k, v in attributes if k in ("src", "href", "style", "onerror")]

    def handle_data(self, data: str) -> None:
        self.text += data


def test_the_page_is_whole_in_itself_and_escapes_what_logs_say(write_log: WriteLog) -> None:
    evil = "<script>alert(1)</script>&amp;\"'><img src=x onerror=alert(2)>"
    log = write_log("log")
    result = compare_files(write_log(evil.replace("/", "∕")), log)
    object.__setattr__(result, "notes", (evil,))
    page = Page()
    content = html_page(result)
    page.feed(content)
    assert "script" not in page.tags
    assert evil in page.text
    assert page.links
    assert all(link.startswith("data:image/") for link in page.links)
    assert not re.search(r"(?:src|href)=[\"']?https?:", content)
    assert "default-src 'none'" in content
    assert page.tags.count("img") == len(result.signals)


def test_an_experiment_gives_the_row_of_table_5_3(write_log: WriteLog, tmp_path: Path) -> None:
    """|simulated - average| / average; 1.69 + 6 · 0.024 rad at the lowest position."""
    file, page = tmp_path / "r.json", tmp_path / "r.html"
    result = run(write_log("log"), "thesis_2013_box", "--json", file, "--html", page)
    assert result.exit_code == 1  # it is no box: the peak force is elsewhere
    (row,) = json.loads(file.read_text())["angles"]
    simulated = 1.69 + 6.0 * 0.024
    assert row["simulated"] == pytest.approx(simulated, abs=1e-3)
    average = 0.5 * (row["left"] + row["right"])
    assert row["average"] == pytest.approx(average)
    assert row["relative_error"] == pytest.approx((average - row["simulated"]) / average)
    assert "112.1°" in result.output
    assert "112.1°" in page.read_text()


def test_an_experiment_with_a_log_is_compared_with_that(
    write_log: WriteLog, tmp_path: Path
) -> None:
    """Over time; and what it states at instants besides."""
    text = (config_directory() / "experiments" / "thesis_2013_box.yaml").read_text()
    write_log("real")
    (tmp_path / "box.yaml").write_text(f"{text}\nlog: {{path: real}}\n")
    result = compare_files(write_log("sim", phi_offset=0.01), tmp_path / "box.yaml")
    bias = {signal.name: signal.overall.bias for signal in result.signals}
    assert bias["phi_mean"] == pytest.approx(0.01)
    assert bias["actuator_force"] == 0.0
    assert len(result.angles) == 1
    assert result.criteria
    page = html_page(result)
    assert page.count("data:image/png") == 2
    assert page.count("data:image/svg+xml") == len(result.signals)


def test_a_plan_is_nothing_to_compare_with(write_log: WriteLog) -> None:
    plan = Path(__file__).parents[1] / "data" / "golden" / "hold.yaml"
    result = run(write_log("log"), plan)
    assert result.exit_code == 2
    assert "only planned" in result.stderr


def recorded(folder: Path, name: str, force: Callable[[float], float], kept: Any = None) -> Path:
    """A log of 14 s at 100 Hz: down to 28 mm and back, and a force as a function of time."""
    path = folder / name
    header, vector = T["std_msgs/msg/Header"], T["geometry_msgs/msg/Vector3"]
    with LogWriter(path, (JOINT_STATES, ACTUATOR_WRENCH, PHI)) as log:
        for i in range(1400):
            time = 0.01 * i
            if kept is not None and not kept(time):
                continue
            stamp = START + i * 10_000_000
            head = header(T["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9)), "")
            travel = np.array([0.004 * min(time, 14.0 - time), 0.0])
            none = np.zeros(2)
            joints = T["sensor_msgs/msg/JointState"](head, ["slide", "a"], travel, none, none)
            wrench = T["geometry_msgs/msg/Wrench"](vector(0, 0, force(time)), vector(0, 0, 0))
            stamped = T["geometry_msgs/msg/WrenchStamped"](head, wrench)
            angles = T["sensor_msgs/msg/JointState"](
                head, ["phi_left", "phi_right"], np.full(2, 1.7), none, none
            )
            for topic, message in (
                (JOINT_STATES, joints),
                (ACTUATOR_WRENCH, stamped),
                (PHI, angles),
            ):
                log.write(topic.name, stamp, bytes(STORE.serialize_cdr(message, topic.msgtype)))
    return path


def bump(time: float) -> float:
    return math.sin(time / 14.0 * math.pi)


@pytest.mark.parametrize(
    ("force", "kept", "covered"),
    [
        (bump, lambda time: time < 0.25, "1.72 %"),
        (bump, lambda time: time < 0.015, "0.0715 %"),
        (bump, lambda time: not 2.0 < time < 12.0, "28.5 %"),
        (lambda time: bump(time) if time < 0.5 else math.nan, None, "3.5 %"),
    ],
    ids=["0.25 s", "two ticks", "a hole", "NaN"],
)
def test_bound_on_what_is_not_covered_is_not_kept(
    tmp_path: Path, force: Any, kept: Any, covered: str
) -> None:
    """The simulated values are right wherever there are any."""
    whole = recorded(tmp_path, "whole", bump)
    stub, json_file, html_file = tmp_path / "stub", tmp_path / "r.json", tmp_path / "r.html"
    recorded(tmp_path, "stub", force, kept)
    options = ("--max-error", "force=2%")
    result = run(stub, whole, *options, "--json", json_file, "--html", html_file)
    assert result.exit_code == 1, result.output
    assert "NO: not covered" in result.output
    assert covered in result.output
    (bound,) = json.loads(json_file.read_text())["bounds"]
    assert (bound["inside"], bound["covers"], bound["largest"] < 1e-9) == (False, False, True)
    assert f"{100.0 * bound['coverage']:.3g} %" == covered
    assert "NO: not covered" in html_file.read_text()
    assert run(whole, whole, *options).exit_code == 0
    assert run(stub, whole, *options, "--min-coverage", "0.01%").exit_code == (
        1 if covered == "28.5 %" else 0
    )


def test_bound_relative_to_0_is_refused(tmp_path: Path) -> None:
    simulated = recorded(tmp_path, "simulated", bump)
    dead = recorded(tmp_path, "dead", lambda time: 0.0)
    result = run(simulated, dead, "--max-error", "force=2%")
    assert result.exit_code == 2
    assert "error: " in result.output
    assert "--max-error actuator_force: the measured signal is 0 throughout" in result.output
    assert run(dead, dead, "--max-error", "force=0.1N").exit_code == 0


def test_tables_are_not_cut_where_the_line_is_short(
    write_log: WriteLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Large numbers, on a terminal of 40 columns and in a pipe."""
    new, old = write_log("new", phi_offset=100.0), write_log("old")
    for columns in ("40", "80", "300"):
        monkeypatch.setenv("COLUMNS", columns)
        output = run(new, old).output
        assert "…" not in output
        assert "5729.578" in output


def test_report_says_what_was_simulated(tmp_path: Path) -> None:
    json_file, html_file = tmp_path / "r.json", tmp_path / "r.html"
    log = Path(__file__).parents[1] / "data" / "golden" / "box"
    run(log, log, "--json", json_file, "--html", html_file)
    report = json.loads(json_file.read_text())
    assert report["simulation"]["Friction"] == "0.6"
    assert report["simulation"]["Object"].startswith("box (")
    assert {"Clearance", "Design", "Tolerance", "Discretisation"} <= set(report["simulation"])
    assert report["version"].startswith("hma_gripper_sim ")
    page = html_file.read_text()
    for term, text in report["simulation"].items():
        assert f"<dt>{term}</dt><dd>{text}</dd>" in page
    assert report["version"] in page
