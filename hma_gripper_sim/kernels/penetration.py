"""How deep the tip and the object overlap where they press on each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.proximity import Obstacle
from hma_gripper_sim.kernels.touch import Fingertip, nearest_point

Array = NDArray[np.float64]


@kernel
def tip_gap(
    chain: Chain, fingertip: Fingertip, obstacle: Obstacle, travel: float, q: Array
) -> float:
    """Smallest gap between the contour in contact and the object [m]; negative: they overlap."""
    x, z, angle = place_tip(chain, travel, q)
    cos, sin = np.cos(angle), np.sin(angle)
    smallest = np.inf
    for k in range(1 if fingertip.capsule else fingertip.points.shape[0]):
        smallest = min(smallest, nearest_point(fingertip, obstacle, x, z, cos, sin, k).gap)
    return float(smallest)


@kernel
def deepest_penetration(
    chain: Chain,
    fingertip: Fingertip,
    obstacle: Obstacle,
    travel: Array,
    q: Array,
    wrench: Array,
) -> tuple[float, int]:
    """Deepest overlap at any recorded step under a contact force [m], and its row (-1: none).

    Parameters
    ----------
    travel, q, wrench
        Of the recorded steps: shapes (r,), (r, n) and (r, 3).
    """
    deepest, at = 0.0, -1
    for row in range(travel.size):
        if wrench[row, 0] == 0.0 and wrench[row, 1] == 0.0:
            continue
        depth = -tip_gap(chain, fingertip, obstacle, travel[row], q[row])
        if depth > deepest:
            deepest, at = depth, row
    return deepest, at
