"""The topics that the simulation node publishes and a log of it holds."""

from __future__ import annotations

from dataclasses import replace

from hma_gripper_sim.bags.topic import Topic

NODE = "/hma_gripper_sim"
"""Full name of the node; its private topics and services live below it."""


JOINT_STATES = Topic("/joint_states", "sensor_msgs/msg/JointState")
ACTUATOR_WRENCH = Topic(f"{NODE}/actuator_wrench", "geometry_msgs/msg/WrenchStamped")
PHI = Topic(f"{NODE}/phi", "sensor_msgs/msg/JointState")
CONTOUR = Topic(f"{NODE}/contour", "std_msgs/msg/String", latched=True)
CMD_VELOCITY = Topic(f"{NODE}/cmd_velocity", "std_msgs/msg/Float64")
JOINT_TRAJECTORY = Topic(f"{NODE}/joint_trajectory", "trajectory_msgs/msg/JointTrajectory")

STAMPED_TOPICS = (JOINT_STATES, ACTUATOR_WRENCH, PHI)
"""What the node publishes every tick, all with the same stamp."""

LOGGED_TOPICS = (*STAMPED_TOPICS, CONTOUR, CMD_VELOCITY, JOINT_TRAJECTORY)
"""What it takes to see a run again."""

RECORDED_TOPICS = (
    *LOGGED_TOPICS,
    Topic(f"{NODE}/commands", "std_msgs/msg/Float64MultiArray"),
    Topic(f"{NODE}/joint_commands", "sensor_msgs/msg/JointState"),
    Topic(f"{NODE}/outline", "geometry_msgs/msg/PolygonStamped"),
    Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray"),
)
"""All that the node takes and publishes, but for pictures and the clock."""


def topic_of(node: str, topic: Topic) -> Topic:
    """Return the same topic of a node with another full name."""
    if topic.name.startswith(f"{NODE}/"):
        return replace(topic, name=node + topic.name.removeprefix(NODE))
    if topic == JOINT_STATES:  # beside the node, not below it
        return replace(topic, name=node.rpartition("/")[0] + topic.name)
    return topic
