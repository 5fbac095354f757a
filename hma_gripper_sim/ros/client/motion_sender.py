"""Sending motion to the simulation node: trajectories, and velocities that are kept up."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from hma_gripper_sim.model.joint_names import SLIDE
from hma_gripper_sim.motion.trajectory import WayPoint

RENEWAL = 0.02
"""Real time between two commands of the same velocity [s]."""


class MotionSender:
    """Publishes on ``~/joint_trajectory`` and ``~/cmd_velocity`` of the node.

    Parameters
    ----------
    node
        Whose executor renews velocities.
    name
        Full name of the simulation node.
    group
        Of the callbacks.
    """

    def __init__(self, node: Node, name: str, group: CallbackGroup) -> None:
        self._node = node
        self._name = name
        self._trajectory = node.create_publisher(JointTrajectory, f"{name}/joint_trajectory", 1)
        self._velocity = node.create_publisher(Float64, f"{name}/cmd_velocity", 1)
        self._driving: float | None = None
        self._lock = Lock()  # no renewal may come after the command that ends it
        # Paced by real time also where the node's clock is simulated and may stand still.
        self._timer = node.create_timer(
            RENEWAL, self._renew, group, Clock(clock_type=ClockType.STEADY_TIME)
        )
        self._timer.cancel()

    @property
    def heard(self) -> bool:
        """Whether the node takes commands, and so does whoever else listens to them."""
        return all(self._is_heard(publisher) for publisher in (self._trajectory, self._velocity))

    @property
    def driving(self) -> bool:
        """Whether a velocity is being kept up."""
        return self._driving is not None

    def drive(self, velocity: float) -> None:
        """Command a velocity [m/s], and renew it until something else is sent."""
        with self._lock:
            self._driving = velocity
            self._velocity.publish(Float64(data=velocity))
            self._timer.reset()

    def follow(self, points: Sequence[WayPoint], joint: str = SLIDE) -> None:
        """Send way points of a joint that have a position and a velocity; none: stop."""
        message = JointTrajectory(joint_names=[joint])
        for point in points:
            message.points.append(
                JointTrajectoryPoint(
                    positions=[point.position],
                    velocities=[point.velocity],
                    time_from_start=Duration(nanoseconds=round(1e9 * point.time)).to_msg(),
                )
            )
        self._trajectory.publish(message)

    def stop(self) -> None:
        """Command rest, the way the last command went: nothing of it can come later."""
        with self._lock:
            if self._driving is None:
                self.follow([])
                return
            self._timer.cancel()
            self._driving = None
            self._velocity.publish(Float64(data=0.0))

    def flush(self, timeout: float) -> None:
        """Wait until what was sent has reached the node, for so long at most [s]."""
        for publisher in (self._trajectory, self._velocity):
            publisher.wait_for_all_acked(Duration(seconds=timeout))

    def close(self) -> None:
        """Send no more."""
        self._node.destroy_timer(self._timer)
        for publisher in (self._trajectory, self._velocity):
            self._node.destroy_publisher(publisher)

    def _is_heard(self, publisher: Publisher) -> bool:
        listeners = self._node.get_subscriptions_info_by_topic(publisher.topic_name)
        found = any(
            f"{listener.node_namespace.rstrip('/')}/{listener.node_name}" == self._name
            for listener in listeners
        )
        return found and bool(publisher.get_subscription_count() >= len(listeners))

    def _renew(self) -> None:
        with self._lock:
            if self._driving is not None:
                self._velocity.publish(Float64(data=self._driving))
