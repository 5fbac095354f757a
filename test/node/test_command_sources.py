"""The ways to command the node, and to put an object in place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from patience import patience

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

PERIOD_NS = 10_000_000
TICKS = 120
SPEED = 0.02


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def status(messages, part):
    """The last status of one part of the node on /diagnostics, as level, text and values."""
    found = [s for message in messages for s in message.status if s.name.endswith(f": {part}")]
    if not found:
        return None, "", {}
    values = {pair.key: pair.value for pair in found[-1].values}
    return found[-1].level, found[-1].message, values


def seconds(time):
    from builtin_interfaces.msg import Duration

    return Duration(sec=int(time), nanosec=round(time % 1 * 1e9))


def trajectory(*points, names=("slide",), **fields):
    """A JointTrajectory of points (time, field=[...])."""
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    way = [JointTrajectoryPoint(time_from_start=seconds(t), **values) for t, values in points]
    return JointTrajectory(joint_names=list(names), points=way, **fields)


def stepped_motion(client):
    """Force and angles of `TICKS` ticks that are stepped from the present pose, by tick."""
    client.clear()
    client.wait(lambda: len({stamp_ns(m) for m in client.joints[-2:]}) < len(client.joints[-2:]))
    start = stamp_ns(client.joints[-1])
    client.clear()
    assert client.call("step").success
    end = start + TICKS * PERIOD_NS
    client.wait(lambda: all(r and stamp_ns(r[-1]) >= end for r in (client.wrenches, client.phi)))
    force = {stamp_ns(m) - start: m.wrench.force.z for m in client.wrenches}
    phi = {stamp_ns(m) - start: tuple(m.position) for m in client.phi}
    ticks = [i * PERIOD_NS for i in range(1, TICKS + 1)]
    return np.array([(force[tick], *phi[tick]) for tick in ticks])


def test_the_same_motion_through_each_way_in_gives_the_same_forces_and_angles(start_node, connect):
    from diagnostic_msgs.msg import DiagnosticArray
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64, Float64MultiArray, Header

    client = connect(start_node(command_timeout=0.0, step_ticks=TICKS))
    assert client.call("pause", True).success
    reports = client.listen(DiagnosticArray, "/diagnostics")
    ramp = SPEED / 0.5  # at max_acceleration
    end = 10.0
    messages = {
        "cmd_velocity": lambda: Float64(data=SPEED),
        "commands": lambda: Float64MultiArray(data=[SPEED]),
        "joint_commands": lambda: JointState(
            header=Header(stamp=client.now()), name=["elbow", "slide"], velocity=[math.nan, SPEED]
        ),
        "joint_trajectory": lambda: trajectory(
            (ramp, {"velocities": [SPEED]}),
            (end, {"velocities": [SPEED]}),
            (end + ramp, {"velocities": [0.0]}),
        ),
    }
    motions = {}
    for name, message in messages.items():
        assert client.call("reset").success
        client.send(name, message())
        motions[name] = stepped_motion(client)
        reports.clear()
        client.wait(lambda: status(reports, "drive")[2])
        assert status(reports, "drive")[2]["in charge"] == name
        assert status(reports, "drive")[2][f"{name}: accepted"] == "1"
    expected = motions.pop("cmd_velocity")
    assert expected[:, 0].max() > 0.3  # it presses on the object
    assert np.array_equal(motions.pop("commands"), expected)
    assert np.array_equal(motions.pop("joint_commands"), expected)
    # The spline's travel is rounded differently: 1e-12 m at a contact of 1e4 N/m.
    assert motions.pop("joint_trajectory") == pytest.approx(expected, abs=1e-7)


def test_what_is_no_command_changes_nothing_and_is_counted_by_source(start_node, connect):
    from builtin_interfaces.msg import Time
    from diagnostic_msgs.msg import DiagnosticArray
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64, Float64MultiArray, Header

    client = connect(start_node(command_timeout=60.0))
    reports = client.listen(DiagnosticArray, "/diagnostics")
    client.send("joint_commands", JointState(
        header=Header(stamp=client.now()), name=["slide"], velocity=[0.001]
    ))  # fmt: skip
    client.wait(lambda: client.joints[-1].velocity[0] == 0.001)
    now = client.now()
    earlier = Header(stamp=Time(sec=now.sec - 30, nanosec=now.nanosec))
    stale = Header(stamp=Time(sec=now.sec - 90, nanosec=now.nanosec))
    future = Header(stamp=Time(sec=now.sec + 30, nanosec=now.nanosec))
    rejected = {
        "cmd_velocity": [Float64(data=value) for value in (math.nan, math.inf, -math.inf)],
        "commands": [
            Float64MultiArray(), Float64MultiArray(data=[0.01, 0.01]),
            Float64MultiArray(data=[math.nan]),
        ],
        "joint_commands": [
            JointState(), JointState(name=["elbow"], velocity=[0.01]),
            JointState(name=["slide"]), JointState(name=["slide"], velocity=[0.01, 0.01]),
            JointState(name=["slide"], velocity=[math.inf]),
        ],
        "joint_trajectory": [
            trajectory((1.0, {"positions": [0.01]}), names=("elbow",)),
            trajectory((1.0, {"positions": [0.01, 0.02]})),
            trajectory((1.0, {"positions": [math.nan]})),
            trajectory((1.0, {"positions": [1e300]})),
            trajectory((1.0, {})),
            trajectory((1.0, {"positions": [0.01]}), (1.0, {"positions": [0.02]})),
            trajectory((1.0, {"positions": [0.01], "velocities": [0.01]})),
        ],
    }  # fmt: skip
    outdated = {
        "joint_commands": [
            JointState(header=header, name=["slide"], velocity=[0.01])
            for header in (earlier, stale, future)
        ],
        "joint_trajectory": [trajectory((1.0, {"positions": [0.01]}), header=stale)],
    }
    for messages in (rejected, outdated):
        for topic, refused in messages.items():
            for message in refused:
                client.send(topic, message)
                # Depth is 1: the next may replace one that has not been taken yet.
                client.clear()
                client.wait(lambda: len(client.joints) > 2)
    reports.clear()
    client.wait(lambda: status(reports, "drive")[2])
    _, _, values = status(reports, "drive")
    assert values["in charge"] == "joint_commands"
    for topic, refused in rejected.items():
        assert values[f"{topic}: rejected"] == str(len(refused)), topic
    for topic, refused in outdated.items():
        assert values[f"{topic}: out of date"] == str(len(refused)), topic
    assert {m.velocity[0] for m in client.joints[-50:]} == {0.001}


def test_trajectories_start_when_they_say_and_end_when_told(start_node, connect):
    from builtin_interfaces.msg import Time
    from std_msgs.msg import Header

    # Its stamps are simulated time: a node that follows this machine's clock gives up its lag
    # where the machine is busy, and the trajectory has then begun earlier.
    client = connect(start_node(command_timeout=0.1, publish_clock=True))
    client.send("joint_trajectory", trajectory())  # finds the node, which may take a while
    client.clear()
    client.wait(lambda: client.joints)
    # Ahead by whole ticks, and longer than the message takes, however busy the machine is.
    begin = stamp_ns(client.joints[-1]) + 10_000_000 * round(100 * patience(1.0))
    later = Header(stamp=Time(sec=begin // 10**9, nanosec=begin % 10**9))
    client.send("joint_trajectory", trajectory(
        (0.0, {"positions": [0.0], "velocities": [0.0]}),
        (0.5, {"positions": [0.01], "velocities": [0.0]}), header=later,
    ))  # fmt: skip
    client.wait(lambda: client.joints[-1].position[0] == pytest.approx(0.01, abs=1e-9))
    for message in client.joints:
        s = min(max(1e-9 * (stamp_ns(message) - begin) / 0.5, 0.0), 1.0)
        # Cubic from rest to rest, to T³ |j| / 24 with j = 12 d / t³ (see Drive.follow).
        expected = 0.01 * (3 * s**2 - 2 * s**3)
        assert message.position[0] == pytest.approx(expected, abs=5e-8)
    client.send("joint_trajectory", trajectory((20.0, {"positions": [0.02]})))
    client.wait(lambda: client.joints[-1].position[0] > 0.0105)
    assert client.joints[-1].velocity[0] > 0.0
    client.send("joint_trajectory", trajectory())  # none: stop
    client.wait(lambda: client.joints[-1].velocity[0] == 0.0)


def test_an_outline_becomes_an_object(start_node, connect):
    from geometry_msgs.msg import Point32, Polygon, PolygonStamped

    def outline(*points):
        corners = [Point32(x=float(x), z=float(z)) for x, z in points]
        return PolygonStamped(polygon=Polygon(points=corners))

    process = start_node(outline__clearance=0.002, real_time_factor=4.0, command_timeout=0.0)
    client = connect(process)
    refused = client.call("select_contour/outline")
    assert not refused.success
    assert "no outline" in refused.message

    angles = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    client.send("outline", outline(*(0.015 * np.array([np.cos(a), np.sin(a)]) for a in angles)))
    client.wait(lambda: "200 points, a polygon of 32 corners" in process.output("stderr"))
    assert client.call("select_contour/outline").success
    client.wait(lambda: client.contours[-1:] == ["outline"])
    client.command(0.01)
    # It touches after 2 mm, not after 4 mm as the box that it has replaced.
    client.wait(lambda: any(message.effort[0] > 0.0 for message in client.joints))
    touched = next(message for message in client.joints if message.effort[0] > 0.0)
    assert touched.position[0] < 0.0035
    # Nothing is taken from outlines that show no object, nor from one that is where the gripper is.
    for points, reason in (
        ([(0, 0), (math.nan, 0), (0, 0.01)], "finite"),
        ([(-0.05, 0), (0.05, 0), (0.05, 0.1), (-0.05, 0.1)], "overlap"),
    ):

        def told(points=points, reason=reason):  # at most once a second
            client.send("outline", outline(*points))
            return reason in process.output("stderr")

        client.wait(told)
    assert client.call("reset").success
    assert client.call("select_contour/box").success
