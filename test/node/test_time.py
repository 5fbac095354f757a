"""The node as the clock of others, stepped on request, and refusing two clocks."""

from __future__ import annotations

import re
import signal
from itertools import pairwise

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

PERIOD_NS = 10_000_000
STEP_TICKS = 5
STEPS = 30


def stamp_ns(message):
    return nanoseconds(message.header.stamp)


def nanoseconds(stamp):
    return stamp.sec * 1_000_000_000 + stamp.nanosec


def message_of(reports, part):
    """What a part of the node last said on /diagnostics."""
    found = [s for report in reports for s in report.status if s.name.endswith(f": {part}")]
    return found[-1].message


def step(client):
    """Call ~/step; return the stamp [ns] and the travel [m] of its answer."""
    answer = client.call("step")
    assert answer.success, answer.message
    seconds, nanosec, travel = re.fullmatch(
        r"stamp: (\d+)\.(\d{9}) s, travel: (\S+) m", answer.message
    ).groups()
    return int(seconds) * 1_000_000_000 + int(nanosec), float(travel)


def controlled_run(start_node, connect):
    """A controller under use_sim_time presses with 0.3 N, in lockstep; all that it has seen."""
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Header

    process = start_node(publish_clock=True, step_ticks=STEP_TICKS, command_timeout=0.2)
    client = connect(process)
    client.use_sim_time()
    assert client.call("pause", True).success
    assert client.call("reset").success
    assert client.set_parameter("friction", 0.7).successful
    force, seen, begin = 0.0, [], None
    for _ in range(STEPS):
        velocity = min(0.03, 0.1 * (0.3 - force))
        header = Header(stamp=client.now())
        client.send(
            "joint_commands", JointState(header=header, name=["slide"], velocity=[velocity])
        )
        end, travel = step(client)
        client.wait(lambda end=end: nanoseconds(client.now()) == end)  # its clock has followed
        client.wait(lambda end=end: all(
            record and stamp_ns(record[-1]) == end for record in (client.joints, client.wrenches)
        ))  # fmt: skip
        begin = begin or end - STEP_TICKS * PERIOD_NS
        state = client.joints[-1]
        assert state.position[0] == travel
        force = client.wrenches[-1].wrench.force.z
        seen.append((end - begin, force, *state.position, *state.velocity, *state.effort))
    stamps = {stamp_ns(message) - begin for message in client.joints}
    assert stamps >= {i * PERIOD_NS for i in range(1, STEPS * STEP_TICKS + 1)}
    process.send_signal(signal.SIGINT)
    assert process.exit_code() == 0
    return seen


def test_a_controller_in_lockstep_gets_identical_results_in_two_runs(start_node, connect):
    first, again = (controlled_run(start_node, connect) for _ in range(2))
    assert [row[0] for row in first] == [i * STEP_TICKS * PERIOD_NS for i in range(1, STEPS + 1)]
    assert max(row[1] for row in first) > 0.2  # it has pressed
    assert again == first


def test_steps_are_made_while_paused_only(start_node, connect):
    client = connect(start_node(step_ticks=3))
    refused = client.call("step")
    assert not refused.success
    assert "paused" in refused.message
    assert client.call("pause", True).success
    first, _ = step(client)
    assert client.set_parameter("step_ticks", 7).successful
    assert step(client)[0] - first == 7 * PERIOD_NS
    assert not client.set_parameter("step_ticks", 0).successful


def test_the_clock_it_publishes_is_simulated_time_from_zero_at_any_speed(start_node, connect):
    from rosgraph_msgs.msg import Clock

    client = connect(start_node(publish_clock=True, real_time_factor=0.0))
    clock = client.listen(Clock, "/clock")
    client.wait(lambda: len(clock) > 500)
    times = [nanoseconds(message.clock) for message in clock]
    assert all(time % PERIOD_NS == 0 for time in times)
    assert all(later > earlier for earlier, later in pairwise(times))
    assert times[-1] < 3600 * 1_000_000_000  # since the start of the node, not since 1970
    client.wait(lambda: stamp_ns(client.joints[-1]) >= times[-1])
    stamps = {stamp_ns(message) for message in client.joints}
    assert all(stamp % PERIOD_NS == 0 for stamp in stamps)
    # Whoever cannot keep up with such a speed misses some of either.
    assert len(stamps.intersection(times)) > 100


