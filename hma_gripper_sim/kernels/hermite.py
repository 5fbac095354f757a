"""Cubic Hermite interpolation of joint angles in a step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


@kernel
def interpolate(
    h: float, share: float, q0: Array, v0: Array, q1: Array, v1: Array, q: Array
) -> None:
    """Values at a `share` of a step of length `h` [s], into `q`, shape (n,).

    `q0`, `v0` are values and rates at its start, `q1`, `v1` those at its end.
    """
    rise = share * share * (3.0 - 2.0 * share)
    early, late = share * (1.0 - share) * (1.0 - share), share * share * (share - 1.0)
    for i in range(q.size):
        q[i] = q0[i] + rise * (q1[i] - q0[i]) + h * (early * v0[i] + late * v1[i])
