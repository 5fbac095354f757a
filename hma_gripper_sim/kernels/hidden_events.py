"""Events between the ends of a step: touches and changes of friction that both ends conceal.

Between its ends a step's joint angles are cubic Hermite polynomials.  With their Bernstein
coefficients every point of the tip has a bound on its acceleration, so that along any fixed
direction it stays within ``bound (b - a)^2 / 8`` of the straight line between its places at a
and b.  A half-plane that holds the object and is clear of the point at both ends by more than
that proves that nothing was touched between them; where it proves nothing, the interval is
halved.  Passing close by an object is cheap, since only motion towards it counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.base_motion import (
    Stretch,
    acceleration_bound,
    base_in_step,
    base_motion,
)
from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import OPEN, ContactModes
from hma_gripper_sim.kernels.hermite import interpolate
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.proximity import support
from hma_gripper_sim.kernels.stage import Model
from hma_gripper_sim.kernels.touch import Fingertip, nearest_point

Array = NDArray[np.float64]

SHORTEST = 1e-9  # s; intervals are not divided further
CLOSE = 1e-3  # how exactly a touch is timed, relative to its time


class Placed(NamedTuple):
    """Tip at one instant, with a half-plane for each contact candidate that holds the object."""

    points: Array  # of the tip, world frame [m], shape (p, 2)
    normal: Array  # outward normal of the half-plane, shape (k, 2)
    edge: Array  # the object reaches that far along it [m], shape (k,)
    gap: Array  # [m], shape (k,)


class Passage(NamedTuple):
    """Joint angles and rates at both ends of a step: what their Hermite polynomials are made of."""

    q0: Array  # [rad], shape (n,)
    v0: Array  # [rad/s], shape (n,)
    q1: Array
    v1: Array


class PassageWorkspace(NamedTuple):
    """Scratch of the search."""

    q: Array  # shape (n,)
    base: Array  # shape (3,)
    start: Placed
    end: Placed
    floor: Array  # gap of each candidate from which on it counts as touching [m], shape (k,)


def passage_workspace(n: int, points: int, candidates: int) -> PassageWorkspace:
    """Allocate the scratch for `n` joints, points of the tip and contact candidates."""
    start, end = (
        Placed(
            np.zeros((points, 2)),
            np.zeros((candidates, 2)),
            np.zeros(candidates),
            np.zeros(candidates),
        )
        for _ in range(2)
    )
    return PassageWorkspace(np.zeros(n), np.zeros(3), start, end, np.zeros(candidates))


@kernel
def tip_acceleration(chain: Chain, fingertip: Fingertip, h: float, passage: Passage) -> float:
    """Bound on the acceleration of the tip's points relative to the base in a step [m/s^2].

    Rates and accelerations are between the Bernstein coefficients of the Hermite polynomials.
    """
    q0, v0, q1, v1 = passage.q0, passage.v0, passage.q1, passage.v1
    n = q0.size
    first, middle, last = 0.0, 0.0, 0.0
    bound = 0.0
    for i in range(n):
        between = 3.0 * (q1[i] - q0[i]) / h - v0[i] - v1[i]
        before = max(abs(first), abs(middle), abs(last))
        turned = 2.0 * max(abs(middle - first), abs(last - middle)) / h
        first += v0[i]
        middle += between
        last += v1[i]
        rate = max(abs(first), abs(middle), abs(last))
        gain = 2.0 * max(abs(middle - first), abs(last - middle)) / h
        if i < n - 1:
            length = np.sqrt(chain.link[i, 0] ** 2 + chain.link[i, 1] ** 2)
        else:
            length = 0.0
            for k in range(fingertip.points.shape[0]):
                reach = fingertip.points[k, 0] ** 2 + fingertip.points[k, 1] ** 2
                length = max(length, np.sqrt(reach))
        bound += length * (gain + rate * rate)
        if chain.straightening[i] > 0.0:
            swing = max(abs(v0[i]), abs(between), abs(v1[i]))
            jerk = 2.0 * max(abs(between - v0[i]), abs(v1[i] - between)) / h
            angle = max(abs(q0[i]), abs(q1[i])) + h * swing
            rate, gain = max(rate, before), max(gain, turned)
            slide = angle * angle * (gain + rate * rate)
            slide += 4.0 * angle * swing * rate + 2.0 * (swing * swing + angle * jerk)
            bound += chain.straightening[i] * slide
    return bound


@kernel
def _place(model: Model, height: float, q: Array, placed: Placed) -> None:
    """Fill `placed` for the height of the base and the joint angles `q`."""
    fingertip, obstacle = model.fingertip, model.obstacle
    x, z, angle = place_tip(model.chain, -height, q)
    cos, sin = np.cos(angle), np.sin(angle)
    points = fingertip.points
    for k in range(points.shape[0]):
        placed.points[k, 0] = x + cos * points[k, 0] - sin * points[k, 1]
        placed.points[k, 1] = z + sin * points[k, 0] + cos * points[k, 1]
    for k in range(placed.gap.size):
        at = nearest_point(fingertip, obstacle, x, z, cos, sin, k)
        placed.normal[k, 0] = at.nx
        placed.normal[k, 1] = at.nz
        placed.edge[k] = support(obstacle, at.nx, at.nz) + obstacle.radius + fingertip.radius
        placed.gap[k] = at.gap


@kernel
def _clearance(fingertip: Fingertip, placed: Placed, halfplane: Placed, k: int) -> float:
    """How far candidate `k` of `placed` is clear of a half-plane that holds the object [m]."""
    nx, nz, edge = halfplane.normal[k, 0], halfplane.normal[k, 1], halfplane.edge[k]
    points = placed.points
    if not fingertip.capsule:
        return float(nx * points[k, 0] + nz * points[k, 1] - edge)
    first = nx * points[0, 0] + nz * points[0, 1]
    second = nx * points[1, 0] + nz * points[1, 1]
    return float(min(first, second) - edge)


@kernel
def _copy(source: Placed, target: Placed) -> None:
    """Copy all of it."""
    for k in range(source.points.shape[0]):
        for j in range(2):
            target.points[k, j] = source.points[k, j]
    for k in range(source.gap.size):
        for j in range(2):
            target.normal[k, j] = source.normal[k, j]
        target.edge[k] = source.edge[k]
        target.gap[k] = source.gap[k]


@kernel
def _is_open(before: ContactModes, inside: ContactModes, after: ContactModes, k: int) -> bool:
    """Whether contact `k` is open at the start of a step, at its inner stage and at its end."""
    return bool(before.normal[k] == OPEN and inside.normal[k] == OPEN and after.normal[k] == OPEN)


@kernel
def _longest_way(start: Placed, end: Placed) -> float:
    """Largest distance between the places of a point of the tip [m]."""
    way = 0.0
    for k in range(end.points.shape[0]):
        dx = end.points[k, 0] - start.points[k, 0]
        dz = end.points[k, 1] - start.points[k, 1]
        way = max(way, np.sqrt(dx * dx + dz * dz))
    return way


@kernel
def _is_clear(
    fingertip: Fingertip, workspace: PassageWorkspace, k: int, low: float, way: float
) -> bool:
    """Whether candidate `k` is proven to stay higher than `low` [m] between start and end.

    On straight lines, no point of the tip going further than `way` [m].
    """
    near, far = workspace.start.gap[k], workspace.end.gap[k]
    if near >= low and _clearance(fingertip, workspace.end, workspace.start, k) >= low:
        return True
    if far >= low and _clearance(fingertip, workspace.start, workspace.end, k) >= low:
        return True
    return bool(0.5 * (near + far - way) >= low)


@kernel
def first_hidden_touch(
    model: Model,
    stretch: Stretch,
    passage: Passage,
    before: ContactModes,
    inside: ContactModes,
    after: ContactModes,
    depth: float,
    workspace: PassageWorkspace,
) -> float:
    """When in a step an open contact first is deeper than `depth`.

    Looks at contacts that are open at the start, at the inner stage and at the end.  One that
    overlaps at an end, as after a release, counts where it is deeper than there.

    Returns
    -------
    float
        Time after the start until which nothing is touched, shortly before something is [s], or
        infinity.
    """
    fingertip, h = model.fingertip, stretch.h
    closed = True
    for k in range(before.normal.size):
        closed &= not _is_open(before, inside, after, k)
    if closed:
        return np.inf
    bound = tip_acceleration(model.chain, fingertip, h, passage)
    bound += acceleration_bound(stretch)
    a, d = 0.0, h
    base_in_step(stretch, 0.0, workspace.base)
    _place(model, workspace.base[0], passage.q0, workspace.start)
    base_in_step(stretch, 1.0, workspace.base)
    _place(model, workspace.base[0], passage.q1, workspace.end)
    for k in range(workspace.floor.size):
        workspace.floor[k] = min(0.0, workspace.start.gap[k], workspace.end.gap[k]) - depth
    while a < h:
        b = a + d if a + 1.01 * d < h else h
        interpolate(h, b / h, passage.q0, passage.v0, passage.q1, passage.v1, workspace.q)
        base_motion(stretch.motion, stretch.segment, stretch.t + b, workspace.base)
        _place(model, workspace.base[0], workspace.q, workspace.end)
        sag = 0.125 * bound * (b - a) * (b - a)
        way = _longest_way(workspace.start, workspace.end)
        clear, touched = True, False
        for k in range(workspace.floor.size):
            low = workspace.floor[k] + sag
            if _is_open(before, inside, after, k) and not _is_clear(
                fingertip, workspace, k, low, way
            ):
                clear = False
                touched |= workspace.end.gap[k] < workspace.floor[k]
        if clear or b - a < SHORTEST:
            a, d = b, 2.0 * (b - a)
            _copy(workspace.end, workspace.start)
        elif touched and b - a < CLOSE * b:
            return a
        else:
            d = 0.5 * (b - a)
    return np.inf


@kernel
def first_dip(h: float, inner: float, start: float, middle: float, end: float, low: float) -> float:
    """When a quadratic through values at 0, `inner` and `h` first falls to zero.

    Counts only a dip below `low` (negative) between positive ends; else infinity.
    """
    if start <= 0.0 or end <= 0.0:
        return np.inf
    slope = (middle - start) / inner
    curve = ((end - start) / h - slope) / (h - inner)
    slope -= curve * inner
    if curve <= 0.0 or slope >= 0.0 or start - 0.25 * slope * slope / curve >= low:
        return np.inf
    return float(2.0 * start / (-slope + np.sqrt(slope * slope - 4.0 * curve * start)))
