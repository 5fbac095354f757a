"""Distances to a rigid convex object: of points, and of the axis of a capsule.

The object is a convex polygon, its core, rounded by a radius; a circle's core is one vertex.
All distances are to the core and signed, negative inside.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


class Obstacle(NamedTuple):
    """A rigid convex object in world coordinates."""

    vertices: Array  # core polygon, counter-clockwise [m], shape (m, 2)
    normals: Array  # outward normal of the edge that starts at each vertex, shape (m, 2)
    centre: Array  # a point inside, shape (2,)
    radius: float  # rounding of the core [m]


class Closest(NamedTuple):
    """Where a segment is closest to the core of an object."""

    distance: float  # signed [m]
    nx: float  # outward direction, x
    nz: float  # and z
    along: float  # place of the closest point on the segment, in [0, 1]
    # Of the object there [1/m]; negative: a vertex of the object meets the inside of the segment,
    # whose direction counts.
    curvature: float
    ahead: float  # length of the segment before that point that faces a flat face [m]
    rise_ahead: float  # and the slope at which the two part there
    behind: float  # the same behind it [m]
    rise_behind: float


@kernel
def point_distance(obstacle: Obstacle, x: float, z: float) -> tuple[float, float, float, float]:
    """Signed distance of a point to the core, outward direction, curvature of the level set."""
    vertices, normals = obstacle.vertices, obstacle.normals
    m = vertices.shape[0]
    if m > 1:
        face, depth = 0, -np.inf
        for i in range(m):
            d = normals[i, 0] * (x - vertices[i, 0]) + normals[i, 1] * (z - vertices[i, 1])
            if d > depth:
                face, depth = i, d
        if depth <= 0.0:
            return depth, normals[face, 0], normals[face, 1], 0.0
    corner, closest = 0, np.inf
    for i in range(m):
        dx, dz = x - vertices[i, 0], z - vertices[i, 1]
        square = dx * dx + dz * dz
        if square < closest:
            corner, closest = i, square
        if m > 1:
            nx, nz = normals[i, 0], normals[i, 1]
            d = nx * dx + nz * dz
            if d > 0.0:
                j = i + 1 if i + 1 < m else 0
                along = nx * dz - nz * dx
                length = nx * (vertices[j, 1] - vertices[i, 1]) - nz * (
                    vertices[j, 0] - vertices[i, 0]
                )
                if 0.0 <= along <= length:
                    return d, nx, nz, 0.0
    d = np.sqrt(closest)
    if d == 0.0:
        return 0.0, 0.0, 1.0, 0.0
    return d, (x - vertices[corner, 0]) / d, (z - vertices[corner, 1]) / d, 1.0 / d


@kernel
def support(obstacle: Obstacle, nx: float, nz: float) -> float:
    """How far the core reaches along a direction [m]."""
    reach = -np.inf
    for i in range(obstacle.vertices.shape[0]):
        reach = max(reach, nx * obstacle.vertices[i, 0] + nz * obstacle.vertices[i, 1])
    return reach


@kernel
def is_outside(obstacle: Obstacle, x: float, z: float) -> bool:
    """Whether a point is seen at a glance to be outside; False leaves it open."""
    vertices, normals = obstacle.vertices, obstacle.normals
    if vertices.shape[0] == 1:
        dx, dz = x - vertices[0, 0], z - vertices[0, 1]
        return bool(dx * dx + dz * dz > obstacle.radius * obstacle.radius)
    for i in range(vertices.shape[0]):
        d = normals[i, 0] * (x - vertices[i, 0]) + normals[i, 1] * (z - vertices[i, 1])
        if d > obstacle.radius:
            return True
    return False


@kernel
def segment_distance(obstacle: Obstacle, ax: float, az: float, bx: float, bz: float) -> Closest:
    """Where the segment from (ax, az) to (bx, bz) [m] is closest to the core."""
    vertices, normals = obstacle.vertices, obstacle.normals
    m = vertices.shape[0]
    ux, uz = bx - ax, bz - az
    length = np.sqrt(ux * ux + uz * uz)
    ux, uz = ux / length, uz / length
    if m == 1:
        return _segment_to_point(vertices[0, 0] - ax, vertices[0, 1] - az, ux, uz, length)
    # Normal of the segment that points away from the object, and the object's support there.
    sx, sz = -uz, ux
    if sx * (ax - obstacle.centre[0]) + sz * (az - obstacle.centre[1]) < 0.0:
        sx, sz = -sx, -sz
    corner, support = 0, -np.inf
    for i in range(m):
        reach = sx * vertices[i, 0] + sz * vertices[i, 1]
        if reach > support:
            corner, support = i, reach
    side = sx * ax + sz * az - support
    along = (ux * (vertices[corner, 0] - ax) + uz * (vertices[corner, 1] - az)) / length
    deepest, face = -np.inf, 0
    least_a, least_b = -np.inf, -np.inf  # bounds of the distances of both ends
    for i in range(m):
        nx, nz = normals[i, 0], normals[i, 1]
        fa = nx * (ax - vertices[i, 0]) + nz * (az - vertices[i, 1])
        fb = nx * (bx - vertices[i, 0]) + nz * (bz - vertices[i, 1])
        least_a, least_b = max(least_a, fa), max(least_b, fb)
        if min(fa, fb) > deepest:
            deepest, face = min(fa, fb), i
    parted = side > 0.0 or deepest > 0.0
    if (0.0 < along < 1.0 and side > 0.0) or (not parted and side > deepest):
        along = min(1.0, max(0.0, along))
        after, before = (corner + 1) % m, (corner + m - 1) % m
        if (
            ux * (vertices[after, 0] - vertices[before, 0])
            + uz * (vertices[after, 1] - vertices[before, 1])
            < 0.0
        ):
            after, before = before, after
        ahead, rise_ahead = _face_along(vertices, corner, after, sx, sz, ux, uz)
        behind, rise_behind = _face_along(vertices, corner, before, sx, sz, -ux, -uz)
        ahead = min(ahead, (1.0 - along) * length)
        behind = min(behind, along * length)
        return Closest(side, sx, sz, along, -1.0, ahead, rise_ahead, behind, rise_behind)
    if parted:  # an end is closest; the one that can be first
        distance, nx, nz, curvature = np.inf, 0.0, 0.0, 0.0
        along = 0.0
        end = 0.0 if least_a <= least_b else 1.0
        for _ in range(2):
            least = least_a if end == 0.0 else least_b
            if least < distance:
                px, pz = (ax, az) if end == 0.0 else (bx, bz)
                d, dx, dz, bent = point_distance(obstacle, px, pz)
                if d < distance or (d == distance and end == 0.0):
                    distance, nx, nz, curvature, along = d, dx, dz, bent, end
            end = 1.0 - end
    else:  # the cores overlap: part them in the direction in which that takes least
        distance, nx, nz, curvature = deepest, normals[face, 0], normals[face, 1], 0.0
        along = 0.0 if nx * ux + nz * uz > 0.0 else 1.0
    inwards = 1.0 if along == 0.0 else -1.0  # from the segment's end along it
    px, pz = (ax, az) if along == 0.0 else (bx, bz)
    flat, rise = _face_below_end(
        obstacle, px, pz, inwards * ux, inwards * uz, nx, nz, curvature > 0.0
    )
    flat = min(flat, length)
    if along == 0.0:
        return Closest(distance, nx, nz, along, curvature, flat, rise, 0.0, 1.0)
    return Closest(distance, nx, nz, along, curvature, 0.0, 1.0, flat, rise)


@kernel
def _segment_to_point(px: float, pz: float, ux: float, uz: float, length: float) -> Closest:
    """`segment_distance` for a core of one vertex at (px, pz) from the segment's start."""
    along = ux * px + uz * pz
    if 0.0 < along < length:
        side = uz * px - ux * pz
        if side >= 0.0:
            return Closest(side, -uz, ux, along / length, -1.0, 0.0, 1.0, 0.0, 1.0)
        return Closest(-side, uz, -ux, along / length, -1.0, 0.0, 1.0, 0.0, 1.0)
    end = 0.0
    if along >= length:
        px, pz, end = px - length * ux, pz - length * uz, 1.0
    distance = np.sqrt(px * px + pz * pz)
    if distance == 0.0:
        return Closest(0.0, 0.0, 1.0, end, 0.0, 0.0, 1.0, 0.0, 1.0)
    return Closest(
        distance, -px / distance, -pz / distance, end, 1.0 / distance, 0.0, 1.0, 0.0, 1.0
    )


