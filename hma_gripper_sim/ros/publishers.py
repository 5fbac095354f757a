"""Everything that the node publishes."""

from __future__ import annotations

import time
from collections import deque

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from std_msgs.msg import String

from hma_gripper_sim.bags.message_template import MessageTemplate
from hma_gripper_sim.device.arbitration import Arbiter
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.device.settings import Settings
from hma_gripper_sim.device.tick_messages import TickMessages
from hma_gripper_sim.device.tick_schedule import Timeline
from hma_gripper_sim.device.topics import (
    CLOCK,
    CONTOUR,
    DIAGNOSTICS,
    JOINT_STATES,
    MARKERS,
    STAMPED_TOPICS,
    NodeTopic,
)
from hma_gripper_sim.ros.company import Company
from hma_gripper_sim.ros.diagnostics import Diagnostics, Pace
from hma_gripper_sim.ros.markers import MarkerMessages
from hma_gripper_sim.ros.message_bytes import header_stamp
from hma_gripper_sim.ros.message_types import message_type
from hma_gripper_sim.ros.node_clock import NodeClock
from hma_gripper_sim.simulation.state import SimulationState

STATE_QOS = QoSProfile(depth=100)
"""A recorder that stalls for a tenth of a second at 1 kHz loses nothing."""

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

STAMPS_KEPT = 1000
"""Ticks of which it is known that they have been published here."""

DIAGNOSTICS_PERIOD = 1.0
"""Time between two reports on this machine's clock [s]."""


class Outputs:
    """The publishers: what goes out every tick, and what has a slower pace of its own.

    Parameters
    ----------
    node
        Publishes.
    settings
        At the start.
    """

    def __init__(self, node: Node, settings: Settings) -> None:
        scene = settings.scenes[settings.contour]
        self._node = node
        self._tick_messages = TickMessages(scene, settings.prefix)
        self._states = {topic: _publisher(node, topic, STATE_QOS) for topic in STAMPED_TOPICS}
        self._contour = _publisher(node, CONTOUR, LATCHED_QOS)
        self._clock = _publisher(node, CLOCK, STATE_QOS) if settings.publish_clock else None
        self._size = 0  # of joint states [bytes]
        self._stamps: deque[int] = deque(maxlen=STAMPS_KEPT)
        self._clock_message = MessageTemplate(serialize_message(Clock()), np.empty((0, 0)))
        self._markers = _publisher(node, MARKERS, LATCHED_QOS)
        self._marker_messages = MarkerMessages(settings.prefix)
        self._drawn: tuple[str, SimulationState] | None = None
        self._markers_due = 0.0
        self._diagnostics = _publisher(node, DIAGNOSTICS, QoSProfile(depth=10))
        self._reports = Diagnostics(node.get_fully_qualified_name().strip("/"), scene.design)
        self._pace = Pace()
        self._reported = time.monotonic()
        self._accounted = 0

    def was_published_here(self, joint_states: bytes) -> bool:
        """Whether serialised joint states are among the last that were published here."""
        return len(joint_states) == self._size and header_stamp(joint_states) in self._stamps

    def publish_contour(self, name: str) -> None:
        """Publish which object is in place."""
        self._contour.publish(String(data=name))

    def publish_state(self, state: SimulationState, stamp: int) -> None:
        """Publish a tick, stamped with a time in nanoseconds; the clock after what happened."""
        messages = self._tick_messages.of_tick(state, stamp)
        self._size = len(messages[JOINT_STATES])
        self._stamps.append(stamp)
        for topic, message in messages.items():
            self._states[topic].publish(message)
        if self._clock is not None:
            self._clock_message.stamp(*divmod(stamp, 1_000_000_000))
            self._clock.publish(self._clock_message.content)

    def count_tick(self, state: SimulationState, took: float, *, moved: bool) -> None:
        """Take a tick that took so long [s] into the next report."""
        self._pace.add(state, took, moved=moved)

    def publish_slow(
        self,
        settings: Settings,
        drive: Drive,
        arbiter: Arbiter,
        timeline: Timeline,
        clock: NodeClock,
        company: Company,
    ) -> None:
        """Publish markers and diagnostics when their time has come on this machine's clock."""
        now = time.monotonic()
        if now >= self._markers_due and settings.markers_rate:
            self._markers_due = now + 1.0 / settings.markers_rate
            self._draw(settings, drive, timeline.stamp)
        if now >= self._reported + DIAGNOSTICS_PERIOD:
            accounted = timeline.accounted(clock.now())
            report = self._reports.report(
                self._node.get_clock().now().to_msg(),
                drive.status(),
                arbiter.counts,
                drive.snapshot(),
                drive.validity(),
                self._pace,
                timeline.overruns,
                period=settings.period,
                factor=settings.real_time_factor,
                elapsed=now - self._reported,
                clock_elapsed=1e-9 * (accounted - self._accounted),
                clock_problem=clock.problem(company.clock_publishers),
                company=company.findings,
            )
            self._diagnostics.publish(report)
            self._pace = Pace()
            self._reported, self._accounted = now, accounted

    def _draw(self, settings: Settings, drive: Drive, stamp: int) -> None:
        """Publish markers where someone listens and something has changed; the last are latched."""
        picture = (settings.contour, drive.state)
        seen = self._drawn is not None and all(
            new is old for new, old in zip(picture, self._drawn, strict=True)
        )
        if seen or drive.status().failure or not self._markers.get_subscription_count():
            return
        scene = settings.scenes[settings.contour]
        self._marker_messages.fill(scene, drive.state, drive.snapshot(), stamp)
        self._markers.publish(self._marker_messages.message)
        self._drawn = picture


def _publisher(node: Node, topic: NodeTopic, qos: QoSProfile) -> Publisher:
    return node.create_publisher(message_type(topic), topic.relative, qos)
