"""Whatever is thrown at the running node: it goes on, says only what is finite, and stops."""

from __future__ import annotations

import json
import math
import random
import signal
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from patience import patience

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

TOOLS = Path(__file__).parents[2] / "tools"
MAX_VELOCITY, TRAVEL_MAX = 0.05, 0.03
REQUESTS = 150
FLOOD = 20_000


def stamp_ns(message):
    return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


def check_states(client):
    """Everything that has come is finite, within the limits and in order."""
    for message in client.joints:
        for numbers in (message.position, message.velocity, message.effort):
            assert len(numbers) == 63
            assert np.isfinite(numbers).all()
        assert -1e-12 <= message.position[0] <= TRAVEL_MAX + 1e-12
        assert abs(message.velocity[0]) <= MAX_VELOCITY
    assert all(math.isfinite(message.wrench.force.z) for message in client.wrenches)
    assert all(np.isfinite(message.position).all() for message in client.phi)
    assert all(stamp_ns(later) >= stamp_ns(earlier) for earlier, later in pairwise(client.joints))


def check_alive_and_not_stuck(process, client):
    """It comes to rest when commands cease, moves when told to, and ends with exit code 0."""
    assert client.call("pause", False).success
    client.clear()
    client.wait(lambda: client.joints and client.joints[-1].velocity[0] == 0.0)
    assert client.call("reset").success
    client.command(0.01)
    client.clear()
    client.wait(lambda: client.joints and client.joints[-1].velocity[0] == 0.01)
    process.send_signal(signal.SIGTERM)
    assert process.exit_code() == 0
    for sign in ("Traceback", "callback failed"):
        assert sign not in process.output("stderr")


def test_a_flood_of_commands(start_node, connect):
    """A second of them, good, bad and contradicting ones, as fast as this process can."""
    from rclpy.serialization import serialize_message
    from std_msgs.msg import Float64

    process = start_node(publish_rate=500.0)
    client = connect(process)
    values = (0.01, -0.01, math.nan, 0.004, math.inf, 1e300)
    messages = [serialize_message(Float64(data=value)) for value in values]
    publisher = client._node.create_publisher(Float64, "/hma_gripper_sim/cmd_velocity", 1)
    client.wait(publisher.get_subscription_count)
    client.clear()
    sent, end = 0, time.monotonic() + 1.0
    while sent < FLOOD or time.monotonic() < end:
        for message in 5 * messages:
            publisher.publish(message)
        sent += 5 * len(messages)
        client._executor.spin_once(timeout_sec=0.0)
    assert client.call("reset").success  # it has not fallen behind: this comes next
    assert any(message.velocity[0] != 0.0 for message in client.joints)
    check_states(client)
    check_alive_and_not_stuck(process, client)


def test_a_storm_of_requests_in_motion(start_node, connect):
    """Services, parameters and commands at random, many of which cannot be granted."""
    from geometry_msgs.msg import Point32, Polygon, PolygonStamped
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64, Float64MultiArray
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    process = start_node(max_velocity=MAX_VELOCITY, travel_max=TRAVEL_MAX)
    client = connect(process)
    chance = random.Random(1)
    numbers = (0.02, -0.01, 0.05, math.nan, math.inf, -1e300, 1e-310)
    parameters = {
        "friction": (0.0, 0.6, 1.3, -1.0, math.nan, "rough"),
        "publish_rate": (100.0, 37.0, 200.0, 0.0, 1e9),
        "real_time_factor": (1.0, 2.0, -1.0),
        "contour": ("box", "cylinder", "outline", "mug"),
        "contours.box.width": (0.028, 0.02, -1.0, 1e9),
        "travel_min": (0.0, 0.01),
        "max_acceleration": (0.5, 5.0, 0.0),
        "design": ("other.yaml",),
        "use_sim_time": (False,),
        "nonsense": (1.0,),
    }

    def number():
        return chance.choice(numbers)

    def trajectory():
        points = [JointTrajectoryPoint(positions=[0.02 * chance.random()]) for _ in range(3)]
        for i, point in enumerate(points):
            point.time_from_start.nanosec = chance.choice([0, 1, i * 100_000_000])
        points[-1].positions[0] = chance.choice([0.01, 0.0, number()])
        return JointTrajectory(joint_names=[chance.choice(["slide", "elbow"])], points=points)

    def outline():
        corners = [Point32(x=float(x), z=float(z)) for x, z in ((-0.01, 0), (0.01, 0), (0, 0.01))]
        corners[0].x = chance.choice([-0.01, 0.01, math.nan, -5.0])
        return PolygonStamped(polygon=Polygon(points=corners))

    def parameter():
        name = chance.choice(list(parameters))
        client.set_parameter(name, chance.choice(parameters[name]))

    requests = (
        *4 * (lambda: client.send("cmd_velocity", Float64(data=number())),),
        lambda: client.send("commands", Float64MultiArray(data=[number()] * chance.randrange(3))),
        lambda: client.send("joint_commands", JointState(
            name=["slide", "elbow"][: chance.randrange(3)],
            velocity=[number()] * chance.randrange(3),
        )),
        lambda: client.send("joint_trajectory", trajectory()),
        lambda: client.send("outline", outline()),
        lambda: chance.random() < 0.3 and client.call("reset"),
        lambda: client.call("step"),
        lambda: client.call("pause", chance.random() < 0.3),
        lambda: client.call(f"select_contour/{chance.choice(['box', 'cylinder', 'outline'])}"),
        *4 * (parameter,),
    )  # fmt: skip
    for _ in range(REQUESTS):
        chance.choice(requests)()
        seen = len(client.joints)
        client.wait(lambda seen=seen: len(client.joints) > seen + 1)  # time for it to matter
    for name in ("publish_rate", "real_time_factor", "max_acceleration"):
        assert client.set_parameter(name, parameters[name][0]).successful
    assert client.call("pause", True).success
    client.wait(lambda: len({stamp_ns(m) for m in client.joints[-2:]}) == 1)  # all has come
    check_states(client)
    assert len({message.position[0] for message in client.joints}) > 20  # it has moved
    check_alive_and_not_stuck(process, client)


def test_signals_at_any_moment_end_it_cleanly():
    """A few moments of what ``tools/ros_signals.py`` does: exit code, traceback, memory."""
    command = [sys.executable, str(TOOLS / "ros_signals.py"), "--moments", "4"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=patience(300.0))
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads(done.stdout)["clean"] == 4
