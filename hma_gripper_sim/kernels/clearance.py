"""Distances between the whole gripper and the object: what the contact model leaves out.

Only the tip's contour presses on the object.  These kernels tell when another part would.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.proximity import Obstacle, segment_distance

Array = NDArray[np.float64]

TOP_BEAM, SIDE_BEAM, TIP_SHANK, TIP_FLANK, OTHER_TIP = range(5)
PARTS = 5
BISECTIONS = 20  # of a recorded step, to time a touch
JOINED = 1e-3  # m; end of the shank that belongs to the flank's contour


class Segments(NamedTuple):
    """Axes of the straight, round-ended pieces of one half."""

    body: NDArray[np.int64]  # which body, shape (k,)
    part: NDArray[np.int64]  # TOP_BEAM .. TIP_FLANK, shape (k,)
    ends: Array  # x, z, x, z in the body's frame [m], shape (k, 4)
    radius: Array  # half the thickness [m], shape (k,)


@kernel
def place_segments(
    chain: Chain, height: float, q: Array, segments: Segments, placed: Array
) -> None:
    """World coordinates (x, z, x, z) of all segments, into `placed`, shape (k, 4)."""
    angle, x, z = 0.0, chain.root[0], height + chain.root[1]
    k = 0
    for i in range(q.size):
        angle += chain.rest[i] + q[i]
        cos, sin = np.cos(angle), np.sin(angle)
        while k < segments.body.size and segments.body[k] == i:
            for end in range(0, 4, 2):
                ex, ez = segments.ends[k, end], segments.ends[k, end + 1]
                placed[k, end] = x + cos * ex - sin * ez
                placed[k, end + 1] = z + sin * ex + cos * ez
            k += 1
        x += cos * chain.link[i, 0] - sin * chain.link[i, 1]
        z += sin * chain.link[i, 0] + cos * chain.link[i, 1]


@kernel
def mirrored_flanks(
    chain: Chain, segments: Segments, travel: Array, q: Array, flanks: Array
) -> None:
    """Axis of the tip's flank in the frame of the other half, for each row of `q`, (r, 4)."""
    placed = np.empty((segments.body.size, 4))
    last = segments.body.size - 1
    for row in range(travel.size):
        place_segments(chain, -travel[row], q[row], segments, placed)
        for j in range(4):
            flanks[row, j] = -placed[last, j] if j % 2 == 0 else placed[last, j]


@kernel
def part_gaps(
    segments: Segments, placed: Array, obstacle: Obstacle, gaps: Array, places: Array
) -> None:
    """Smallest gap of each part to the object and the point of its axis where it is.

    Writes gaps [m], shape (PARTS,), and places [m], shape (PARTS, 2).
    """
    gaps[:] = np.inf
    for k in range(segments.body.size):
        ax, az, bx, bz = placed[k, 0], placed[k, 1], placed[k, 2], placed[k, 3]
        if segments.part[k] == TIP_SHANK:
            # Its end lies inside the flank's contour, which the contact model does cover.
            keep = 1.0 - JOINED / np.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
            bx, bz = ax + keep * (bx - ax), az + keep * (bz - az)
        distance, _, _, along, _, _, _ = segment_distance(obstacle, ax, az, bx, bz)
        gap = distance - obstacle.radius - segments.radius[k]
        part = segments.part[k]
        if gap < gaps[part]:
            gaps[part] = gap
            places[part, 0] = ax + along * (bx - ax)
            places[part, 1] = az + along * (bz - az)


@kernel
def _all_gaps(
    chain: Chain,
    segments: Segments,
    obstacle: Obstacle,
    travel: float,
    q: Array,
    other: Array,
    placed: Array,
    gaps: Array,
    places: Array,
) -> None:
    """Gaps of all parts outside the contact model in one pose; arguments as `first_touches`."""
    place_segments(chain, -travel, q, segments, placed)
    part_gaps(segments, placed, obstacle, gaps, places)
    gaps[TIP_FLANK] = np.inf
    ax, az, bx, bz = other[0], other[1], other[2], other[3]
    length = np.sqrt((bx - ax) ** 2 + (bz - az) ** 2)
    vertices, normals, centre = np.empty((2, 2)), np.empty((2, 2)), np.empty(2)
    vertices[0, 0], vertices[0, 1], vertices[1, 0], vertices[1, 1] = ax, az, bx, bz
    normals[0, 0], normals[0, 1] = (bz - az) / length, (ax - bx) / length
    normals[1, 0], normals[1, 1] = -normals[0, 0], -normals[0, 1]
    centre[0], centre[1] = 0.5 * (ax + bx), 0.5 * (az + bz)
    last = segments.body.size - 1
    flank, radius = placed[last], segments.radius[last]
    distance, _, _, along, _, _, _ = segment_distance(
        Obstacle(vertices, normals, centre, radius), flank[0], flank[1], flank[2], flank[3]
    )
    gaps[OTHER_TIP] = distance - 2.0 * radius
    places[OTHER_TIP, 0] = flank[0] + along * (flank[2] - flank[0])
    places[OTHER_TIP, 1] = flank[1] + along * (flank[3] - flank[1])


@kernel
def first_touches(
    chain: Chain,
    segments: Segments,
    obstacle: Obstacle,
    time: Array,
    travel: Array,
    q: Array,
    other: Array,
    found: Array,
) -> None:
    """First time and place at which a part outside the contact model touches.

    Parameters
    ----------
    time, travel, q
        Recorded states, shape (r,), (r,) and (r, n).
    other
        Axis of the other tip's flank in this half's frame, shape (r, 4).
    found
        Result: time [s] (inf: never), x, z [m] for each part, shape (PARTS, 3).
    """
    placed = np.empty((segments.body.size, 4))
    gaps, places = np.empty(PARTS), np.empty((PARTS, 2))
    found[:, 0] = np.inf
    for row in range(time.size):
        _all_gaps(chain, segments, obstacle, travel[row], q[row], other[row], placed, gaps, places)
        touching = gaps < 0.0
        before = max(row - 1, 0)
        for part in range(PARTS):
            if not touching[part] or found[part, 0] < np.inf:
                continue
            free, touched = 0.0, 1.0  # halve the way from the last state without a touch
            for _ in range(BISECTIONS):
                middle = 0.5 * (free + touched)
                _all_gaps(
                    chain,
                    segments,
                    obstacle,
                    travel[before] + middle * (travel[row] - travel[before]),
                    q[before] + middle * (q[row] - q[before]),
                    other[before] + middle * (other[row] - other[before]),
                    placed,
                    gaps,
                    places,
                )
                if gaps[part] < 0.0:
                    touched = middle
                    found[part, 1], found[part, 2] = places[part, 0], places[part, 1]
                else:
                    free = middle
            found[part, 0] = time[before] + touched * (time[row] - time[before])
