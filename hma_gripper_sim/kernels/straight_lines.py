"""Straight lines through measured points (E. H. Bristol, "Swinging door trending", 1990)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


@kernel
def trend_corners(time: Array, value: Array, tolerance: float, kept: NDArray[np.intp]) -> int:
    """Choose points so that straight lines between them miss no other by more than `tolerance`.

    Parameters
    ----------
    time, value
        Of the points, time increasing, shape (n,) with n > 1.
    kept
        Rows of the chosen points, filled in, shape (n,).

    Returns
    -------
    int
        How many; the first and the last point are among them.
    """
    last = time.size - 1
    count, pivot = 1, 0
    kept[0] = 0
    lowest, highest = -np.inf, np.inf
    i = 1
    while i <= last:
        length = time[i] - time[pivot]
        rise = value[i] - value[pivot]
        if lowest <= rise / length <= highest:
            lowest = max(lowest, (rise - tolerance) / length)
            highest = min(highest, (rise + tolerance) / length)
            i += 1
        else:
            pivot = i - 1
            kept[count] = pivot
            count += 1
            lowest, highest = -np.inf, np.inf
    kept[count] = last
    return count + 1
