"""Where the tip is relative to the object: its point that is closest, and how far it is.

The tip touches the object either with a capsule (one closest-point query) or with the sampled
points of the thesis' Parameters.m.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.proximity import Obstacle, point_distance, segment_distance

Array = NDArray[np.float64]


class Fingertip(NamedTuple):
    """What of the tip can touch, in the frame of the last body."""

    points: Array  # capsule: two ends of its axis; sampled: contact points [m], shape (k, 2)
    normals: Array  # outward unit normals of sampled points, shape (k, 2)
    radius: float  # of the capsule; 0 for sampled points [m]
    capsule: bool
    along_tip_normal: bool  # sampled points push along their own normal, not the object's


class Nearest(NamedTuple):
    """The point of the tip that is closest to the object, and the geometry of both there.

    All but the gap as in `kernels.proximity.Closest`.
    """

    gap: float  # from the tip's outline to the object's, negative: they overlap [m]
    lx: float  # lever from the last joint to the point, on the axis of a capsule, x [m]
    lz: float  # and z
    ux: float  # direction of a capsule's axis, x; of sampled points 0
    uz: float  # and z
    distance: float
    nx: float
    nz: float
    curvature: float
    ahead: float
    rise_ahead: float
    behind: float
    rise_behind: float


@kernel
def nearest_point(
    fingertip: Fingertip, obstacle: Obstacle, x: float, z: float, cos: float, sin: float, k: int
) -> Nearest:
    """Point of contact candidate `k` that is closest to the object.

    The last joint is at (x, z) [m]; (cos, sin) are of the last body's angle.
    """
    points = fingertip.points
    lx = cos * points[k, 0] - sin * points[k, 1]
    lz = sin * points[k, 0] + cos * points[k, 1]
    if fingertip.capsule:
        hx = cos * points[1, 0] - sin * points[1, 1]
        hz = sin * points[1, 0] + cos * points[1, 1]
        at = segment_distance(obstacle, x + lx, z + lz, x + hx, z + hz)
        length = np.sqrt((hx - lx) ** 2 + (hz - lz) ** 2)
        ux, uz = (hx - lx) / length, (hz - lz) / length
        return Nearest(
            at.distance - obstacle.radius - fingertip.radius,
            lx + at.along * length * ux,
            lz + at.along * length * uz,
            ux,
            uz,
            at.distance,
            at.nx,
            at.nz,
            at.curvature,
            at.ahead,
            at.rise_ahead,
            at.behind,
            at.rise_behind,
        )
    distance, nx, nz, curvature = point_distance(obstacle, x + lx, z + lz)
    gap = distance - obstacle.radius - fingertip.radius
    return Nearest(gap, lx, lz, 0.0, 0.0, distance, nx, nz, curvature, 0.0, 1.0, 0.0, 1.0)


@kernel
def push_direction(
    fingertip: Fingertip, at: Nearest, cos: float, sin: float, k: int
) -> tuple[float, float]:
    """Direction in which the object pushes contact candidate `k`, which is closest `at` a point.

    Away from the object, or against the own outward normal of a sampled point.
    """
    if not fingertip.along_tip_normal:
        return at.nx, at.nz
    normals = fingertip.normals
    ex = sin * normals[k, 1] - cos * normals[k, 0]
    ez = -sin * normals[k, 0] - cos * normals[k, 1]
    return ex, ez


@kernel
def touched_part(fingertip: Fingertip, obstacle: Obstacle, pose: Array, k: int) -> int:
    """Number of the part of the object that contact `k` meets: its force is smooth on each.

    Faces have even numbers, vertices odd ones, and those that meet the capsule's flank negative
    ones.
    """
    at = nearest_point(fingertip, obstacle, pose[0], pose[1], np.cos(pose[2]), np.sin(pose[2]), k)
    # The face that looks along the direction of the distance, or the vertex furthest along it.
    of = obstacle.normals if at.curvature == 0.0 else obstacle.vertices
    part, furthest = 0, -np.inf
    for i in range(of.shape[0]):
        reach = at.nx * of[i, 0] + at.nz * of[i, 1]
        if reach > furthest:
            part, furthest = i, reach
    if at.curvature == 0.0:
        return 2 * part
    return 2 * part + 1 if at.curvature > 0.0 else -1 - part
