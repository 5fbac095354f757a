"""The topics of the node, in one table: names, message types, and what is on them.

Publishers, subscriptions, the recorder, replays, the documentation and the security policy go by
it.  What is published every tick has its messages in `device.tick_messages`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from hma_gripper_sim.bags.topic import Topic

NODE = "/hma_gripper_sim"
"""Full name of the node; its private topics and services live below it."""


@dataclass(frozen=True)
class NodeTopic(Topic):
    """A topic of the node, with what it means, for whoever uses it."""

    meaning: str = ""

    @property
    def relative(self) -> str:
        """The name that the node gives it: ``~/phi``, ``joint_states`` or ``/clock``."""
        if self.name.startswith(f"{NODE}/"):
            return "~" + self.name.removeprefix(NODE)
        return self.name.removeprefix("/") if self.name in _OF_THE_NAMESPACE else self.name


_OF_THE_NAMESPACE = ("/joint_states",)
"""Topics that lie beside the node, not below it."""

CMD_VELOCITY = NodeTopic(
    f"{NODE}/cmd_velocity",
    "std_msgs/msg/Float64",
    meaning="Velocity of the prismatic joint [m/s].",
)
COMMANDS = NodeTopic(
    f"{NODE}/commands",
    "std_msgs/msg/Float64MultiArray",
    meaning="The same, one element: what ros2_control's forward and velocity controllers take, so "
    "that their clients can be remapped to the node.",
)
JOINT_COMMANDS = NodeTopic(
    f"{NODE}/joint_commands",
    "sensor_msgs/msg/JointState",
    meaning="The same: velocity of the entry `slide`, wherever it stands; where that is left out "
    "or NaN, its position [m], which is gone to as fast as the limits allow, and kept. From "
    "topic-based ros2_control hardware, and from arms that command positions.",
)
JOINT_TRAJECTORY = NodeTopic(
    f"{NODE}/joint_trajectory",
    "trajectory_msgs/msg/JointTrajectory",
    meaning="Positions and/or velocities (and accelerations) of `slide`, interpolated as "
    "joint_trajectory_controller does. A new trajectory replaces the old; one without points "
    "stops.",
)
OUTLINES = NodeTopic(
    f"{NODE}/outline",
    "geometry_msgs/msg/PolygonStamped",
    meaning="Outline of an object as a camera sees it: x and z [m], the gripper's axis at x = 0, z "
    "up. It becomes the object `outline`. Convex up to noise; at most 32 corners are kept. In the "
    "frame `gripper_mount` z points towards the object; other frames are refused.",
)
JOINT_STATES = NodeTopic(
    "/joint_states",
    "sensor_msgs/msg/JointState",
    meaning="`slide` (m, m/s, N: the actuator force), then all revolute joints (rad, rad/s, N m: "
    "the moment of the spring-damper), in a fixed order. Every tick.",
)
ACTUATOR_WRENCH = NodeTopic(
    f"{NODE}/actuator_wrench",
    "geometry_msgs/msg/WrenchStamped",
    meaning="`force.z`: force with which the actuator pushes towards the object, in the frame "
    "`gripper_mount`; -0.0444 N while the gripper hangs free. Every tick.",
)
PHI = NodeTopic(
    f"{NODE}/phi",
    "sensor_msgs/msg/JointState",
    meaning="`phi_left`, `phi_right`: angle between the top beam and a side beam, and its rate; "
    "as effort the largest bending moment of any section of that side [N m], which `midpoint` and "
    "`gauss` alone add: with `thesis` it is the largest effort in `joint_states`. Every tick.",
)
CONTOUR = NodeTopic(
    f"{NODE}/contour",
    "std_msgs/msg/String",
    latched=True,
    meaning="Name of the object in place.",
)
MARKERS = NodeTopic(
    f"{NODE}/markers",
    "visualization_msgs/msg/MarkerArray",
    latched=True,
    meaning="Gripper, object and contact forces (0.05 m per N), in `gripper_mount`, for RViz and "
    "Foxglove. At `markers_rate` while someone listens.",
)
DIAGNOSTICS = NodeTopic(
    "/diagnostics",
    "diagnostic_msgs/msg/DiagnosticArray",
    meaning="See [Diagnostics](#diagnostics). Once a second.",
)
CLOCK = NodeTopic(
    "/clock",
    "rosgraph_msgs/msg/Clock",
    meaning="Published every tick with `publish_clock`, listened to with `use_sim_time`; otherwise "
    "neither.",
)

COMMAND_TOPICS = (CMD_VELOCITY, COMMANDS, JOINT_COMMANDS, JOINT_TRAJECTORY)
"""What commands the drive."""

STAMPED_TOPICS = (JOINT_STATES, ACTUATOR_WRENCH, PHI)
"""What the node publishes every tick, all with the same stamp."""

TOPICS = (*COMMAND_TOPICS, OUTLINES, *STAMPED_TOPICS, CONTOUR, MARKERS, DIAGNOSTICS, CLOCK)
"""All of them, in the order of the documentation."""

LOGGED_TOPICS = (*STAMPED_TOPICS, CONTOUR, CMD_VELOCITY, JOINT_TRAJECTORY)
"""What it takes to see a run again."""

RECORDED_TOPICS = (*LOGGED_TOPICS, COMMANDS, JOINT_COMMANDS, OUTLINES, DIAGNOSTICS)
"""All that the node takes and publishes, but for pictures and the clock."""


def topic_of(node: str, topic: Topic) -> Topic:
    """Return the same topic of a node with another full name."""
    if topic.name.startswith(f"{NODE}/"):
        return replace(topic, name=node + topic.name.removeprefix(NODE))
    if topic.name in _OF_THE_NAMESPACE:
        return replace(topic, name=node.rpartition("/")[0] + topic.name)
    return topic
