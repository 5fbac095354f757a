"""Results between the steps of the integrator."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.hermite import interpolate
from hma_gripper_sim.kernels.radau import powers

Array = NDArray[np.float64]


@kernel
def add_load(at: Array, time: Array, load: Array, total: Array) -> None:
    """Add the load on the base to `total`: in each step the cubic through its start and stages.

    Parameters
    ----------
    at
        Ascending, within the record [s], shape (n_samples,).
    time, load
        Ends of the steps [s], shape (r,), and `Record.load` [N], shape (r, 3).
    total
        [N], shape (n_samples,).
    """
    if time.size == 1:
        total += load[0, 2]
        return
    row, start, h = 0, 0.0, 1.0
    f, a, b, c = 0.0, 0.0, 0.0, 0.0
    for i in range(at.size):
        while row == 0 or (time[row] < at[i] and row < time.size - 1):
            row += 1
            start, h = time[row - 1], time[row] - time[row - 1]
            f = load[row - 1, 2]
            a, b, c = powers(load[row, 0] - f, load[row, 1] - f, load[row, 2] - f)
        theta = (at[i] - start) / h
        total[i] += f + theta * (a + theta * (b + theta * c))


@kernel
def hermite(at: Array, time: Array, rows: Array, rates: Array, out: Array) -> None:
    """Cubic interpolation of `rows` with given rates.

    Parameters
    ----------
    at
        Ascending, within the record [s], shape (n_samples,).
    time, rows, rates
        Of the record, shapes (r,), (r, n) and (r, n).
    out
        Receives the result, shape (n_samples, n).
    """
    row = 0
    for i in range(at.size):
        while row < time.size - 2 and time[row + 1] <= at[i]:
            row += 1
        if time.size == 1:
            for j in range(rows.shape[1]):
                out[i, j] = rows[0, j]
            continue
        h = time[row + 1] - time[row]
        share = (at[i] - time[row]) / h
        interpolate(h, share, rows[row], rates[row], rows[row + 1], rates[row + 1], out[i])
