"""How deep the tip and the object overlap where they press on each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact import Fingertip
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.proximity import Obstacle, point_distance, segment_distance

Array = NDArray[np.float64]


@kernel
def tip_gap(
    chain: Chain, fingertip: Fingertip, obstacle: Obstacle, travel: float, q: Array
) -> float:
    """Smallest gap between the contour in contact and the object [m]; negative: they overlap."""
    x, z, angle = place_tip(chain, travel, q)
    cos, sin = np.cos(angle), np.sin(angle)
    points = fingertip.points
    smallest = np.inf
    if fingertip.capsule:
        smallest = segment_distance(
            obstacle,
            x + cos * points[0, 0] - sin * points[0, 1],
            z + sin * points[0, 0] + cos * points[0, 1],
            x + cos * points[1, 0] - sin * points[1, 1],
            z + sin * points[1, 0] + cos * points[1, 1],
        )[0]
    else:
        for k in range(points.shape[0]):
            px = x + cos * points[k, 0] - sin * points[k, 1]
            pz = z + sin * points[k, 0] + cos * points[k, 1]
            smallest = min(smallest, point_distance(obstacle, px, pz)[0])
    return float(smallest - obstacle.radius - fingertip.radius)


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
