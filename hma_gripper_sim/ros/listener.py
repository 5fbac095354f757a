"""Subscriptions that hear reliable publishers and best-effort ones."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

_DEPTH = 1
"""Of commands and outlines: one that waits is replaced by the next."""

_RECENT = 8
"""Messages of which it is known that they have come."""


class Listener:
    """Takes the messages of a topic, whether their publishers are reliable or best-effort.

    A reliable subscription hears no best-effort publisher, and a best-effort one would lose
    messages of a reliable publisher. So the subscription is reliable, and has a best-effort one
    beside it as soon as there is a publisher that it cannot hear.

    Parameters
    ----------
    node
        Whose executor takes the messages.
    kind, topic
        Type and name.
    callback
        Called with each message and what is known about it, as rclpy gives it.
    """

    def __init__(
        self,
        node: Node,
        kind: type,
        topic: str,
        callback: Callable[[Any, Mapping[str, int]], None],
    ) -> None:
        self._node, self._kind, self._topic, self._callback = node, kind, topic, callback
        self._recent: deque[tuple[int, int]] = deque(maxlen=_RECENT)
        self._hears_all = False
        node.create_subscription(
            kind,
            topic,
            self._take,
            QoSProfile(depth=_DEPTH),
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=self._hear_all),
        )

    def _hear_all(self, _: object) -> None:
        if not self._hears_all:
            self._hears_all = True
            qos = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
            self._node.create_subscription(self._kind, self._topic, self._take_once, qos)

    def _take(self, message: Any, info: Mapping[str, int]) -> None:
        if self._hears_all:
            self._take_once(message, info)
        else:
            self._callback(message, info)

    def _take_once(self, message: Any, info: Mapping[str, int]) -> None:
        """Take a message unless it has come by the other subscription."""
        identity = info["source_timestamp"], info["publication_sequence_number"]
        if identity not in self._recent:
            self._recent.append(identity)
            self._callback(message, info)
