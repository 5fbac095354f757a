"""Prescribed motion of the base."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """Prescribed motion of the base: velocity linear on each segment, with jumps between."""

    time: Array  # start of each segment and end of the last [s], shape (m + 1,)
    travel: Array  # at these times [m], shape (m + 1,)
    velocity: Array  # at the start of each segment [m/s], shape (m,)
    acceleration: Array  # on each segment [m/s^2], shape (m,)
    jump: NDArray[np.bool_]  # velocity or acceleration jumps at the segment's start, shape (m,)


@kernel
def base_motion(motion: Motion, segment: int, t: float, base: Array) -> None:
    """Height, velocity and acceleration of the base at time `t` of a segment onwards."""
    last = motion.velocity.size - 1
    while segment < last and t > motion.time[segment + 1]:
        segment += 1
    dt = t - motion.time[segment]
    velocity, acceleration = motion.velocity[segment], motion.acceleration[segment]
    base[0] = -(motion.travel[segment] + dt * (velocity + 0.5 * acceleration * dt))
    base[1] = -(velocity + acceleration * dt)
    base[2] = -acceleration


@kernel
def acceleration_bound(motion: Motion, segment: int, start: float, end: float) -> float:
    """Bound on the base's acceleration between two times from a segment onwards [m/s^2]."""
    bound = 0.0
    for i in range(segment, motion.velocity.size):
        if i > segment and motion.time[i] >= end:
            break
        bound = max(bound, abs(motion.acceleration[i]))
    return bound
