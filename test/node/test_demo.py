"""``hma_gripper demo`` as users run it: its own process, the real node, real logs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from patience import patience
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim import GripperDesign, config_directory, simulate
from hma_gripper_sim.comparison.experiment_criteria import align
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.recordings.reading import read_recording

OBJECTS = ("box", "cylinder")
PATIENCE = patience(120.0)  # s; the node may have to compile its kernels first
WEIGHT = 0.0444427  # N


def experiment_file(name: str) -> Path:
    return config_directory() / "experiments" / f"thesis_2013_{name}.yaml"


def demo_command(report: Path, *arguments: str | Path) -> list[str]:
    program = [sys.executable, "-m", "hma_gripper_sim.cli.main", "demo", "--report", str(report)]
    return program + [str(argument) for argument in arguments]


def nodes(report: Path) -> list[int]:
    """Process ids of the nodes that a demo with this report has started."""
    found = []
    for command in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = command.read_bytes().split(b"\0")
        except OSError:
            continue  # ended meanwhile
        if (
            b"hma_gripper_sim.ros.sim_node" in words
            and os.fsencode(report / "sim_node.yaml") in words
        ):
            found.append(int(command.parent.name))
    return found


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of a demo that ended with exit code 0."""
    path = tmp_path_factory.mktemp("demo") / "report"
    done = subprocess.run(demo_command(path), capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr == ""
    assert "every figure is inside its bound" in done.stdout
    assert nodes(path) == []
    return path


def test_report_is_complete(report: Path) -> None:
    content = json.loads((report / "report.json").read_text(encoding="utf-8"))
    assert content["passed"]
    assert [e["name"] for e in content["experiments"]] == [f"thesis_2013_{o}" for o in OBJECTS]
    for experiment in content["experiments"]:
        assert all(comparison["inside"] for comparison in experiment["comparisons"])
        for picture in ("actuator_force", "phi", "snapshots"):
            header = (report / experiment["name"] / f"{picture}.png").read_bytes()[:8]
            assert header == b"\x89PNG\r\n\x1a\n"
    assert "Table 5.3" in (report / "summary.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", OBJECTS)
def test_rosbags_reads_the_log(report: Path, name: str) -> None:
    """All 63 joints, finite, all outputs of a tick with one stamp, stamps 10 ms apart."""
    store = get_typestore(Stores.ROS2_JAZZY)
    stamps: dict[str, list[int]] = {}
    texts: list[str] = []
    with Reader(report / f"thesis_2013_{name}" / "log") as reader:
        for connection, logged, data in reader.messages():
            message: Any = store.deserialize_cdr(data, connection.msgtype)
            if connection.msgtype == "std_msgs/msg/String":
                texts.append(message.data)
            elif connection.msgtype != "std_msgs/msg/Float64":
                stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
                assert stamp == logged
                stamps.setdefault(connection.topic, []).append(stamp)
            if connection.topic == "/joint_states":
                assert len(message.name) == 63
                for values in (message.position, message.velocity, message.effort):
                    assert values.shape == (63,)
                    assert np.isfinite(values).all()
    assert set(texts) == {name}
    joints = stamps["/joint_states"]
    assert stamps["/hma_gripper_sim/phi"] == stamps["/hma_gripper_sim/actuator_wrench"] == joints
    assert set(np.diff(joints).tolist()) == {10_000_000}
    assert joints[-1] - joints[0] > 14 * 10**9


@pytest.mark.parametrize("name", OBJECTS)
def test_mcap_ros2_reads_the_log(report: Path, name: str) -> None:
    """The gripper goes 28 mm down and back up, and hangs freely before and after.

    The last tick still brakes, with at most 0.5 m/s²: 2.3 mN for 4.5 g.
    """
    with (report / f"thesis_2013_{name}" / "log" / "log.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = reader.iter_decoded_messages(topics=["/joint_states"])
        joints = [message for _, _, _, message in decoded]
    assert all(message.name[0] == "slide" for message in joints)
    travel = [message.position[0] for message in joints]
    force = [message.effort[0] for message in joints]
    assert travel[0] == 0.0
    assert travel[-1] == pytest.approx(0.0, abs=1e-6)
    assert max(travel) == pytest.approx(0.028, abs=1e-6)
    assert force[0] == pytest.approx(-WEIGHT, abs=1e-5)
    assert force[-1] == pytest.approx(-WEIGHT, abs=2.5e-3)


def test_commands_are_in_the_log(report: Path) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(report / "thesis_2013_box" / "log") as reader:
        wanted = [c for c in reader.connections if c.topic == "/hma_gripper_sim/cmd_velocity"]
        sent = [
            store.deserialize_cdr(data, connection.msgtype).data
            for connection, _, data in reader.messages(wanted)
        ]
    assert list(dict.fromkeys(sent)) == [0.004, -0.004, 0.0]


@pytest.mark.parametrize("name", OBJECTS)
def test_log_is_what_the_same_motion_gives_offline(report: Path, name: str) -> None:
    """Over ROS, through the drive and a file: the curves of `simulate`, as far as 7 s.

    The drive starts with a ramp of 8 ms and makes steps of its own. The box's force falls by
    0.6 N from one sample to the next, so a shift by a single one of the 700 samples gives
    0.6 N / √700, 3 % of the maximum; φ is smooth.
    """
    experiment = read_experiment(experiment_file(name))
    design = GripperDesign.thesis_2013()
    run = align(read_recording(report / f"thesis_2013_{name}" / "log"), experiment, design)
    trace = simulate(experiment.scene(design), velocity=0.004, duration=7.0, sample_period=0.01)
    time = trace.time[10:-1]
    for signal_name, expected, tolerance in (
        ("phi_left", trace.phi_left, np.radians(0.05)),
        ("phi_right", trace.phi_right, np.radians(0.05)),
        ("actuator_force", trace.actuator_force, 0.03 * trace.actuator_force.max()),
    ):
        series = run.recording[signal_name]
        difference = np.interp(time, series.time, series.value) - expected[10:-1]
        assert np.sqrt(np.mean(difference**2)) < tolerance, signal_name


PRISM = """
title: Prism
source: made up
scene:
  contour: {name: prism, type: polygon, points: [[-14 mm, 0 m], [14 mm, 0 m], [0 m, 2 cm]]}
  clearance: 4 mm
  friction: 0.3
  contact: continuous
motion:
  - {velocity: 8 mm/s, duration: 2 s}
  - {velocity: 0 mm/s, duration: 1 s}
  - {velocity: -10 mm/s, duration: 1.6 s}
measured:
  source: nobody
  instants:
    - {time: 2 s, phi_left: {value: 150 deg, uncertainty: 1 deg}}
  max_error: {phi_left: 5 %}
"""


def test_own_experiment_outside_its_bound_gives_exit_code_1(tmp_path: Path) -> None:
    """Another object, motion and design than the shipped ones, and an angle that is 50° off."""
    prism, design, report = tmp_path / "prism.yaml", tmp_path / "design.yaml", tmp_path / "report"
    prism.write_text(PRISM, encoding="utf-8")
    GripperDesign.thesis_2013().to_yaml(design)
    old_log = report / "prism" / "log"
    old_log.mkdir(parents=True)
    (old_log / "log.mcap").touch()  # what an earlier demo left is replaced
    command = demo_command(
        report, "--experiment", prism, "--design", design, "--real-time-factor", "3"
    )
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stderr) == (1, "")
    content = json.loads((report / "report.json").read_text(encoding="utf-8"))
    outside = [c["figure"] for c in content["experiments"][0]["comparisons"] if not c["inside"]]
    assert outside == ["phi_left"]
    travel = read_recording(old_log)["travel"]
    deepest = travel.time[travel.value > 0.016 - 1e-6]
    assert travel.value.max() == pytest.approx(0.016, abs=1e-6)
    # 1 s; latency, three times over, prolongs it on a busy machine.
    assert 0.5 < deepest[-1] - deepest[0] < 1.0 + patience(0.5)


@pytest.fixture
def running(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Path, int]]:
    """A demo while it drives its node slowly, its report, and the node's process id."""
    report = tmp_path / "report"
    demo = subprocess.Popen(
        demo_command(report, "--real-time-factor", "0.5"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    log = report / "thesis_2013_box" / "log"
    try:
        wait(lambda: demo.poll() is not None or log.exists())
        assert demo.poll() is None
        (node,) = nodes(report)
        yield demo, report, node
    finally:
        demo.kill()
        demo.wait()
        for left_over in nodes(report):
            os.kill(left_over, signal.SIGKILL)


def wait(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_demo_ends_its_node(
    running: tuple[subprocess.Popen[str], Path, int], number: signal.Signals
) -> None:
    demo, report, _ = running
    demo.send_signal(number)
    _, stderr = demo.communicate(timeout=PATIENCE)
    assert demo.returncode not in (0, 2)
    assert "Traceback" not in stderr
    assert nodes(report) == []


def test_node_that_dies_is_reported(running: tuple[subprocess.Popen[str], Path, int]) -> None:
    demo, report, node = running
    os.kill(node, signal.SIGKILL)
    _, stderr = demo.communicate(timeout=PATIENCE)
    assert demo.returncode == 1
    assert stderr.startswith("error: sim_node ended with exit code -9")
    assert stderr.count("\n") == 1
    assert nodes(report) == []
