"""Simulation states as ROS messages.

A tick's messages are serialised once; then only the numbers in their bytes change. Publishing
them costs a fifth of what it takes rclpy to convert a message of 63 names every time.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from hma_gripper_sim.results.robot_description import MOUNT
from hma_gripper_sim.simulation.simulation import SimulationState

Array = NDArray[np.float64]

_STAMP = struct.Struct("=iI")
_STAMP_OFFSET = 4  # behind the four bytes that say how the rest is encoded


class SerialisedMessage:
    """The bytes of a message that starts with a header or a time; its numbers change in place.

    Parameters
    ----------
    message
        Complete, but for the numbers.
    """

    def __init__(self, message: JointState | WrenchStamped | Clock) -> None:
        self._bytes = bytearray(serialize_message(message))
        if isinstance(message, JointState) and not message.effort:
            # Its serialisation aligns the end as if numbers followed; strict readers refuse that.
            end = self._bytes.rfind(message.velocity.tobytes()) + 8 * len(message.velocity)
            del self._bytes[end + 4 :]

    def view(self, placeholder: Array) -> Array:
        """Return the place of these numbers, which must stand in the message, to be written to."""
        offset = self._bytes.find(placeholder.tobytes())
        return np.frombuffer(self._bytes, dtype=np.float64, count=len(placeholder), offset=offset)

    def stamp(self, seconds: int, nanoseconds: int) -> None:
        """Set the time at its start."""
        _STAMP.pack_into(self._bytes, _STAMP_OFFSET, seconds, nanoseconds)

    @property
    def content(self) -> bytes:
        """What to publish."""
        return bytes(self._bytes)


class StateMessages:
    """The messages of one tick, all with one stamp.

    Parameters
    ----------
    joint_names
        In the order of the states.
    prefix
        Of names of joints and frames.

    Attributes
    ----------
    joint_states
        All joints, in `joint_names` order: m or rad, m/s or rad/s, N or N m.
    actuator_wrench
        ``force.z``: the force with which the actuator pushes towards the object [N].
    phi
        ``phi_left`` and ``phi_right``: the angles between top beam and side beams, and their
        rates [rad, rad/s].
    """

    def __init__(self, joint_names: Sequence[str], prefix: str) -> None:
        rows = _placeholders(3, len(joint_names))
        position, velocity, effort = rows.tolist()
        names = [prefix + name for name in joint_names]
        self.joint_states = SerialisedMessage(
            JointState(name=names, position=position, velocity=velocity, effort=effort)
        )
        self._joints = [self.joint_states.view(row) for row in rows]
        rows = _placeholders(2, 2)
        position, velocity = rows.tolist()
        self.phi = SerialisedMessage(
            JointState(name=["phi_left", "phi_right"], position=position, velocity=velocity)
        )
        self._phi = [self.phi.view(row) for row in rows]
        wrench = WrenchStamped()
        wrench.header.frame_id = prefix + MOUNT
        (force,) = _placeholders(1, 1)
        wrench.wrench.force.z = float(force[0])
        self.actuator_wrench = SerialisedMessage(wrench)
        self._force = self.actuator_wrench.view(force)

    def fill(self, state: SimulationState, stamp: int) -> None:
        """Write a state, stamped with a time in nanoseconds, into all messages."""
        for message in (self.joint_states, self.actuator_wrench, self.phi):
            message.stamp(*divmod(stamp, 1_000_000_000))
        position, velocity, effort = self._joints
        position[:] = state.joint_position
        velocity[:] = state.joint_velocity
        effort[:] = state.joint_effort
        self._force[0] = state.actuator_force
        angle, rate = self._phi
        angle[:] = state.phi_left, state.phi_right
        rate[:] = state.phi_left_rate, state.phi_right_rate


def _placeholders(rows: int, columns: int) -> Array:
    """Numbers that no message holds by chance, different in each place; shape (rows, columns)."""
    return np.pi * np.arange(1.0, rows * columns + 1.0).reshape(rows, columns)
