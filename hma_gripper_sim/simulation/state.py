"""The state of a simulation as others see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SimulationState:
    """One instant of a simulation; arrays in the order of ``scene.joint_names``.

    `Trace.states` gives many at once: each value then has a leading axis.

    Parameters
    ----------
    time
        [s]
    travel, velocity
        Of the prismatic joint, positive towards the object [m, m/s].
    actuator_force
        Positive when the actuator pushes the gripper towards the object [N].
    phi_left, phi_right, phi_left_rate, phi_right_rate
        Angle between top beam and side beam, tangent at mid-length [rad, rad/s].
    joint_position, joint_velocity, joint_effort
        ``slide`` in m, m/s and N, all others in rad, rad/s and N m; shape (n_joints,).
    moment_left, moment_right
        Largest bending moment of any section of a side [N m] (`results.bending_moments`).
    """

    time: float
    travel: float
    velocity: float
    actuator_force: float
    phi_left: float
    phi_right: float
    phi_left_rate: float
    phi_right_rate: float
    joint_position: Array
    joint_velocity: Array
    joint_effort: Array
    moment_left: float
    moment_right: float
