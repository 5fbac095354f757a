"""Results between the steps of the integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from hma_gripper_sim.kernels.dense_output import add_load
from hma_gripper_sim.kernels.radau_method import NODES


@pytest.mark.parametrize("steps", [0, 1, 50])
def test_load_is_the_cubic_through_start_and_stages(steps: int) -> None:
    """It is what scipy interpolates in each step, added to what is there."""
    rng = np.random.default_rng(steps)
    time = np.concatenate([[0.5], 0.5 + np.cumsum(rng.uniform(1e-6, 0.1, steps))])
    load = rng.normal(size=(steps + 1, 3))
    at = np.linspace(time[0], time[-1], 701)
    total = np.full(701, 2.0)
    add_load(at, time, load, total)
    expected = np.full(701, load[0, 2])
    for row in range(1, steps + 1):
        h = time[row] - time[row - 1]
        cubic = BarycentricInterpolator(
            [0.0, *NODES], [load[row - 1, 2], load[row, 0], load[row, 1], load[row, 2]]
        )
        inside = (at > time[row - 1]) & (at <= time[row])
        expected[inside] = cubic((at[inside] - time[row - 1]) / h)
    np.testing.assert_allclose(total, 2.0 + expected, rtol=0.0, atol=1e-9)
