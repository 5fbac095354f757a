"""Results between the steps of the integrator."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.kernels.dense_output import add_load
from hma_gripper_sim.kernels.integrator import GAMMA


@pytest.mark.parametrize("steps", [0, 1, 50])
def test_load_is_linear_between_stages(steps: int) -> None:
    """It is what numpy interpolates between all stages, added to what is there."""
    rng = np.random.default_rng(steps)
    time = np.concatenate([[0.5], 0.5 + np.cumsum(rng.uniform(1e-6, 0.1, steps))])
    load = rng.normal(size=(steps + 1, 2))
    knots, values = [time[0]], [load[0, 1]]
    for row in range(1, steps + 1):
        knots += [time[row - 1] + GAMMA * (time[row] - time[row - 1]), time[row]]
        values += [load[row, 0], load[row, 1]]
    at = np.linspace(time[0], time[-1], 701)
    total = np.full(701, 2.0)
    add_load(at, time, load, total)
    # Rounding of a slope over the shortest step, 1e-6 s, is 1e-10 of a load.
    np.testing.assert_allclose(total, 2.0 + np.interp(at, knots, values), rtol=0.0, atol=1e-9)
