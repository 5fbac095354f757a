"""The motion of a drive that is given velocities, from tick to tick."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.braking import limited_velocity
from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


@kernel
def drive_profile(
    commands: Array,
    max_velocity: float,
    change: float,
    travel_min: float,
    travel_max: float,
    timeout: int,
    period: float,
    travel: Array,
    velocity: Array,
) -> None:
    """Move as `hma_gripper_sim.drive.Drive` does when it is commanded velocities only.

    Parameters
    ----------
    commands
        Velocity that came before each tick, NaN where none did [m/s], shape (n,).
    max_velocity, change
        Largest velocity, and its largest change in one tick [m/s].
    travel_min, travel_max
        [m]
    timeout
        Ticks after which a command that is not renewed expires; 0: never.
    period
        Of a tick [s].
    travel, velocity
        At the ends of the ticks [m, m/s], shape (n + 1,); row 0 is the start, the others are
        filled in.
    """
    wanted, age = 0.0, 0
    for k in range(commands.size):
        if not math.isnan(commands[k]):
            wanted = min(max(commands[k], -max_velocity), max_velocity)
            age = 0
        if timeout > 0 and age >= timeout:
            wanted = 0.0
        age += 1
        ahead, behind = travel_max - travel[k], travel[k] - travel_min
        velocity[k + 1], _ = limited_velocity(wanted, velocity[k], ahead, behind, change, period)
        travel[k + 1] = travel[k] + 0.5 * (velocity[k] + velocity[k + 1]) * period
