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
def segment_distance(
    obstacle: Obstacle, ax: float, az: float, bx: float, bz: float
) -> tuple[float, float, float, float, float, float, float]:
    """Signed distance of a segment to the core.

    Returns
    -------
    distance, x, z
        Distance [m] and outward direction.
    along
        Position of the closest point on the segment, in [0, 1].
    curvature
        Of the object there [1/m]; negative: a vertex of the object meets the inside of the
        segment, whose direction counts.
    flat, slope
        Length of the segment, from the closest point (negative: towards its start), that
        faces a flat face of the object [m], and the slope at which the two part there.
    """
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
    for i in range(m):
        nx, nz = normals[i, 0], normals[i, 1]
        fa = nx * (ax - vertices[i, 0]) + nz * (az - vertices[i, 1])
        fb = nx * (bx - vertices[i, 0]) + nz * (bz - vertices[i, 1])
        if min(fa, fb) > deepest:
            deepest, face = min(fa, fb), i
    parted = side > 0.0 or deepest > 0.0
    if (0.0 < along < 1.0 and side > 0.0) or (not parted and side > deepest):
        along = min(1.0, max(0.0, along))
        flat, slope = _face_below_vertex(obstacle, corner, sx, sz, ux, uz, along, length)
        return side, sx, sz, along, -1.0, flat, slope
    if parted:
        distance, nx, nz, curvature = point_distance(obstacle, ax, az)
        along = 0.0
        db, nbx, nbz, kb = point_distance(obstacle, bx, bz)
        if db < distance:
            distance, nx, nz, curvature, along = db, nbx, nbz, kb, 1.0
    else:  # the cores overlap: part them in the direction in which that takes least
        distance, nx, nz, curvature = deepest, normals[face, 0], normals[face, 1], 0.0
        along = 0.0 if nx * ux + nz * uz > 0.0 else 1.0
    flat, slope = 0.0, 1.0
    if curvature == 0.0:
        flat, slope = _face_below_end(obstacle, ax, az, bx, bz, ux, uz, along, nx, nz)
    return distance, nx, nz, along, curvature, flat, slope


@kernel
def _segment_to_point(
    px: float, pz: float, ux: float, uz: float, length: float
) -> tuple[float, float, float, float, float, float, float]:
    """`segment_distance` for a core of one vertex at (px, pz) from the segment's start."""
    along = ux * px + uz * pz
    if 0.0 < along < length:
        side = uz * px - ux * pz
        if side >= 0.0:
            return side, -uz, ux, along / length, -1.0, 0.0, 1.0
        return -side, uz, -ux, along / length, -1.0, 0.0, 1.0
    end = 0.0
    if along >= length:
        px, pz, end = px - length * ux, pz - length * uz, 1.0
    distance = np.sqrt(px * px + pz * pz)
    if distance == 0.0:
        return 0.0, 0.0, 1.0, end, 0.0, 0.0, 1.0
    return distance, -px / distance, -pz / distance, end, 1.0 / distance, 0.0, 1.0


@kernel
def _face_below_vertex(
    obstacle: Obstacle,
    corner: int,
    sx: float,
    sz: float,
    ux: float,
    uz: float,
    along: float,
    length: float,
) -> tuple[float, float]:
    """Flat part next to a vertex that meets a segment: the less inclined adjacent face."""
    vertices = obstacle.vertices
    m = vertices.shape[0]
    flat, slope = 0.0, 1.0
    for step in range(2):
        other = (corner + 1) % m if step == 0 else (corner + m - 1) % m
        ex, ez = vertices[other, 0] - vertices[corner, 0], vertices[other, 1] - vertices[corner, 1]
        size = np.sqrt(ex * ex + ez * ez)
        drop = -(sx * ex + sz * ez) / size
        if drop < slope:
            slope = drop
            flat = ux * ex + uz * ez
    room = (1.0 - along) * length if flat > 0.0 else -along * length
    if abs(room) < abs(flat):
        flat = room
    return flat, max(0.0, slope)


@kernel
def _face_below_end(
    obstacle: Obstacle,
    ax: float,
    az: float,
    bx: float,
    bz: float,
    ux: float,
    uz: float,
    along: float,
    nx: float,
    nz: float,
) -> tuple[float, float]:
    """Flat part next to the end of a segment that meets the face with normal (nx, nz)."""
    vertices, normals = obstacle.vertices, obstacle.normals
    m = vertices.shape[0]
    length = ux * (bx - ax) + uz * (bz - az)
    sign = 1.0 if along == 0.0 else -1.0
    px, pz = (ax, az) if along == 0.0 else (bx, bz)
    slope = sign * (nx * ux + nz * uz)
    for i in range(m):
        if normals[i, 0] == nx and normals[i, 1] == nz:
            j = i + 1 if i + 1 < m else 0
            glide = sign * (nx * uz - nz * ux)  # along the face, towards its next vertex
            end = j if glide > 0.0 else i
            room = abs(nx * (vertices[end, 1] - pz) - nz * (vertices[end, 0] - px))
            return sign * min(length, room / max(abs(glide), 1e-12)), max(0.0, slope)
    return 0.0, 1.0


@kernel
def pressure_centre(depth: float, flat: float, slope: float) -> tuple[float, float, float]:
    """Centre of pressure on a flat overlap, as a bed of springs has it.

    Returns its distance from the deepest point (signed as `flat`) and the derivatives of
    that to the depth and to the slope.
    """
    length = abs(flat)
    sign = 1.0 if flat > 0.0 else -1.0
    if slope * length <= depth:  # the whole flat part is in touch
        below = 2.0 * depth - slope * length
        centre = length * (3.0 * depth - 2.0 * slope * length) / (3.0 * below)
        to_depth = length * length * slope / (3.0 * below * below)
        to_slope = -length * length * depth / (3.0 * below * below)
    else:
        centre = depth / (3.0 * slope)
        to_depth = 1.0 / (3.0 * slope)
        to_slope = -centre / slope
    return sign * centre, sign * to_depth, sign * to_slope
