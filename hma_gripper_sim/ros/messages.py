"""Simulation states as ROS messages.

The messages are made once and refilled in place: at 1 kHz, 63 new floats three times over would
cost more than the physics.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState

from hma_gripper_sim.simulation import SimulationState

WRENCH_FRAME = "gripper_mount"
"""Frame of the actuator wrench; its z axis points towards the object."""


class JointStateBuffer:
    """A `JointState` message whose numbers are written through numpy views of its arrays.

    Attributes
    ----------
    message
        The message.
    position, velocity, effort
        Views of its arrays, shape (n_names,); `effort` is empty without `with_effort`.
    """

    def __init__(self, names: Sequence[str], *, with_effort: bool = True) -> None:
        self.message = JointState(name=list(names))
        self.message.position = array("d", bytes(8 * len(names)))
        self.message.velocity = array("d", bytes(8 * len(names)))
        self.message.effort = array("d", bytes(8 * len(names) * with_effort))
        self.position = _view(self.message.position)
        self.velocity = _view(self.message.velocity)
        self.effort = _view(self.message.effort)


class StateMessages:
    """The messages of one tick, all with one stamp.

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

    def __init__(self, joint_names: Sequence[str]) -> None:
        self._joints = JointStateBuffer(joint_names)
        self._phi = JointStateBuffer(("phi_left", "phi_right"), with_effort=False)
        self.joint_states = self._joints.message
        self.actuator_wrench = WrenchStamped()
        self.phi = self._phi.message
        self.actuator_wrench.header.frame_id = WRENCH_FRAME
        self._stamp = self.joint_states.header.stamp
        self.actuator_wrench.header.stamp = self._stamp
        self.phi.header.stamp = self._stamp

    def fill(self, state: SimulationState, stamp: int) -> None:
        """Write a state, stamped with a time in nanoseconds, into all messages."""
        self._stamp.sec, self._stamp.nanosec = divmod(stamp, 1_000_000_000)
        self._joints.position[:] = state.joint_position
        self._joints.velocity[:] = state.joint_velocity
        self._joints.effort[:] = state.joint_effort
        self.actuator_wrench.wrench.force.z = state.actuator_force
        self._phi.position[:] = state.phi_left, state.phi_right
        self._phi.velocity[:] = state.phi_left_rate, state.phi_right_rate


def _view(values: array[float]) -> NDArray[np.float64]:
    return np.frombuffer(values, dtype=np.float64) if values else np.empty(0)