@pytest.mark.parametrize("step", [0.125, 0.25, 1.0])
def test_a_coarse_clock_moves_the_gripper_as_far_as_a_fine_one(start_node, connect, step):
    """4 mm/s for 4 s; steps of a second are what a clock of 10 Hz is at ten times real time."""
    client = connect(start_node(command_timeout=0.0))
    assert client.set_parameter("use_sim_time", True).successful
    client.wait(client.has_clock_subscriber)

    def go_on_to(seconds):
        now = round(1e9 * seconds)
        client.publish_clock(now)
        last = range(now - PERIOD_NS + 1, now + 1)
        client.wait(lambda: client.joints and stamp_ns(client.joints[-1]) in last)

    go_on_to(100.0)
    assert client.call("reset").success
    client.command(0.004)
    client.clear()
    for i in range(1, round(4.0 / step) + 1):
        go_on_to(100.0 + i * step)
    stamps = {stamp_ns(message) for message in client.joints}
    assert stamps == {round(100e9) + i * PERIOD_NS for i in range(1, 401)}
    ramp = 0.004**2 / 0.5 / 2.0  # what it takes to get up to the velocity
    assert client.joints[-1].position[0] == pytest.approx(0.016 - ramp, abs=5e-6)


def test_without_a_clock_it_says_so_and_reports_all_the_same(start_node, connect):
    from diagnostic_msgs.msg import DiagnosticArray

    process = start_node(use_sim_time=True)
    client = connect(process, ticking=False)
    reports = client.listen(DiagnosticArray, "/diagnostics")
    client.wait(lambda: "nothing has come on /clock" in process.output("stderr"))
    client.wait(lambda: reports and "nothing has come on /clock" in message_of(reports, "timing"))

    client.publish_clock(50_000_000_000)
    client.wait(lambda: client.joints)
    client.wait(lambda: "/clock stands still at 50.000 s" in process.output("stderr"))
    client.wait(lambda: "/clock stands still at 50.000 s" in message_of(reports, "timing"))


def test_a_second_publisher_of_the_clock_is_named(start_node, connect):
    from diagnostic_msgs.msg import DiagnosticArray

    process = start_node(publish_clock=True)
    client = connect(process)  # which has a publisher of the clock, too
    reports = client.listen(DiagnosticArray, "/diagnostics")
    text = "/clock has several publishers: /hma_gripper_sim, /test_client"
    client.wait(lambda: text in process.output("stderr"))
    client.wait(lambda: reports and text in message_of(reports, "graph"))


def test_publishers_of_the_clock_that_disagree_are_named(start_node, connect):
    """They are 95 s apart: no tick fell behind, and the clock neither stands nor fails to come."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.time import Time
    from rosgraph_msgs.msg import Clock

    process = start_node(use_sim_time=True)
    client = connect(process, ticking=False)
    reports = client.listen(DiagnosticArray, "/diagnostics")
    other = client.publisher(Clock, "/clock", of="bag_player")
    count = 0

    def has_said(part, text):
        nonlocal count
        count += 1
        client.publish_clock(100_000_000_000 + count * PERIOD_NS)
        other.publish(Clock(clock=Time(nanoseconds=5_000_000_000 + count * PERIOD_NS).to_msg()))
        return reports and text in message_of(reports, part)

    text = "/clock is set back again and again, by 95 s (published by /bag_player and /test_client)"
    client.wait(lambda: has_said("timing", text))
    client.wait(lambda: has_said("graph", "/clock has several publishers: /bag_player, /test_cl"))
    assert "/clock is set back again and again, by 95 s" in process.output("stderr")
    assert "/clock has several publishers: /bag_player, /test_client" in process.output("stderr")


def test_a_trajectory_of_another_clock_is_refused(start_node, connect):
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    process = start_node(publish_clock=True)
    client = connect(process)
    message = JointTrajectory(joint_names=["slide"])
    message.points.append(JointTrajectoryPoint(positions=[0.01]))
    message.header.stamp = client.now()  # of the wall
    client.send("joint_trajectory", message)
    client.wait(lambda: "the sender has another clock" in process.output("stderr"))


def test_a_node_that_is_the_clock_does_not_follow_one(start_node, connect):
    process = start_node(publish_clock=True, use_sim_time=True)
    assert process.exit_code() == 2
    line = process.output("stderr")
    assert line.startswith("error: command line: use_sim_time: cannot be true with publish_clock")
    assert line.count("\n") == 1

    client = connect(start_node(publish_clock=True))
    refused = client.set_parameter("use_sim_time", True)
    assert not refused.successful
    assert "publish_clock" in refused.reason
    client.clear()
    client.wait(lambda: len(client.joints) > 3)
    assert not client.set_parameter("publish_clock", False).successful  # read-only
