"""Results between the steps of the integrator."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator, CubicHermiteSpline

from hma_gripper_sim.kernels.dense_output import add_load, hermite
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


@pytest.mark.parametrize("steps", [1, 50])
def test_angles_are_cubics_with_the_rates_at_both_ends(steps: int) -> None:
    """What scipy interpolates, to rounding."""
    rng = np.random.default_rng(steps)
    time = np.concatenate([[0.5], 0.5 + np.cumsum(rng.uniform(1e-6, 0.1, steps))])
    rows, rates = rng.normal(size=(2, steps + 1, 4))
    at, found = np.linspace(time[0], time[-1], 701), np.empty((701, 4))
    hermite(at, time, rows, rates, found)
    expected = CubicHermiteSpline(time, rows, rates)(at)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def test_a_record_of_one_row_holds() -> None:
    found = np.empty((3, 2))
    hermite(np.arange(3.0), np.zeros(1), np.array([[1.0, 2.0]]), np.ones((1, 2)), found)
    np.testing.assert_array_equal(found, [[1.0, 2.0]] * 3)
