"""Distances between the whole gripper and the object: what the contact model leaves out.

Only the tip's contour presses on the object.  These kernels tell when another part would.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.kinematics import turn_joint
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
    reach: Array  # of each body's axes and its next joint from its joint [m], shape (n,)


class Recorded(NamedTuple):
    """Recorded states of one half."""

    time: Array  # [s], shape (r,)
    travel: Array  # [m], shape (r,)
    q: Array  # joint angles [rad], shape (r, n)
    other: Array  # joint angles of the other half, in that half's frame [rad], shape (r, n)


class ClearanceWorkspace(NamedTuple):
    """Scratch of the search for touches."""

    placed: Array  # shape (k, 4)
    placed_other: Array  # shape (k, 4)
    gaps: Array  # shape (PARTS,)
    places: Array  # shape (PARTS, 2)
    touching: NDArray[np.bool_]  # shape (PARTS,)
    q: Array  # shape (n,)
    other: Obstacle  # the other tip's flank


def clearance_workspace(segments: Segments) -> ClearanceWorkspace:
    """Allocate the scratch for one half."""
    k = len(segments.body)
    return ClearanceWorkspace(
        np.zeros((k, 4)),
        np.zeros((k, 4)),
        np.zeros(PARTS),
        np.zeros((PARTS, 2)),
        np.zeros(PARTS, dtype=np.bool_),
        np.zeros(len(segments.reach)),
        Obstacle(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros(2), float(segments.radius[-1])),
    )


@kernel
def place_segments(
    chain: Chain, height: float, q: Array, segments: Segments, placed: Array
) -> None:
    """World coordinates (x, z, x, z) of all segments, into `placed`, shape (k, 4)."""
    angle, x, z = 0.0, chain.root[0], height + chain.root[1]
    k = 0
    for i in range(q.size):
        x, z, angle = turn_joint(chain, i, q[i], x, z, angle)
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
        at = segment_distance(obstacle, ax, az, bx, bz)
        gap = at.distance - obstacle.radius - segments.radius[k]
        part = segments.part[k]
        if gap < gaps[part]:
            gaps[part] = gap
            places[part, 0] = ax + at.along * (bx - ax)
            places[part, 1] = az + at.along * (bz - az)


@kernel
def _between(rows: Array, row: int, share: float, between: Array) -> None:
    """Row `row`, or a `share` of the way there from the row before, into `between`."""
    before = max(row - 1, 0)
    for i in range(between.size):
        between[i] = rows[before, i] + share * (rows[row, i] - rows[before, i])


@kernel
def _measure(
    chain: Chain,
    segments: Segments,
    obstacle: Obstacle,
    states: Recorded,
    row: int,
    share: float,
    workspace: ClearanceWorkspace,
) -> None:
    """Gaps of all parts outside the contact model, a `share` of the way to a recorded state."""
    before = max(row - 1, 0)
    travel = states.travel[before] + share * (states.travel[row] - states.travel[before])
    _between(states.other, row, share, workspace.q)
    place_segments(chain, -travel, workspace.q, segments, workspace.placed_other)
    _between(states.q, row, share, workspace.q)
    place_segments(chain, -travel, workspace.q, segments, workspace.placed)
    part_gaps(segments, workspace.placed, obstacle, workspace.gaps, workspace.places)
    workspace.gaps[TIP_FLANK] = np.inf
    # The other tip's flank, mirrored, is an obstacle of two vertices.
    last = segments.body.size - 1
    vertices, normals, centre = (
        workspace.other.vertices,
        workspace.other.normals,
        workspace.other.centre,
    )
    for end in range(2):
        vertices[end, 0] = -workspace.placed_other[last, 2 * end]
        vertices[end, 1] = workspace.placed_other[last, 2 * end + 1]
    dx, dz = vertices[1, 0] - vertices[0, 0], vertices[1, 1] - vertices[0, 1]
    length = np.sqrt(dx * dx + dz * dz)
    normals[0, 0], normals[0, 1] = dz / length, -dx / length
    normals[1, 0], normals[1, 1] = -normals[0, 0], -normals[0, 1]
    centre[0] = 0.5 * (vertices[0, 0] + vertices[1, 0])
    centre[1] = 0.5 * (vertices[0, 1] + vertices[1, 1])
    flank = workspace.placed[last]
    at = segment_distance(workspace.other, flank[0], flank[1], flank[2], flank[3])
    workspace.gaps[OTHER_TIP] = at.distance - 2.0 * workspace.other.radius
    workspace.places[OTHER_TIP, 0] = flank[0] + at.along * (flank[2] - flank[0])
    workspace.places[OTHER_TIP, 1] = flank[1] + at.along * (flank[3] - flank[1])


@kernel
def _longest_way(chain: Chain, rows: Array, row: int, reach: Array) -> float:
    """Bound of how far any point moves relative to the base from row - 1 to `row` [m]."""
    turn, way = 0.0, 0.0
    for i in range(reach.size):
        before, after = rows[row - 1, i], rows[row, i]
        turn += after - before
        way += abs(turn) * reach[i]
        if chain.straightening[i] > 0.0:
            farther = max(before * before, after * after)
            way += chain.straightening[i] * abs(after * after - before * before)
            way += chain.straightening[i] * farther * abs(turn - 0.5 * (after - before))
    return way


@kernel
def first_touches(
    chain: Chain,
    segments: Segments,
    obstacle: Obstacle,
    states: Recorded,
    workspace: ClearanceWorkspace,
    found: Array,
) -> None:
    """First time [s] (inf: never) and place (x, z) [m] at which a part touches.

    Writes a row for each part outside the contact model into `found`, shape (PARTS, 3).
    States that cannot have closed a gap since it was last measured are passed over.
    """
    found[:, 0] = np.inf
    closed, smallest = 0.0, 0.0  # at most, of the smallest gap when last measured
    for row in range(states.time.size):
        if row > 0:
            own = _longest_way(chain, states.q, row, segments.reach)
            fall = abs(states.travel[row] - states.travel[row - 1])
            closed += own + max(fall, _longest_way(chain, states.other, row, segments.reach))
        if closed < smallest:
            continue
        _measure(chain, segments, obstacle, states, row, 1.0, workspace)
        closed, smallest = 0.0, np.inf
        for part in range(PARTS):
            workspace.touching[part] = workspace.gaps[part] < 0.0
            if found[part, 0] == np.inf:
                smallest = min(smallest, workspace.gaps[part])
        for part in range(PARTS):
            if not workspace.touching[part] or found[part, 0] < np.inf:
                continue
            free, touched = 0.0, 1.0  # halve the way from the last state without a touch
            for _ in range(BISECTIONS):
                middle = 0.5 * (free + touched)
                _measure(chain, segments, obstacle, states, row, middle, workspace)
                if workspace.gaps[part] < 0.0:
                    touched = middle
                else:
                    free = middle
            _measure(chain, segments, obstacle, states, row, touched, workspace)
            start = states.time[max(row - 1, 0)]
            found[part, 0] = start + touched * (states.time[row] - start)
            found[part, 1], found[part, 2] = workspace.places[part, 0], workspace.places[part, 1]
