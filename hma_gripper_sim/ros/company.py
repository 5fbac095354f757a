"""Who else on the ROS graph does what only this node, or only one other, should do."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

LOOK_PERIOD = 1.0
"""How often the graph is looked at [s of this machine]."""

LISTEN = 3.0
"""How long a new publisher of joint states is listened to [s]."""

ALTERNATIONS = 4
"""Changes of the sender within `MEMORY` from which on commands alternate."""

MEMORY = 2.0
"""How long a change of the sender is remembered [s]."""


class Company:
    """Looks at the graph once a second, and says in the log what it finds.

    All of it happens in the callbacks' thread; only the attributes are for others.

    Parameters
    ----------
    node
        Whose company it is.
    slide
        Name of its prismatic joint.
    publishes_clock
        It is the clock of others.
    is_own
        Whether serialised joint states are the node's own.

    Attributes
    ----------
    findings
        What is wrong at the last look, one sentence each.
    clock_publishers
        Full names of the nodes that publish /clock, where this node uses or publishes it.
    """

    def __init__(
        self,
        node: Node,
        slide: str,
        *,
        publishes_clock: bool,
        was_published_here: Callable[[bytes], bool],
    ) -> None:
        self.findings: tuple[str, ...] = ()
        self.clock_publishers: tuple[str, ...] = ()
        self._node = node
        self._slide = slide
        self._publishes_clock = publishes_clock
        self._is_own = was_published_here
        self._joint_states = node.resolve_topic_name("joint_states")
        self._listened_to: frozenset[tuple[int, ...]] = frozenset()
        self._subscription: Subscription | None = None
        self._until = 0.0
        self._slide_is_published = False
        self._last: dict[str, int] = {}
        self._last_topic = ""
        self._changes: deque[tuple[float, str]] = deque()
        node.create_timer(LOOK_PERIOD, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def note_command(self, topic: str, info: Mapping[str, int]) -> None:
        """Take note of a command's sender: the numbers of one sender's messages increase."""
        number = info["publication_sequence_number"]
        before = self._last.get(topic, -1)
        self._last[topic] = number
        if self._last_topic and (topic != self._last_topic or number <= before):
            now = time.monotonic()
            self._changes += [(now, self._last_topic), (now, topic)]
        self._last_topic = topic

    def _look(self) -> None:
        findings = (*self._namesakes(), *self._clocks(), *self._joints(), *self._senders())
        for finding in findings:
            if finding not in self.findings:
                self._node.get_logger().warning(finding)
        self.findings = findings

    def _namesakes(self) -> Iterator[str]:
        name, namespace = self._node.get_name(), self._node.get_namespace()
        if self._node.get_node_names_and_namespaces().count((name, namespace)) > 1:
            full = self._node.get_fully_qualified_name()
            yield (
                f"another node is called {full}: both take the same commands and publish the same "
                "topics; end one, or start it in another namespace (-r __ns:=/NAME)"
            )

    def _clocks(self) -> Iterator[str]:
        if self._publishes_clock or self._node.get_parameter("use_sim_time").value:
            self.clock_publishers = tuple(self._publishers("/clock"))
            if len(self.clock_publishers) > 1:
                yield (
                    f"/clock has several publishers: {', '.join(self.clock_publishers)}; "
                    "time jumps unless they agree"
                )

    def _joints(self) -> Iterator[str]:
        """Listen to new publishers of joint states for a while: is this gripper's among them?"""
        others = self._publishers(self._joint_states)
        own = self._node.get_fully_qualified_name()
        if own in others:
            others.remove(own)
        endpoints = frozenset(
            tuple(endpoint.endpoint_gid)
            for endpoint in self._node.get_publishers_info_by_topic(self._joint_states)
        )
        now = time.monotonic()
        if endpoints != self._listened_to:
            self._listened_to = endpoints
            self._slide_is_published = False
            self._until = now + LISTEN
            if others and self._subscription is None:
                self._subscription = self._node.create_subscription(
                    JointState, self._joint_states, self._on_joint_states, QoSProfile(depth=10),
                    raw=True,
                )  # fmt: skip
        if self._subscription is not None and (not others or now > self._until):
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
        if others and self._slide_is_published:
            yield (
                f"the joint {self._slide!r} is also published on {self._joint_states}, by "
                f"{' or '.join(others)}: whoever listens gets two states of one joint; "
                "give this gripper a prefix, or the other publisher other joints"
            )

    def _on_joint_states(self, data: bytes) -> None:
        if b"\0" + self._slide.encode() + b"\0" in data and not self._is_own(data):
            self._slide_is_published = True

    def _senders(self) -> Iterator[str]:
        while self._changes and self._changes[0][0] < time.monotonic() - MEMORY:
            self._changes.popleft()
        if len(self._changes) < 2 * ALTERNATIONS:
            return
        senders = {
            topic: self._publishers(topic) for topic in sorted({t for _, t in self._changes})
        }
        if len({name for names in senders.values() for name in names}) > 1 or any(
            len(names) > 1 for names in senders.values()
        ):
            listed = "; ".join(f"{topic}: {', '.join(names)}" for topic, names in senders.items())
            yield f"several senders command in turn, and the last one counts ({listed})"

    def _publishers(self, topic: str) -> list[str]:
        """Full names of the nodes that publish a topic, once for each publisher."""
        return sorted(
            f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
            for endpoint in self._node.get_publishers_info_by_topic(topic)
        )
