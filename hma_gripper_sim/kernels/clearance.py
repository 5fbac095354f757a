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


class Recorded(NamedTuple):
    """Recorded states of one half."""

    time: Array  # [s], shape (r,)
    travel: Array  # [m], shape (r,)
    q: Array  # joint angles [rad], shape (r, n)
    other: Array  # axis of the other tip's flank in this half's frame [m], shape (r, 4)


class ClearanceWork(NamedTuple):
    """Scratch of the search for touches."""

    placed: Array  # shape (k, 4)
    gaps: Array  # shape (PARTS,)
    places: Array  # shape (PARTS, 2)
    touching: NDArray[np.bool_]  # shape (PARTS,)
    q: Array  # shape (n,)
    other: Obstacle  # the other tip's flank


def clearance_work(segments: Segments, joints: int) -> ClearanceWork:
    """Allocate the scratch for a gripper of `joints` per half."""
    radius = float(segments.radius[-1])
    return ClearanceWork(
        np.zeros((len(segments.body), 4)),
        np.zeros(PARTS),
        np.zeros((PARTS, 2)),
        np.zeros(PARTS, dtype=np.bool_),
        np.zeros(joints),
        Obstacle(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(2), radius),
    )


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
    chain: Chain, segments: Segments, travel: Array, q: Array, placed: Array, flanks: Array
) -> None:
    """Axis of the tip's flank in the frame of the other half, for each row of `q`, (r, 4).

    `placed` is scratch of shape (k, 4).
    """
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
        distance, _, _, along, _, _, _, _, _ = segment_distance(obstacle, ax, az, bx, bz)
        gap = distance - obstacle.radius - segments.radius[k]
        part = segments.part[k]
        if gap < gaps[part]:
            gaps[part] = gap
            places[part, 0] = ax + along * (bx - ax)
            places[part, 1] = az + along * (bz - az)


@kernel
def _gaps_between(
    chain: Chain,
    segments: Segments,
    obstacle: Obstacle,
    states: Recorded,
    row: int,
    share: float,
    work: ClearanceWork,
) -> None:
    """Gaps of all parts outside the contact model, a `share` of the way to a recorded state."""
    before = max(row - 1, 0)
    for i in range(work.q.size):
        work.q[i] = states.q[before, i] + share * (states.q[row, i] - states.q[before, i])
    travel = states.travel[before] + share * (states.travel[row] - states.travel[before])
    place_segments(chain, -travel, work.q, segments, work.placed)
    part_gaps(segments, work.placed, obstacle, work.gaps, work.places)
    work.gaps[TIP_FLANK] = np.inf
    # The other tip's flank is an obstacle of two vertices.
    vertices, normals, centre = work.other.vertices, work.other.normals, work.other.centre
    for j in range(4):
        axis = states.other[before, j] + share * (states.other[row, j] - states.other[before, j])
        vertices[j // 2, j % 2] = axis
    dx, dz = vertices[1, 0] - vertices[0, 0], vertices[1, 1] - vertices[0, 1]
    length = np.sqrt(dx * dx + dz * dz)
    normals[0, 0], normals[0, 1] = dz / length, -dx / length
    normals[1, 0], normals[1, 1] = -normals[0, 0], -normals[0, 1]
    centre[0] = 0.5 * (vertices[0, 0] + vertices[1, 0])
    centre[1] = 0.5 * (vertices[0, 1] + vertices[1, 1])
    flank = work.placed[segments.body.size - 1]
    distance, _, _, along, _, _, _, _, _ = segment_distance(
        work.other, flank[0], flank[1], flank[2], flank[3]
    )
    work.gaps[OTHER_TIP] = distance - 2.0 * work.other.radius
    work.places[OTHER_TIP, 0] = flank[0] + along * (flank[2] - flank[0])
    work.places[OTHER_TIP, 1] = flank[1] + along * (flank[3] - flank[1])


@kernel
def first_touches(
    chain: Chain,
    segments: Segments,
    obstacle: Obstacle,
    states: Recorded,
    work: ClearanceWork,
    found: Array,
) -> None:
    """First time [s] (inf: never) and place (x, z) [m] at which a part touches.

    Writes a row for each part outside the contact model into `found`, shape (PARTS, 3).
    """
    found[:, 0] = np.inf
    for row in range(states.time.size):
        _gaps_between(chain, segments, obstacle, states, row, 1.0, work)
        for part in range(PARTS):
            work.touching[part] = work.gaps[part] < 0.0
        for part in range(PARTS):
            if not work.touching[part] or found[part, 0] < np.inf:
                continue
            free, touched = 0.0, 1.0  # halve the way from the last state without a touch
            for _ in range(BISECTIONS):
                middle = 0.5 * (free + touched)
                _gaps_between(chain, segments, obstacle, states, row, middle, work)
                if work.gaps[part] < 0.0:
                    touched = middle
                else:
                    free = middle
            _gaps_between(chain, segments, obstacle, states, row, touched, work)
            start = states.time[max(row - 1, 0)]
            found[part, 0] = start + touched * (states.time[row] - start)
            found[part, 1], found[part, 2] = work.places[part, 0], work.places[part, 1]
