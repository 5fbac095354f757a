"""The topics that command the drive, and what their messages say."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from builtin_interfaces.msg import Duration, Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from hma_gripper_sim.device.arbitration import Command, TrajectoryCommand, VelocityCommand
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.joint_names import SLIDE
from hma_gripper_sim.motion.trajectory import Trajectory, WayPoint


@dataclass(frozen=True)
class Source:
    """A topic that commands the drive.

    Attributes
    ----------
    name
        Of the topic, below the node's own name.
    kind
        Type of its messages.
    read
        Returns what a message commands; raises `InputError` if that cannot be used.
    """

    name: str
    kind: type
    read: Callable[[Any], Command]


def read_number(message: Float64) -> Command:
    """Return the velocity that is the message."""
    return VelocityCommand(message.data)


def read_array(message: Float64MultiArray) -> Command:
    """Return the velocity that is the only element, as ros2_control's controllers send it."""
    if len(message.data) != 1:
        raise InputError(f"expected one element, got {len(message.data)}", field="data")
    return VelocityCommand(message.data[0])


def read_joint_state(message: JointState) -> Command:
    """Return the velocity of the joint `slide`, as topic-based ros2_control hardware sends it."""
    column = _slide(message.name, "name")
    velocity = _entry(message.velocity, column, len(message.name), "velocity")
    if velocity is None:
        raise InputError("is empty: velocities are commanded, not positions", field="velocity")
    return VelocityCommand(velocity, nanoseconds(message.header.stamp))


def read_trajectory(message: JointTrajectory) -> Command:
    """Return the trajectory of the joint `slide`; without points: stop."""
    stamp = nanoseconds(message.header.stamp)
    if not message.points:
        return VelocityCommand(0.0)
    count, column = len(message.joint_names), _slide(message.joint_names, "joint_names")
    points = [
        WayPoint(
            time=1e-9 * nanoseconds(point.time_from_start),
            position=_entry(point.positions, column, count, f"points[{i}].positions"),
            velocity=_entry(point.velocities, column, count, f"points[{i}].velocities"),
            acceleration=_entry(point.accelerations, column, count, f"points[{i}].accelerations"),
        )
        for i, point in enumerate(message.points)
    ]
    return TrajectoryCommand(Trajectory(points), stamp)


SOURCES = (
    Source("cmd_velocity", Float64, read_number),
    Source("commands", Float64MultiArray, read_array),
    Source("joint_commands", JointState, read_joint_state),
    Source("joint_trajectory", JointTrajectory, read_trajectory),
)


def nanoseconds(time: Time | Duration) -> int:
    """Return a time or duration in nanoseconds."""
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)


def _slide(names: Sequence[str], field: str) -> int:
    if names.count(SLIDE) != 1:
        shown = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
        raise InputError(f"must hold {SLIDE!r} once, got [{shown}]", field=field)
    return names.index(SLIDE)


def _entry(values: Sequence[float], column: int, count: int, field: str) -> float | None:
    """Return one of `count` values; None where the whole list is left out."""
    if len(values) not in (0, count):
        raise InputError(f"must have {count} entries or none, got {len(values)}", field=field)
    return float(values[column]) if values else None