@kernel
def _face_along(
    vertices: Array, corner: int, other: int, sx: float, sz: float, ux: float, uz: float
) -> tuple[float, float]:
    """Length along a segment of the face to `other`, and the slope at which it falls away.

    (sx, sz) is the segment's normal away from the object, (ux, uz) the way along it.
    """
    ex, ez = vertices[other, 0] - vertices[corner, 0], vertices[other, 1] - vertices[corner, 1]
    drop = -(sx * ex + sz * ez) / np.sqrt(ex * ex + ez * ez)
    return max(0.0, ux * ex + uz * ez), max(0.0, drop)


@kernel
def _face_below_end(
    obstacle: Obstacle,
    px: float,
    pz: float,
    ux: float,
    uz: float,
    nx: float,
    nz: float,
    at_vertex: bool,
) -> tuple[float, float]:
    """Length along a segment of the face below its end, and the slope at which the two part.

    The segment leads from (px, pz) along (ux, uz).  Its end is closest to the face with the
    normal (nx, nz), or to a vertex in that direction, where a face begins.
    """
    vertices, normals = obstacle.vertices, obstacle.normals
    m = vertices.shape[0]
    start, closest = 0, np.inf
    for i in range(m):
        if at_vertex:
            away = (px - vertices[i, 0]) ** 2 + (pz - vertices[i, 1]) ** 2
        else:
            away = -(nx * normals[i, 0] + nz * normals[i, 1])
        if away < closest:
            start, closest = i, away
    glide = nx * uz - nz * ux  # along the object, counter-clockwise
    side = 1.0 if glide > 0.0 else -1.0
    drop = 0.0
    if at_vertex:
        other = (start + 1) % m if glide > 0.0 else (start + m - 1) % m
        ex, ez = vertices[other, 0] - vertices[start, 0], vertices[other, 1] - vertices[start, 1]
        drop = -(nx * ex + nz * ez) / np.sqrt(ex * ex + ez * ez)
    else:
        other = (start + 1) % m if glide > 0.0 else start
        ex, ez = vertices[other, 0] - px, vertices[other, 1] - pz
    room = side * (nx * ez - nz * ex)
    return max(0.0, room / max(abs(glide), 1e-12)), max(0.0, nx * ux + nz * uz + drop)


