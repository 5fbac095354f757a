"""Others on the graph: the same name, the same joints, several senders, senders of other kinds."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

CMD_VELOCITY = "/hma_gripper_sim/cmd_velocity"
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


def status(reports, part):
    """The last report of a part of the node: its message, and its values."""
    found = [s for report in reports for s in report.status if s.name.endswith(f": {part}")]
    if not found:
        return "", {}
    return found[-1].message, {pair.key: pair.value for pair in found[-1].values}


def said(process, reports, *texts):
    """Whether all of it stands in the log, and in the diagnostics."""
    message, _ = status(reports, "graph")
    return all(text in process.output("stderr") and text in message for text in texts)


def test_a_second_node_of_the_same_name_is_noticed_by_both(start_node, connect):
    first, second = start_node(), start_node()
    client = connect(first)
    second.wait_until_ready()
    reports = client.listen(DiagnosticArray, "/diagnostics")
    for process in (first, second):
        client.wait(lambda p=process: said(p, reports, "another node is called /hma_gripper_sim"))


def test_another_publisher_of_the_joint_is_named(start_node, connect):
    process = start_node()
    client = connect(process)
    reports = client.listen(DiagnosticArray, "/diagnostics")
    beside = client.publisher(JointState, "/joint_states", 10)

    def told():
        beside.publish(JointState(name=["wrist", "slide"], position=[0.0, 0.0]))
        return said(process, reports, "the joint 'slide' is also published", "by /test_client")

    client.wait(told)


def test_joint_states_of_an_arm_are_nobodys_business(start_node, connect):
    process = start_node()
    client = connect(process)
    reports = client.listen(DiagnosticArray, "/diagnostics")
    beside = client.publisher(JointState, "/joint_states", 10)

    def reported():
        beside.publish(JointState(name=["wrist"], position=[0.0]))
        return len(reports) > 4  # a second each

    client.wait(reported)
    assert status(reports, "graph")[0] == "nobody is in the way"


@pytest.mark.parametrize("topics", [("cmd_velocity",), ("cmd_velocity", "commands")])
def test_senders_that_command_in_turn_are_named(start_node, connect, topics):
    process = start_node()
    client = connect(process)
    reports = client.listen(DiagnosticArray, "/diagnostics")
    kinds = {"cmd_velocity": Float64(), "commands": Float64MultiArray(data=[0.0])}
    senders = [
        (client.publisher(type(kinds[topic]), f"/hma_gripper_sim/{topic}", of=name), kinds[topic])
        for topic, name in zip(2 * topics, ("teleop", "planner"), strict=False)
    ]

    def told():
        for publisher, message in senders:
            publisher.publish(message)
            client.wait(lambda: True)
        return said(process, reports, "several senders command in turn", "/planner", "/teleop")

    client.wait(told)


def test_one_sender_may_use_several_topics(start_node, connect):
    client = connect(start_node())
    reports = client.listen(DiagnosticArray, "/diagnostics")
    for _ in range(20):
        client.command(0.0)
        client.send("commands", Float64MultiArray(data=[0.0]))
    reports.clear()
    client.wait(lambda: len(reports) > 1)
    assert status(reports, "graph")[0] == "nobody is in the way"


def test_best_effort_and_reliable_senders_are_heard_each_message_once(start_node, connect):
    process = start_node(command_timeout=0.0)
    client = connect(process)
    reports = client.listen(DiagnosticArray, "/diagnostics")
    hasty = client.publisher(Float64, CMD_VELOCITY, BEST_EFFORT)

    def heard():
        hasty.publish(Float64(data=0.001))
        return client.joints[-1].velocity[0] == 0.001

    def counts():
        drive = (status([report], "drive")[1] for report in reports)
        return [int(values["cmd_velocity: accepted"]) for values in drive]

    client.wait(heard)
    reports.clear()
    client.wait(lambda: len(counts()) > 1 and counts()[-1] == counts()[-2])  # none is on its way
    before = counts()[-1]
    for i in range(10):
        client.command(1e-4 * i)
        client.wait(lambda v=1e-4 * i: client.joints[-1].velocity[0] == v)
    reports.clear()
    client.wait(lambda: len(counts()) > 1)
    assert counts()[-1] == before + 10


def test_whole_numbers_are_taken_where_floats_are_meant(start_node, connect):
    """`ros2 param set NODE friction 1` sends an integer."""
    client = connect(start_node())
    assert client.set_parameter("friction", 1).successful
    value = client.get_parameter("friction")
    assert value == 1.0
    assert isinstance(value, float)
    points = [-1, -1, 1, -1, 0, 1]
    refused = client.set_parameter("contours.wedge.points", points)
    assert "expected type" not in refused.reason.lower()
    assert not client.set_parameter("friction", -1).successful
    assert not client.set_parameter("step_ticks", 1.5).successful


def test_two_grippers_side_by_side_share_no_name(start_node, connect):
    """One in the namespace `left`, with a prefix; the other plain. An arm reads both."""
    from geometry_msgs.msg import WrenchStamped

    left = start_node("-r", "__ns:=/left", prefix="left_", real_time_factor=2.0)
    client = connect(start_node())
    left.wait_until_ready()
    reports = client.listen(DiagnosticArray, "/diagnostics")
    states = client.listen(JointState, "/left/joint_states")
    wrenches = client.listen(WrenchStamped, "/left/hma_gripper_sim/actuator_wrench")
    commands = client.publisher(JointState, "/left/hma_gripper_sim/joint_commands")
    client.wait(lambda: states and wrenches)
    assert list(states[0].name) == [f"left_{name}" for name in client.joints[0].name]
    assert wrenches[0].header.frame_id == "left_gripper_mount"
    commands.publish(JointState(name=["left_slide"], position=[0.003]))
    client.wait(lambda: states[-1].position[0] == pytest.approx(0.003, abs=1e-9))
    assert client.joints[-1].position[0] == 0.0  # the other one has not moved

    def parts():
        return {(s.name.split(": ")[0], s.hardware_id) for r in reports for s in r.status}

    client.wait(lambda: len(parts()) == 2)
    names = {"hma_gripper_sim", "left/hma_gripper_sim"}
    assert parts() == {(name, name) for name in names}
