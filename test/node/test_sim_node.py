"""The node as others see it: a process of its own, spoken to over ROS only."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from patience import patience

import hma_gripper_sim
from hma_gripper_sim import GripperDesign

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

START_PATIENCE = patience(120.0)  # s
PERIOD_NS = 10_000_000  # of the default publish_rate

JOINT_NAMES = [
    "slide",
    *(f"top_right_{i}" for i in range(1, 6)),
    *(f"top_left_{i}" for i in range(1, 6)),
    *(f"beam_right_{i}" for i in range(1, 26)),
    *(f"beam_left_{i}" for i in range(1, 26)),
    "tip_right",
    "tip_left",
]

TWO_BOXES = """
/**:
  ros__parameters:
    command_timeout: 0.0
    real_time_factor: 5.0
    travel_max: 0.012
    contour: low
    contours:
      low: {type: box, width: 0.02, height: 0.02, clearance: 0.02}
      high: {type: box, width: 0.02, height: 0.02, clearance: 0.002}
"""


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def stamp_is(client, stamp):
    return client.joints and stamp_ns(client.joints[-1]) == stamp


def stands_still(client):
    """Whether the node is paused, as far as its messages have come in."""
    return stamp_ns(client.joints[-1]) == stamp_ns(client.joints[-2])


def travels(client):
    return [message.position[0] for message in client.joints]


def travel(client):
    return client.joints[-1].position[0]


def velocity(client):
    return client.joints[-1].velocity[0]


def write(folder: Path, text: str) -> str:
    file = folder / "parameters.yaml"
    file.write_text(text)
    return str(file)


def test_hanging_free_it_publishes_every_joint_with_one_stamp_per_tick(start_node, connect):
    client = connect(start_node())
    client.clear()
    client.wait(lambda: min(map(len, (client.joints, client.wrenches, client.phi))) >= 30)

    assert list(client.joints[0].name) == JOINT_NAMES
    for message in client.joints:
        for numbers in (message.position, message.velocity, message.effort):
            assert len(numbers) == 63
            assert np.isfinite(numbers).all()
    by_topic = [
        {stamp_ns(message) for message in record}
        for record in (client.joints, client.wrenches, client.phi)
    ]
    first, last = max(map(min, by_topic)), min(map(max, by_topic))
    common = [{stamp for stamp in stamps if first <= stamp <= last} for stamps in by_topic]
    assert common[0] == common[1] == common[2]
    assert len(common[0]) >= 20
    # Period by period; at a real-time factor of 1 a hold-up of this machine may cost some.
    gaps = {later - earlier for earlier, later in pairwise(sorted(common[0]))}
    assert min(gaps) == PERIOD_NS

    wrench = client.wrenches[-1]
    assert wrench.header.frame_id == "gripper_mount"
    # At rest the actuator carries the weight, to the solver's tolerance of 1e-3.
    weight = GripperDesign.thesis_2013().mass * 9.81
    assert weight == pytest.approx(0.0444, abs=5e-5)
    assert wrench.wrench.force.z == pytest.approx(-weight, rel=1e-3)
    assert client.joints[-1].effort[0] == pytest.approx(-weight, rel=1e-3)
    phi = client.phi[-1]
    assert list(phi.name) == ["phi_left", "phi_right"]
    assert math.degrees(phi.position[0]) == pytest.approx(97.0, abs=1.0)
    assert phi.position[0] == pytest.approx(phi.position[1], abs=1e-12)
    assert set(client.contours) <= {"box"}


def recorded_motion(client):
    """Down at 20 mm/s from the start pose for 80 ticks: all numbers, by tick."""
    assert client.call("pause", True).success
    assert client.call("reset").success
    client.command(0.02)
    client.clear()
    client.wait(lambda: travels(client)[-2:] == [0.0, 0.0] and stands_still(client))
    start = stamp_ns(client.joints[-1])
    assert client.call("pause", False).success
    end = start + 80 * PERIOD_NS
    outputs = (client.joints, client.wrenches, client.phi)
    client.wait(lambda: all(record and stamp_ns(record[-1]) >= end for record in outputs))
    numbers = {}
    for name, record, fields in (
        ("joints", client.joints, lambda m: (m.position, m.velocity, m.effort)),
        ("force", client.wrenches, lambda m: m.wrench.force.z),
        ("phi", client.phi, lambda m: (m.position, m.velocity)),
    ):
        for message in record:
            tick, rest = divmod(stamp_ns(message) - start, PERIOD_NS)
            assert rest == 0
            if 1 <= tick <= 80:
                numbers[name, tick] = fields(message)
    return numbers


def test_the_same_commands_at_the_same_ticks_give_identical_outputs(start_node, connect):
    motions = []
    for runs in (2, 1):
        process = start_node(command_timeout=0.0, real_time_factor=4.0)
        client = connect(process)
        motions += [recorded_motion(client) for _ in range(runs)]
        process.send_signal(signal.SIGINT)
        assert process.exit_code() == 0
    first, again, elsewhere = motions

    assert len(first) == 3 * 80
    assert max(first["force", tick] for tick in range(1, 81)) > 0.1  # it presses on the object
    assert again == first
    assert elsewhere == first


def test_an_object_that_cannot_be_put_in_place_is_refused_with_the_reason(
    start_node, connect, tmp_path
):
    client = connect(start_node("--params-file", write(tmp_path, TWO_BOXES)))
    client.command(0.02)
    client.wait(lambda: travel(client) > 0.01)

    refused = client.call("select_contour/high")
    assert not refused.success
    assert "overlap" in refused.message
    unknown = client.set_parameter("contour", "mug")
    assert not unknown.successful
    assert "unknown contour 'mug' (known: high, low)" in unknown.reason
    assert client.get_parameter("contour") == "low"
    assert client.contours == ["low"]
    selections = {name for name in client.services() if "select_contour" in name}
    assert selections == {
        f"/hma_gripper_sim/select_contour/{name}" for name in ("low", "high", "outline")
    }

    assert client.call("reset").success
    assert client.call("select_contour/high").success
    client.wait(lambda: client.contours == ["low", "high"])
    assert client.get_parameter("contour") == "high"
    assert client.set_parameter("contour", "low").successful
    client.wait(lambda: client.contours == ["low", "high", "low"])


def test_commands_that_are_not_finite_change_nothing_and_do_not_renew(start_node, connect):
    client = connect(start_node(command_timeout=1.0))
    client.command(0.004)
    client.wait(lambda: velocity(client) == 0.004)
    for value in (math.nan, math.inf, -math.inf):
        client.command(value)
    client.clear()
    client.wait(lambda: client.joints and velocity(client) == 0.004)
    while velocity(client) != 0.0:  # although such commands keep coming, the good one expires
        client.command(math.nan)
        client.wait(lambda: len(client.joints) > 3)
        assert all(0.0 <= message.velocity[0] <= 0.004 for message in client.joints)
        assert all(np.isfinite(message.position).all() for message in client.joints)
        client.joints[:] = client.joints[-1:]
    assert travel(client) == pytest.approx(0.004, abs=1e-9)  # 1 s at 4 mm/s, ramps included


def test_commands_beyond_the_limits_are_clamped(start_node, connect):
    client = connect(
        start_node(travel_max=0.003, max_velocity=0.01, max_acceleration=0.05, real_time_factor=2.0)
    )
    while not (travel(client) > 0.002 and velocity(client) == 0.0):
        client.command(1e300)
        count = len(client.joints)
        client.wait(lambda count=count: len(client.joints) > count + 5)
    speeds = [message.velocity[0] for message in client.joints]
    assert max(speeds) == 0.01
    assert max(np.diff(speeds)) <= 0.05 * PERIOD_NS * 1e-9 * (1 + 1e-9)
    assert max(message.position[0] for message in client.joints) <= 0.003
    assert travel(client) == pytest.approx(0.003, abs=1e-10)


def test_a_pause_stops_time_and_a_reset_returns_to_the_start(start_node, connect):
    client = connect(start_node(real_time_factor=2.0, command_timeout=0.0))
    client.command(0.02)
    client.wait(lambda: travel(client) > 0.001)
    assert client.call("pause", True).success
    client.wait(lambda: stands_still(client))
    client.clear()
    client.wait(lambda: len(client.joints) > 10)
    held = client.joints[:]
    assert all(message == held[0] for message in held)  # including the stamp

    client.call("pause", False)
    client.wait(lambda: stamp_ns(client.joints[-1]) >= stamp_ns(held[0]) + 5 * PERIOD_NS)
    moved = next(m for m in client.joints if stamp_ns(m) == stamp_ns(held[0]) + PERIOD_NS)
    expected = held[0].position[0] + 0.5 * (moved.velocity[0] + held[0].velocity[0]) * 0.01
    assert moved.position[0] == pytest.approx(expected, abs=1e-12)

    before = stamp_ns(client.joints[-1])
    client.call("reset")
    client.wait(lambda: travel(client) == 0.0)
    assert velocity(client) == 0.0
    assert stamp_ns(client.joints[-1]) > before  # stamps never run back


def test_as_fast_as_possible_it_still_listens(start_node, connect):
    client = connect(start_node(real_time_factor=0.0, command_timeout=0.0))
    client.command(0.02)
    client.wait(lambda: travel(client) > 0.02)
    assert client.call("reset").success
    assert client.call("select_contour/cylinder").success
    assert client.set_parameter("real_time_factor", 1.0).successful
    client.clear()
    client.wait(lambda: len(client.joints) > 3)


def test_with_use_sim_time_it_follows_the_clock_topic(start_node, connect):
    client = connect(start_node())
    assert client.set_parameter("use_sim_time", True).successful
    client.wait(client.has_clock_subscriber)
    client.clear()
    for milliseconds in (100_000, 100_050):
        client.publish_clock(milliseconds * 1_000_000)
        client.wait(lambda until=milliseconds: stamp_is(client, until * 1_000_000))
    stamps = [stamp_ns(message) for message in client.joints]
    since = stamps.index(100_000_000_000)
    assert stamps[since:] == [100_000_000_000 + i * PERIOD_NS for i in range(6)]


def test_parameters_are_described_and_checked_at_run_time(start_node, connect):
    client = connect(start_node())
    described = {item.name: item for item in client.describe_parameters()}
    own = {
        name: item
        for name, item in described.items()
        if name.split(".")[0] in ("contours", "friction", "publish_rate", "elements_top", "design")
    }
    assert "contours.box.width" in own
    assert all(item.description for item in own.values())
    assert own["publish_rate"].floating_point_range[0].to_value == 1000.0
    assert own["elements_top"].integer_range[0].from_value == 0

    for name, value in (
        ("design", "other.yaml"),  # read-only
        ("friction", -0.1),
        ("friction", math.nan),
        ("travel_min", 0.01),  # the start pose would be outside
        ("contours.box.corner_radius", 0.02),  # more than half the box
        ("contours.box.colour", "red"),
    ):
        before = client.get_parameter("friction")
        assert not client.set_parameter(name, value).successful, name
        assert client.get_parameter("friction") == before
    assert client.set_parameter("friction", 0.8).successful
    assert client.get_parameter("friction") == 0.8


@pytest.mark.parametrize(
    ("number", "real_time_factor"), [(signal.SIGINT, 1.0), (signal.SIGTERM, 0.0)]
)
def test_a_signal_ends_it_cleanly(start_node, connect, number, real_time_factor):
    process = start_node(real_time_factor=real_time_factor)
    client = connect(process)
    client.command(0.004)
    process.send_signal(number)
    assert process.exit_code() == 0
    assert "Traceback" not in process.output("stderr")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_first_start_says_that_it_compiles_and_can_be_ended(
    start_node, tmp_path, monkeypatch, number
):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "nothing compiled yet"))
    process = start_node()
    end = time.monotonic() + START_PATIENCE
    while "compiling the solver for this processor: once" not in process.output("stderr"):
        process.check()
        assert time.monotonic() < end, "it has not said so"
        time.sleep(0.02)
    process.send_signal(number)
    assert process.exit_code() == 0
    assert "Traceback" not in process.output("stderr")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("{max_velocity: .nan}", "max_velocity: must be finite, got nan m/s"),
        ("{contours: {mug: {type: circle, radius: 15 kg}}}", "contours.mug.radius: expected"),
        ("{contours: {mug: {type: circle, hue: 1.0}}}", "contours.mug.hue: unknown parameter"),
        ("{friction: [1.0, red]}", "Sequence should be of same type"),
    ],
)
def test_a_parameter_file_that_cannot_be_used_ends_it_with_one_line(
    start_node, tmp_path, content, reason
):
    file = write(tmp_path, f"/**: {{ros__parameters: {content}}}")
    process = start_node("--params-file", file)
    assert process.exit_code() == 2
    assert process.output("stdout") == ""
    line = process.output("stderr")
    assert line.startswith(f"error: {file}: {reason}"), line
    assert line.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (["friction:=0.8"], "it belongs behind --ros-args"),
        (["-p", "friction:=0.8"], "it belongs behind --ros-args"),
        (["cylinder"], "sim_node --help lists all"),
    ],
)
def test_a_stray_argument_ends_it_with_one_line(arguments, hint):
    command = [sys.executable, "-m", "hma_gripper_sim.ros.sim_node", *arguments]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert run.returncode == 2
    assert run.stderr == f"error: {arguments[0]}: unknown argument ({hint})\n"


def test_help_explains_the_node_and_starts_none():
    command = [sys.executable, "-m", "hma_gripper_sim.ros.sim_node", "--help"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert run.returncode == 0
    for text in (
        "--ros-args",
        "--params-file",
        "config/sim_node.yaml",
        "use_sim_time",
        "Exit code",
    ):
        assert text in run.stdout
    assert run.stderr == ""


def test_the_shipped_parameter_file_is_accepted(start_node, connect):
    file = hma_gripper_sim.config_directory() / "sim_node.yaml"
    client = connect(start_node("--params-file", str(file)))
    assert client.contours == ["box"]
    assert client.call("select_contour/wedge").success
