"""The topics that command the drive, and what their messages say."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import PolygonStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from hma_gripper_sim.device.arbitration import (
    Command,
    PositionCommand,
    TrajectoryCommand,
    VelocityCommand,
)
from hma_gripper_sim.device.settings import Points, Settings
from hma_gripper_sim.device.topics import (
    CMD_VELOCITY,
    COMMANDS,
    JOINT_COMMANDS,
    JOINT_TRAJECTORY,
    NodeTopic,
)
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.joint_names import SLIDE
from hma_gripper_sim.motion.trajectory import Trajectory, WayPoint
from hma_gripper_sim.results.robot_description import MOUNT


def read_number(message: Float64, _: Settings) -> Command:
    """Return the velocity that is the message."""
    return VelocityCommand(message.data)


def read_array(message: Float64MultiArray, _: Settings) -> Command:
    """Return the velocity that is the only element, as ros2_control's controllers send it."""
    if len(message.data) != 1:
        raise InputError(f"expected one element, got {len(message.data)}", field="data")
    return VelocityCommand(message.data[0])


def read_joint_state(message: JointState, settings: Settings) -> Command:
    """Return the velocity of the joint `slide`, or its position where no velocity is given.

    Topic-based ros2_control hardware sends NaN for what is not commanded.
    """
    column, count = _slide(message.name, "name", settings), len(message.name)
    velocity = _entry(message.velocity, column, count, "velocity")
    position = _entry(message.position, column, count, "position")
    stamp = nanoseconds(message.header.stamp)
    if position is not None and (velocity is None or math.isnan(velocity)):
        return PositionCommand(position, stamp)
    if velocity is None:
        raise InputError("is empty, and so is position", field="velocity")
    return VelocityCommand(velocity, stamp)


def read_trajectory(message: JointTrajectory, settings: Settings) -> Command:
    """Return the trajectory of the joint `slide`; without points: stop."""
    stamp = nanoseconds(message.header.stamp)
    if not message.points:
        return VelocityCommand(0.0)
    count = len(message.joint_names)
    column = _slide(message.joint_names, "joint_names", settings)
    points = [
        WayPoint(
            time=1e-9 * nanoseconds(point.time_from_start),
            position=_entry(point.positions, column, count, f"points[{i}].positions"),
            velocity=_entry(point.velocities, column, count, f"points[{i}].velocities"),
            acceleration=_entry(point.accelerations, column, count, f"points[{i}].accelerations"),
        )
        for i, point in enumerate(message.points)
    ]
    return TrajectoryCommand(Trajectory(points, moving_end=settings.moving_end), stamp)


def read_outline(message: PolygonStamped, settings: Settings) -> Points:
    """Return the points (x, z) of an outline in the drawing plane [m], where z is up.

    Raises
    ------
    InputError
        It is in another frame than the drawing plane, which has no name, or the gripper's.
    """
    frame, mount = message.header.frame_id, settings.prefix + MOUNT
    if frame not in ("", mount):
        raise InputError(
            f"{frame!r} is neither {mount!r} nor empty: transform the outline first",
            field="frame_id",
        )
    up = -1.0 if frame else 1.0  # in the gripper's frame z points towards the object
    return tuple((point.x, up * point.z) for point in message.polygon.points)


READERS: Mapping[NodeTopic, Callable[[Any, Settings], Command]] = {
    CMD_VELOCITY: read_number,
    COMMANDS: read_array,
    JOINT_COMMANDS: read_joint_state,
    JOINT_TRAJECTORY: read_trajectory,
}
"""Return what a message of a topic commands, with the node's settings.

They raise `InputError` if that cannot be used.
"""


def nanoseconds(time: Time | Duration) -> int:
    """Return a time or duration in nanoseconds."""
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)


def _slide(names: Sequence[str], field: str, settings: Settings) -> int:
    slide = settings.prefix + SLIDE
    if names.count(slide) != 1:
        shown = ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")
        raise InputError(f"must hold {slide!r} once, got [{shown}]", field=field)
    return names.index(slide)


def _entry(values: Sequence[float], column: int, count: int, field: str) -> float | None:
    """Return one of `count` values; None where the whole list is left out."""
    if len(values) not in (0, count):
        raise InputError(f"must have {count} entries or none, got {len(values)}", field=field)
    return float(values[column]) if values else None
