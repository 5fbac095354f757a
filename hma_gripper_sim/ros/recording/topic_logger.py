"""Listening to the simulation node, and logging what it says."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PolygonStamped, WrenchStamped
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, String
from trajectory_msgs.msg import JointTrajectory

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import (
    ACTUATOR_WRENCH,
    CMD_VELOCITY,
    CONTOUR,
    JOINT_STATES,
    LOGGED_TOPICS,
    NODE,
    STAMPED_TOPICS,
    topic_of,
)
from hma_gripper_sim.model.joint_names import SLIDE

_QUEUE = 10_000
"""Messages that wait while this process is busy: none may be lost."""

_ENDLESS = 2**63

_SLIDE_ENTRY = b"\0" + SLIDE.encode() + b"\0"

_MESSAGES = {
    "diagnostic_msgs/msg/DiagnosticArray": DiagnosticArray,
    "geometry_msgs/msg/PolygonStamped": PolygonStamped,
    "geometry_msgs/msg/WrenchStamped": WrenchStamped,
    "sensor_msgs/msg/JointState": JointState,
    "std_msgs/msg/Float64": Float64,
    "std_msgs/msg/Float64MultiArray": Float64MultiArray,
    "std_msgs/msg/String": String,
    "trajectory_msgs/msg/JointTrajectory": JointTrajectory,
}


class Recorder:
    """Knows the node's last messages, and writes all of them to a log while there is one.

    Messages stay serialised. In the log each has the stamp of its header; one without a header
    has that of the last joint states: simulated time, at any real-time factor.

    No executor has the recorder's ROS node. Its messages are taken in bulk, which is several
    times faster than an executor's round for each of them: who falls behind acts on old news.

    Parameters
    ----------
    context
        Of ROS.
    topics
        What to listen to; they are named as those of the node `NODE`.
    name
        Full name of the simulation node.
    """

    def __init__(
        self,
        context: Context,
        topics: Sequence[Topic] = LOGGED_TOPICS,
        name: str = NODE,
    ) -> None:
        self._node = Node("hma_gripper_recorder", context=context)
        self._names = {topic: topic_of(name, topic).name for topic in topics}
        self._subscriptions = {
            topic: self._node.create_subscription(
                _MESSAGES[topic.msgtype], self._names[topic], _not_called, _qos(topic), raw=True
            )
            for topic in topics
        }
        self.logged: Counter[Topic] = Counter()
        self._latest: dict[Topic, bytes] = {}
        self._log: LogWriter | None = None
        self._after = self._until = 0

    def take(self) -> None:
        """Take the messages that have arrived."""
        for topic, subscription in self._subscriptions.items():
            kind = subscription.msg_type
            with subscription.handle:
                while (taken := subscription.handle.take_message(kind, True)) is not None:
                    self._on_message(topic, taken[0])

    @property
    def node_is_there(self) -> bool:
        """Whether anyone publishes the actuator's force."""
        return bool(self._node.count_publishers(self._names[ACTUATOR_WRENCH]))

    @property
    def hears_node(self) -> bool:
        """Whether everything that the node publishes has arrived at least once."""
        return all(topic in self._latest for topic in (*STAMPED_TOPICS, CONTOUR))

    @property
    def stamp(self) -> int:
        """Stamp of the last joint states [ns]."""
        return _header_stamp(self._latest[JOINT_STATES])

    @property
    def slide(self) -> tuple[float, float]:
        """Travel [m] and velocity [m/s] of the prismatic joint."""
        joints = deserialize_message(self._latest[JOINT_STATES], JointState)
        index = joints.name.index(SLIDE)
        return joints.position[index], joints.velocity[index]

    @property
    def contour(self) -> str:
        """Name of the object in place."""
        return str(deserialize_message(self._latest[CONTOUR], String).data)

    @property
    def command(self) -> float:
        """Last velocity that anyone commanded [m/s]; NaN before the first."""
        if CMD_VELOCITY not in self._latest:
            return math.nan
        return float(deserialize_message(self._latest[CMD_VELOCITY], Float64).data)

    def start(self, log: LogWriter) -> None:
        """Log from the next tick on that is still to come as a whole."""
        self._log, self._after, self._until = log, self._newest_stamp(), _ENDLESS
        self._write(CONTOUR, self._after, self._latest[CONTOUR])

    def finish(self) -> None:
        """Log no tick of which nothing has arrived yet; see `finished`."""
        self._until = self._newest_stamp()

    @property
    def finished(self) -> bool:
        """Whether the last tick has been logged as a whole: the log may be closed."""
        if any(_header_stamp(self._latest[topic]) < self._until for topic in STAMPED_TOPICS):
            return False
        self._log = None
        return True

    def close(self) -> None:
        """Leave ROS."""
        self._node.destroy_node()

    def _on_message(self, topic: Topic, data: bytes) -> None:
        if topic is JOINT_STATES and _SLIDE_ENTRY not in data:
            return  # an arm's joints may come on the same topic
        self._latest[topic] = data
        if self._log is None:
            return
        if topic not in STAMPED_TOPICS:
            self._write(topic, self.stamp, data)
        elif self._after < (stamp := _header_stamp(data)) <= self._until:
            self._write(topic, stamp, data)

    def _write(self, topic: Topic, stamp: int, data: bytes) -> None:
        if self._log is not None:
            self._log.write(self._names[topic], stamp, data)
            self.logged[topic] += 1

    def _newest_stamp(self) -> int:
        return max(_header_stamp(self._latest[topic]) for topic in STAMPED_TOPICS)


def _not_called(_: bytes) -> None:
    """Stand in for a subscription's callback."""


def _qos(topic: Topic) -> QoSProfile:
    if topic.latched:
        return QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    return QoSProfile(depth=_QUEUE)


def _header_stamp(data: bytes) -> int:
    """Return the stamp [ns] of a message that starts with a header, from its CDR bytes."""
    order = "<" if data[1] & 1 else ">"
    seconds, nanoseconds = struct.unpack_from(f"{order}iI", data, 4)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)
