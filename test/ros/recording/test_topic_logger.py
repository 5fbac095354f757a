"""The recorder, fed tick by tick: a log holds ticks as a whole or not at all."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from patience import patience
from rosbags.rosbag2 import Reader

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.device.topics import (
    ACTUATOR_WRENCH,
    CMD_VELOCITY,
    CONTOUR,
    JOINT_STATES,
    LOGGED_TOPICS,
    PHI,
    NodeTopic,
)
from hma_gripper_sim.ros.node_process import private_ros_domain


class Publisher:
    """Publishes what a node would, message by message, and waits until the recorder has it."""

    def __init__(self, context: Any, take: Callable[[], None]) -> None:
        import rclpy
        from geometry_msgs.msg import WrenchStamped
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64, String

        self._node = rclpy.create_node("publisher", context=context)
        self._kinds = {
            JOINT_STATES: JointState,
            PHI: JointState,
            ACTUATOR_WRENCH: WrenchStamped,
            CMD_VELOCITY: Float64,
            CONTOUR: String,
        }
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._publishers = {
            topic: self._node.create_publisher(kind, topic.name, latched if topic.latched else 10)
            for topic, kind in self._kinds.items()
        }
        self._take = take
        self.wait(lambda: all(p.get_subscription_count() for p in self._publishers.values()))

    def tick(self, second: int, *topics: NodeTopic) -> None:
        """Publish messages that are stamped with a whole second."""
        for topic in topics:
            message = self._kinds[topic]()
            message.header.stamp.sec = second
            if topic is JOINT_STATES:
                message.name, message.position, message.velocity = ["slide"], [0.5], [0.25]
            self._publishers[topic].publish(message)

    def tick_of_another(self, second: int, joint: str) -> None:
        """Publish joint states that are not the node's, on the same topic."""
        message = self._kinds[JOINT_STATES]()
        message.header.stamp.sec = second
        message.name, message.position = [joint], [9.0]
        self._publishers[JOINT_STATES].publish(message)

    def say(self, topic: NodeTopic, data: object) -> None:
        """Publish a message without a header."""
        self._publishers[topic].publish(self._kinds[topic](data=data))

    def wait(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + patience(20.0)
        while not condition():
            assert time.monotonic() < deadline, "waited in vain"
            self._take()
            time.sleep(0.002)

    def close(self) -> None:
        self._node.destroy_node()


@pytest.fixture
def pair() -> Iterator[tuple[Any, Publisher]]:
    """A recorder, and who it listens to."""
    import rclpy

    from hma_gripper_sim.ros.recording.topic_logger import TopicLogger

    context = rclpy.Context()
    with private_ros_domain():
        context.init()
    recorder = TopicLogger(context)
    publisher = Publisher(context, recorder.take)
    yield recorder, publisher
    publisher.close()
    recorder.close()
    context.try_shutdown()


def test_log_begins_and_ends_with_whole_ticks(pair: tuple[Any, Publisher], tmp_path: Path) -> None:
    """The log is started in the middle of tick 2 and finished in the middle of tick 4."""
    recorder, node = pair
    tick = (JOINT_STATES, ACTUATOR_WRENCH, PHI)
    node.tick(1, *tick)
    node.say(CONTOUR, "box")
    node.wait(lambda: recorder.hears_node)
    assert (recorder.contour, recorder.slide) == ("box", (0.5, 0.25))
    node.tick(2, JOINT_STATES, ACTUATOR_WRENCH)
    node.wait(lambda: recorder.stamp == 2_000_000_000)
    with LogWriter(tmp_path / "log", LOGGED_TOPICS) as log:
        recorder.start(log)
        node.tick(2, PHI)
        node.tick_of_another(9, "wrist")
        for second in (2, 3, 4, 7):  # of the gripper's own joint, and at its own times
            node.tick_of_another(second, "slide")
        node.tick(3, *tick)
        node.wait(lambda: recorder.stamp == 3_000_000_000)
        node.say(CMD_VELOCITY, 0.125)
        node.wait(lambda: recorder.command == 0.125)
        node.tick(4, JOINT_STATES, ACTUATOR_WRENCH)
        node.wait(lambda: recorder.stamp == 4_000_000_000)
        assert recorder.slide == (0.5, 0.25)
        recorder.finish()
        assert not recorder.finished
        node.tick(5, JOINT_STATES, ACTUATOR_WRENCH)
        node.wait(lambda: recorder.stamp == 5_000_000_000)
        node.tick(4, PHI)
        node.wait(lambda: recorder.finished)
    logged: dict[str, list[int]] = defaultdict(list)
    with Reader(tmp_path / "log") as reader:
        for connection, stamp, _ in reader.messages():
            logged[connection.topic].append(stamp // 1_000_000_000)
    assert logged == {
        **{topic.name: [3, 4] for topic in tick},
        CONTOUR.name: [2],
        CMD_VELOCITY.name: [3],
    }


def test_a_clock_that_is_set_back_ends_what_is_logged(
    pair: tuple[Any, Publisher], tmp_path: Path
) -> None:
    recorder, node = pair
    tick = (JOINT_STATES, ACTUATOR_WRENCH, PHI)
    node.tick(5, *tick)
    node.say(CONTOUR, "box")
    node.wait(lambda: recorder.hears_node)
    with LogWriter(tmp_path / "log", LOGGED_TOPICS) as log:
        recorder.start(log)
        for second in (6, 7, 1, 2, 8):
            node.tick(second, *tick)
        node.wait(lambda: recorder.set_back)
        assert recorder.stamp == 7_000_000_000
        recorder.finish()
    with Reader(tmp_path / "log") as reader:
        logged = [(connection.topic, stamp) for connection, stamp, _ in reader.messages()]
    stamps = [stamp for topic, stamp in logged if topic != CONTOUR.name]
    assert max(stamps) == 7_000_000_000
    assert stamps == sorted(stamps)
