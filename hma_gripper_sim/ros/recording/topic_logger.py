"""Listening to the simulation node, and logging what it says."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import TypeVar

from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

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
from hma_gripper_sim.ros.message_bytes import header_stamp
from hma_gripper_sim.ros.message_types import message_type

_QUEUE = 10_000
"""Messages that wait while this process is busy: none may be lost."""

_ENDLESS = 2**63

_SLIDE_ENTRY = SLIDE.encode() + b"\0"
"""In serialised joint states that hold the joint, whatever its prefix."""


class TopicLogger:
    """Knows the node's last messages, and writes all of them to a log while there is one.

    Messages stay serialised. In the log each has the stamp of its header; one without a header
    has that of the last joint states: simulated time, at any real-time factor.

    No executor has the recorder's ROS node. Its messages are taken in bulk, which is several
    times faster than an executor's round for each of them: who falls behind acts on old news.

    Others may publish joint states, even of the gripper's joints, on the same topic. Those of the
    node have the stamp of one of its actuator wrenches.

    Parameters
    ----------
    context
        Of ROS.
    topics
        What to listen to; they are named as those of the node `NODE`.
    name
        Full name of the simulation node.

    Attributes
    ----------
    logged
        How many messages of each topic have been written to logs.
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
                message_type(topic), self._names[topic], _not_called, _qos(topic), raw=True
            )
            for topic in topics
        }
        self.logged: Counter[Topic] = Counter()
        self._set_back: set[Topic] = set()
        self._latest: dict[Topic, bytes] = {}
        self._log: LogWriter | None = None
        self._after = self._until = 0
        self._unconfirmed: dict[int, bytes] = {}
        self._confirmed: dict[int, None] = {}

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
    def set_back(self) -> bool:
        """Whether the node's time has run back; ticks since then are left out."""
        return bool(self._set_back)

    @property
    def stamp(self) -> int:
        """Stamp of the last joint states [ns]."""
        return header_stamp(self._latest[JOINT_STATES])

    @property
    def slide(self) -> tuple[float, float]:
        """Travel [m] and velocity [m/s] of the prismatic joint."""
        joints = deserialize_message(self._latest[JOINT_STATES], JointState)
        return joints.position[0], joints.velocity[0]

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
        if any(header_stamp(self._latest[topic]) < self._until for topic in STAMPED_TOPICS):
            return False
        self._log = None
        return True

    def close(self) -> None:
        """Leave ROS."""
        self._node.destroy_node()

    def _on_message(self, topic: Topic, data: bytes) -> None:
        if topic is JOINT_STATES:
            self._on_joint_states(data)
            return
        self._accept(topic, data)
        if topic is ACTUATOR_WRENCH:
            stamp = header_stamp(data)
            joints = self._unconfirmed.pop(stamp, None)
            if joints is None:
                _note(self._confirmed, stamp, None)
            else:
                self._accept(JOINT_STATES, joints)

    def _on_joint_states(self, data: bytes) -> None:
        stamp = header_stamp(data)
        if _SLIDE_ENTRY not in data:
            return
        if stamp in self._confirmed:
            del self._confirmed[stamp]
            self._accept(JOINT_STATES, data)
        else:
            # Those of others on the same clock may have the stamp, but not all numbers.
            longest = max(data, self._unconfirmed.get(stamp, b""), key=len)
            _note(self._unconfirmed, stamp, longest)

    def _accept(self, topic: Topic, data: bytes) -> None:
        if topic in STAMPED_TOPICS and topic in self._latest:
            if header_stamp(data) < header_stamp(self._latest[topic]):
                self._set_back.add(topic)
            if topic in self._set_back:
                return
        self._latest[topic] = data
        if self._log is None:
            return
        if topic not in STAMPED_TOPICS:
            self._write(topic, self.stamp, data)
        elif self._after < (stamp := header_stamp(data)) <= self._until:
            self._write(topic, stamp, data)

    def _write(self, topic: Topic, stamp: int, data: bytes) -> None:
        if self._log is not None:
            self._log.write(self._names[topic], stamp, data)
            self.logged[topic] += 1

    def _newest_stamp(self) -> int:
        return max(header_stamp(self._latest[topic]) for topic in STAMPED_TOPICS)


def _not_called(_: bytes) -> None:
    """Stand in for a subscription's callback."""


def _qos(topic: Topic) -> QoSProfile:
    if topic.latched:
        return QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    return QoSProfile(depth=_QUEUE)


T = TypeVar("T")


def _note(record: dict[int, T], stamp: int, what: T) -> None:
    record[stamp] = what
    if len(record) > _QUEUE:
        del record[next(iter(record))]