@kernel
def _bed(depth: float, flat: float, rise: float) -> tuple[float, float, float, float, float, float]:
    """Area and first moment of the pressure on one side of the deepest point of a flat overlap.

    Returns both, their derivatives to the depth, and to the slope `rise`.
    """
    if rise * flat <= depth:  # the whole flat part is in touch
        return (
            flat * (depth - 0.5 * rise * flat),
            flat * flat * (0.5 * depth - rise * flat / 3.0),
            flat,
            0.5 * flat * flat,
            -0.5 * flat * flat,
            -flat * flat * flat / 3.0,
        )
    reach = depth / rise
    return (
        0.5 * depth * reach,
        depth * reach * reach / 6.0,
        reach,
        0.5 * reach * reach,
        -0.5 * reach * reach,
        -reach * reach * reach / 3.0,
    )


@kernel
def pressure_centre(
    depth: float, ahead: float, rise_ahead: float, behind: float, rise_behind: float
) -> tuple[float, float, float]:
    """Centre of pressure of a flat overlap, as a bed of springs has it.

    Returns its distance ahead of the deepest point, and the derivatives of that to the depth
    and to a turn that raises the segment ahead.
    """
    area, moment, area_depth, moment_depth, area_turn, moment_turn = _bed(depth, ahead, rise_ahead)
    b_area, b_moment, b_area_depth, b_moment_depth, b_area_turn, b_moment_turn = _bed(
        depth, behind, rise_behind
    )
    total = area + b_area
    if total <= 0.0:
        return 0.0, 0.0, 0.0
    centre = (moment - b_moment) / total
    to_depth = (moment_depth - b_moment_depth - centre * (area_depth + b_area_depth)) / total
    to_turn = (moment_turn + b_moment_turn - centre * (area_turn - b_area_turn)) / total
    return centre, to_depth, to_turn
