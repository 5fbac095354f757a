"""Blocks of results as serialised messages.

A message is serialised once; its bytes are then repeated as often as there are samples, and all
numbers of a kind are put in their places at once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import (
    ACTUATOR_WRENCH,
    CMD_VELOCITY,
    CONTOUR,
    JOINT_STATES,
    PHI,
)
from hma_gripper_sim.results.robot_description import MOUNT
from hma_gripper_sim.simulation.trace import Trace

FloatArray = npt.NDArray[np.float64]
Stamps = npt.NDArray[np.int64]

_STORE = get_typestore(Stores.ROS2_JAZZY)
_STAMP_OFFSET = 4  # behind the four bytes that say how the rest is encoded


class _Repeated:
    """A message that starts with a header, many times over with other numbers."""

    def __init__(self, topic: Topic, message: Any, placeholders: FloatArray) -> None:
        serialised = bytes(_STORE.serialize_cdr(message, topic.msgtype))
        self._template = np.frombuffer(serialised, dtype=np.uint8)
        self._offsets = [serialised.find(row.tobytes()) for row in placeholders]

    def messages(self, stamps: Stamps, *values: FloatArray) -> Iterator[bytes]:
        """Yield one message for each stamp [ns], with a row of each of the values."""
        rows = np.tile(self._template, (len(stamps), 1))
        time = np.stack(np.divmod(stamps, 1_000_000_000), axis=1).astype("<u4")
        _put(rows, _STAMP_OFFSET, time)
        for offset, value in zip(self._offsets, values, strict=True):
            _put(rows, offset, np.ascontiguousarray(value, dtype="<f8"))
        content, size = rows.tobytes(), rows.shape[1]
        return (content[i : i + size] for i in range(0, len(content), size))


class TickMessages:
    """The messages of many ticks, those of a tick with one stamp, as the node publishes them.

    Parameters
    ----------
    joint_names
        In the order of the joint arrays.
    """

    def __init__(self, joint_names: Sequence[str]) -> None:
        T = _STORE.types
        time = T["builtin_interfaces/msg/Time"](0, 0)
        header, joints = T["std_msgs/msg/Header"], T["sensor_msgs/msg/JointState"]
        rows = _placeholders(3, len(joint_names))
        message = joints(header(time, ""), list(joint_names), *rows)
        self._joints = _Repeated(JOINT_STATES, message, rows)
        vector, wrench = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Wrench"]
        rows = _placeholders(1, 1)
        message = T["geometry_msgs/msg/WrenchStamped"](
            header(time, MOUNT),
            wrench(vector(0.0, 0.0, float(rows[0, 0])), vector(0.0, 0.0, 0.0)),
        )
        self._force = _Repeated(ACTUATOR_WRENCH, message, rows)
        rows = _placeholders(2, 2)
        message = joints(header(time, ""), ["phi_left", "phi_right"], *rows, np.empty(0))
        self._phi = _Repeated(PHI, message, rows)

    def of(self, trace: Trace, kept: slice, stamps: Stamps) -> Iterator[tuple[Topic, int, bytes]]:
        """Yield topic, stamp [ns] and bytes of every message of the kept samples of a trace."""
        parts = (
            self._joints.messages(
                stamps,
                trace.joint_position[kept],
                trace.joint_velocity[kept],
                trace.joint_effort[kept],
            ),
            self._force.messages(stamps, trace.actuator_force[kept, None]),
            self._phi.messages(
                stamps,
                np.stack([trace.phi_left[kept], trace.phi_right[kept]], axis=1),
                np.stack([trace.phi_rate("left")[kept], trace.phi_rate("right")[kept]], axis=1),
            ),
        )
        topics = (JOINT_STATES, ACTUATOR_WRENCH, PHI)
        for stamp, *messages in zip(stamps.tolist(), *parts, strict=True):
            for topic, message in zip(topics, messages, strict=True):
                yield topic, stamp, message


def velocity_message(velocity: float) -> bytes:
    """Return a command [m/s]."""
    message = _STORE.types[CMD_VELOCITY.msgtype](velocity)
    return bytes(_STORE.serialize_cdr(message, CMD_VELOCITY.msgtype))


def contour_message(name: str) -> bytes:
    """Return the name of the object in place."""
    message = _STORE.types[CONTOUR.msgtype](name)
    return bytes(_STORE.serialize_cdr(message, CONTOUR.msgtype))


def _put(rows: npt.NDArray[np.uint8], offset: int, values: npt.NDArray[Any]) -> None:
    """Write a row of numbers into each row of bytes, from an offset on."""
    content = values.view(np.uint8).reshape(len(rows), -1)
    rows[:, offset : offset + content.shape[1]] = content


def _placeholders(rows: int, columns: int) -> FloatArray:
    """Numbers that no message holds by chance, different in each place; shape (rows, columns)."""
    return np.pi * np.arange(1.0, rows * columns + 1.0).reshape(rows, columns)
