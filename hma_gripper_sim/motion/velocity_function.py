"""A velocity given as a function of time, followed by polynomials to its jumps and kinks."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.velocity_pieces import (
    BEFORE,
    NODES,
    extrapolate,
    fit_pieces,
    mark_smooth,
    smooth_everywhere,
)
from hma_gripper_sim.units import quantity

Array = NDArray[np.float64]
Marks = NDArray[np.bool_]

SPACING = 2e-3  # s, of the samples: what lasts longer is seen
INSIDE = 1e-9  # s; how far inside of a smooth stretch its ends are sampled
CHUNK = 1 << 14  # calls at a time

# Of the largest velocity.
FOLLOWED = 2e-11  # deviation of a polynomial from the samples of a block
SAME = 1e-10  # difference of the velocities on both sides of a kink where it is located
BELONGS = 1e-7  # deviation of a sample from the side of a break that it belongs to
SMALLEST = 1e-9  # m/s; the largest velocity is taken as at least this

# Samples of a stencil, and the differences, relative to the largest velocity, that rounding may
# leave in it. Long stencils tell a kink from a curve; short ones recognise straight lines and
# constants between breaks.
STENCILS = {NODES: 1e-7, 6: 1e-8, 4: 3e-9, 3: 1e-9}

SIDE = 8  # samples that one side of a break is extrapolated from
ENOUGH = 60  # calls to locate a break
FINER = 8  # parts of an interval in which several breaks are told apart
RESOLVED = 2e-16  # s; a jump at an earlier time than 1 s is not located more finely
NARROW = 2e-6  # s, within which both sides of a jump are straight lines
DEEPEST = 4  # times that an interval is divided so
SPARE, SPARE_RATE = 1000, 5000.0  # calls for that, and more of them per second
FAILED = 500  # calls fewer for the rest after each failure

# Samples near the end of a smooth stretch, as shares of the distance to the first regular one;
# that one is at least so many spacings from the end.  A stretch of fewer spacings than
# `SHORT` has only samples at Chebyshev's points.
GRADED = np.array([0.0, 0.08, 0.3, 0.62])
REGULAR, SHORT = 0.7, 8.0


class Pieces(NamedTuple):
    """Velocity in polynomials of the time since their start, see `kernels.base_motion.Motion`."""

    time: Array
    velocity: Array
    jump: Marks


def sampled(
    function: Callable[[float], float], start: float, end: float, breakpoints: Array | None
) -> Pieces:
    """Follow a velocity [m/s] that is a function of time [s] by polynomials.

    The function is called every 2 ms, and up to 60 times more near each of its breaks, the times
    at which it jumps or has a kink. Between two breaks it is interpolated by polynomials of degree
    11: a sine of 20 Hz to 10⁻¹¹ of its amplitude. From piece to piece the velocity is continuous
    to rounding, and the acceleration to what the interpolation is wrong by.

    Where `breakpoints` are given, these are the breaks, and the values there do not matter.
    Otherwise breaks are looked for: a jump is located to rounding, a kink to where both sides
    have the same velocity. What comes and goes within 2 ms may be missed. Where several breaks or
    features of a few milliseconds are near each other, intervals are divided further. That ends
    after 1000 calls and 5000 more per second; a function with noise is then, or as soon as dividing
    does not help, followed by cubics between the samples.

    Raises
    ------
    InputError
        It returns something else than a finite velocity; the time is named.
    """
    samples = Samples(function)
    inside = min(INSIDE, 1e-3 * (end - start))
    count = max(NODES + 1, math.ceil((end - start) / SPACING - 1e-6))
    grid, spacing = np.linspace(start + inside, end - inside, count + 1, retstep=True)
    values = samples.at(grid)
    samples.scale = max(SMALLEST, float(np.abs(values).max()))
    if breakpoints is None:
        found = _find_breaks(samples, grid, values)
    else:
        found = Found(
            breakpoints[(breakpoints > start) & (breakpoints < end)].tolist(), [], grid, values
        )
    return _follow(samples, found, start, end, spacing)


class Samples:
    """Checked values of a function, and how many more may be taken to tell breaks apart."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self._function = function
        self.scale = 0.0  # largest velocity [m/s]
        self.spare = float(SPARE)

    def at(self, time: Array) -> Array:
        """Values at many times [m/s]."""
        found = np.empty(len(time))
        function = self._function
        for first in range(0, len(time), CHUNK):
            instants = time[first : first + CHUNK].tolist()
            try:
                values = np.fromiter(map(function, instants), np.float64, len(instants))
            except (TypeError, ValueError):  # not numbers, or texts with a unit
                values = np.array([self.one(t) for t in instants])
            found[first : first + CHUNK] = values
        for number in (0.0, 1.0):  # which may have been a bool
            rows = np.flatnonzero(found == number)
            if len(rows):
                self.one(float(time[rows[0]]))
        finite = np.isfinite(found)
        if not finite.all():
            row = int(np.argmin(finite))
            _checked(float(found[row]), float(time[row]))
        return found

    def one(self, t: float) -> float:
        """Value at one time [m/s]."""
        return _checked(self._function(t), t)


class Side:
    """Samples on one side of a break, the nearest last."""

    def __init__(self, time: Array, values: Array) -> None:
        self._count = len(time)
        self._time, self._values = np.empty((2, self._count + ENOUGH))
        self._time[: self._count], self._values[: self._count] = time, values
        self._row = np.empty(SIDE)
        self.end, self.value = float(time[-1]), float(values[-1])

    def add(self, t: float, value: float) -> None:
        """Take over the next sample."""
        self._time[self._count], self._values[self._count] = t, value
        self._count += 1
        self.end, self.value = t, value

    def extended(self, t: float) -> tuple[float, float]:
        """Value that the side would have at a time, and how uncertain it is [m/s]."""
        first = max(0, self._count - SIDE)
        return extrapolate(self._time, self._values, first, self._count - first, t, self._row)

    def and_more(self, time: Array, values: Array) -> Side:
        """Side that goes on with more samples."""
        known = slice(max(0, self._count - SIDE), self._count)
        return Side(
            np.concatenate([self._time[known], time]), np.concatenate([self._values[known], values])
        )


class Found(NamedTuple):
    """What a search for breaks has found: their times, and samples that it took on the way."""

    breaks: list[float]
    rough: list[tuple[float, float]]  # spans with too many breaks [s]
    time: Array  # of all samples, uniform or finer
    values: Array


def _find_breaks(samples: Samples, grid: Array, values: Array) -> Found:
    """Look for jumps and kinks between samples on a uniform grid."""
    spacing = (grid[-1] - grid[0]) / (len(grid) - 1)
    # The function itself cannot tell times apart that differ by rounding.
    blur = 1e3 * float(np.abs(np.diff(values)).max()) * np.spacing(abs(grid[-1])) / spacing
    floor = STENCILS[NODES] * samples.scale + blur
    if smooth_everywhere(values, _DIFFERENCES[NODES], floor):
        return Found([], [], grid, values)
    samples.spare = SPARE + SPARE_RATE * (grid[-1] - grid[0])
    gaps = _gaps(samples.scale, values, blur)
    rows = [0, *(row for gap in gaps for row in gap), len(grid) - 1]
    breaks: list[float] = []
    rough: list[tuple[float, float]] = []
    times: list[Array] = []
    knowns: list[Array] = []
    done = 0
    for i, (a, b) in enumerate(gaps):
        first, last = max(rows[2 * i], a - SIDE), min(rows[2 * i + 3], b + SIDE)
        left = Side(grid[first : a + 1], values[first : a + 1])
        right = Side(grid[b : last + 1][::-1], values[b : last + 1][::-1])
        fine = _separate(samples, left, right, grid[a : b + 1], values[a : b + 1])
        if fine is None:
            samples.spare -= FAILED
            rough.append((float(grid[a]), float(grid[b])))
            breaks += rough[-1]
        else:
            breaks += fine.breaks
            times += [grid[done : a + 1], fine.time[1:-1]]
            knowns += [values[done : a + 1], fine.values[1:-1]]
            done = b
    inner = [t for t in sorted(set(breaks)) if grid[0] < t < grid[-1]]
    return Found(
        inner,
        rough,
        np.concatenate([*times, grid[done:]]),
        np.concatenate([*knowns, values[done:]]),
    )


def _gaps(scale: float, values: Array, blur: float) -> list[tuple[int, int]]:
    """First and last row of each run of samples that no smooth stencil connects."""
    inside = np.zeros(len(values) - 1, dtype=np.bool_)
    crossed = np.zeros(len(values), dtype=np.bool_)
    mark_smooth(values, _DIFFERENCES[NODES], STENCILS[NODES] * scale + blur, inside, crossed)
    for a, b in _runs(~inside):
        for count, floor in STENCILS.items():
            if count < min(NODES, b - a + 2):
                allowed = floor * scale + blur
                rows = values[a : b + 1], inside[a:b], crossed[a : b + 1]
                mark_smooth(rows[0], _DIFFERENCES[count], allowed, *rows[1:])
    # A kink at a sample is in neither of its intervals.
    alone = np.flatnonzero(~crossed[1:-1] & inside[:-1] & inside[1:])
    inside[alone] = inside[alone + 1] = False
    return _runs(~inside)


def _runs(marks: Marks) -> list[tuple[int, int]]:
    """First row of each run of marks and the one after its last."""
    steps = np.flatnonzero(np.diff(marks, prepend=False, append=False)).tolist()
    return list(zip(steps[::2], steps[1::2], strict=True))


def _separate(
    samples: Samples, left: Side, right: Side, time: Array, values: Array, depth: int = 0
) -> Found | None:
    """Find the breaks among samples of which the first and the last end smooth sides.

    None: there are too many.
    """
    if _is_single(samples.scale, left, right, time[1:-1], values[1:-1]):
        found = _locate(samples, left, right)
        if found is not None:
            return Found([found], [], time, values)
        if len(time) == 2:
            time = np.array([left.end, right.end])
    count = FINER * (len(time) - 1)
    if depth == DEEPEST or samples.spare < count:
        return None
    samples.spare -= count
    fine = np.linspace(time[0], time[-1], count + 1)
    finer = np.concatenate([[left.value], samples.at(fine[1:-1]), [right.value]])
    gaps = _gaps(samples.scale, finer, 0.0)
    if gaps == [(0, count)] and count > FINER:
        return None
    rows = [0, *(row for gap in gaps for row in gap), count]
    breaks: list[float] = []
    for i, (a, b) in enumerate(gaps):
        first, last = rows[2 * i], rows[2 * i + 3]
        before = Side(fine[first : a + 1], finer[first : a + 1])
        after = Side(fine[b : last + 1][::-1], finer[b : last + 1][::-1])
        if first == 0:
            before = left.and_more(fine[1 : a + 1], finer[1 : a + 1])
        if last == count:
            after = right.and_more(fine[b:count][::-1], finer[b:count][::-1])
        inner = _separate(samples, before, after, fine[a : b + 1], finer[a : b + 1], depth + 1)
        if inner is None:
            return None
        breaks += inner.breaks
    return Found(breaks, [], fine, finer)


def _is_single(scale: float, left: Side, right: Side, time: Array, values: Array) -> bool:
    """Whether samples between two sides belong to the left one first and then to the right one."""
    belong = []
    for t, value in zip(time.tolist(), values.tolist(), strict=True):
        misses = [
            abs(value - extended) <= BELONGS * scale + 3.0 * doubt
            for extended, doubt in (left.extended(t), right.extended(t))
        ]
        if not any(misses):
            return False
        belong.append(misses)
    return any(
        all(ours for ours, _ in belong[:k]) and all(theirs for _, theirs in belong[k:])
        for k in range(len(belong) + 1)
    )


def _locate(samples: Samples, left: Side, right: Side) -> float | None:
    """Time of the only break between two sides, or None if there must be several.

    Each sample belongs to the side whose extension it is nearer to, and that side takes it over.
    """
    trials: list[float] = []
    width = math.inf
    for _ in range(ENOUGH):
        first, last = left.end, right.end
        if not trials:
            before = left.value - right.extended(first)[0]
            after = left.extended(last)[0] - right.value
            if max(abs(before), abs(after)) <= SAME * samples.scale:
                return 0.5 * (first + last)
            if last - first < NARROW and before * after > 0.0:
                return _bisect(samples, left, right, before, after)
            halved = last - first <= 0.5 * width
            width = last - first
            trials = _trials(left, right, before, after) if halved else [0.5 * (first + last)]
        t = trials.pop()
        if not first < t < last:
            continue
        value = samples.one(t)
        sides = [(*side.extended(t), side) for side in (left, right)]
        extended, doubt, side = min(sides, key=lambda known: abs(value - known[0]))
        if abs(value - extended) > BELONGS * samples.scale + 3.0 * doubt:
            return None
        side.add(t, value)
    return None


def _trials(left: Side, right: Side, before: float, after: float) -> list[float]:
    """Times to sample next for a break between two sides that differ by `before` and `after`.

    Where the sides cross, a kink is looked for just before and after the crossing.
    """
    first, last = left.end, right.end
    if before * after < 0.0:
        crossing = first + (last - first) * before / (before - after)
        doubt = left.extended(crossing)[1] + right.extended(crossing)[1]
        share = max(4.0 * doubt / abs(before - after), 1e-3)
        around = [crossing + sign * share * (last - first) for sign in (-1.0, 1.0)]
        if share < 0.25 and any(first < t < last for t in around):
            return around
    return [0.5 * (first + last)]


def _bisect(samples: Samples, left: Side, right: Side, before: float, after: float) -> float | None:
    """Time of a jump between two sides that are straight lines so near to it."""
    first, last = start, end = left.end, right.end
    base, slope = left.value, (right.value + after - left.value) / (end - start)
    while last - first > max(math.ulp(last), RESOLVED):
        t = 0.5 * (first + last)
        value = samples.one(t)
        over = value - base - slope * (t - start)  # 0 on the left side, -jump on the right one
        jump = before + (after - before) * (t - start) / (end - start)
        if abs(over) < abs(over + jump):
            first, miss = t, over
            known = left
        else:
            last, miss = t, over + jump
            known = right
        if abs(miss) > BELONGS * samples.scale:
            return None
        known.add(t, value)
    return last


def _follow(samples: Samples, found: Found, start: float, end: float, spacing: float) -> Pieces:
    """Follow the function between its breaks."""
    grid, values = found.time, found.values
    stretches, asked = [], [np.empty(0)]
    edges = [start, *found.breaks, end]
    for a, b in pairwise(edges):
        stretches.append(_stretch(grid, spacing, a, b, (a, b) in found.rough))
        asked += [stretches[-1].head, stretches[-1].tail]
    answers = samples.at(np.concatenate(asked))
    capacity = len(grid) + len(answers) + len(stretches)
    pieces = Pieces(
        np.empty(capacity + 1), np.empty((capacity, NODES)), np.zeros(capacity, dtype=np.bool_)
    )
    count = used = 0
    for stretch in stretches:
        middle = used + len(stretch.head)
        end = middle + len(stretch.tail)
        known = (answers[used:middle], values[stretch.rows], answers[middle:end])
        used = end
        time = np.concatenate([stretch.head, grid[stretch.rows], stretch.tail])
        room = Pieces(pieces.time[count:], pieces.velocity[count:], pieces.jump[count:])
        fit = _roughly if stretch.rough else _smooth
        room.jump[0] = True
        count += fit(stretch, time, np.concatenate(known), FOLLOWED * samples.scale, room)
    pieces.time[count] = edges[-1]
    velocity, order = pieces.velocity[:count], NODES
    while order > 1 and not velocity[:, order - 1].any():
        order -= 1
    if order < NODES:
        velocity = velocity[:, :order].copy()
    return Pieces(pieces.time[: count + 1], velocity, pieces.jump[:count])


class Stretch(NamedTuple):
    """Samples between two breaks: rows of the grid, and times of more before and after them."""

    start: float
    rows: slice
    head: Array
    tail: Array
    even: bool  # whether the spacing of the grid is uniform there
    rough: bool


def _stretch(grid: Array, spacing: float, start: float, end: float, rough: bool) -> Stretch:
    """Choose the samples from one break to the next one [s], none of them at a break."""
    if rough:
        first, last = np.searchsorted(grid, [start, end])
        return Stretch(start, slice(first, last + 1), np.empty(0), np.empty(0), True, True)
    inside = min(INSIDE, 1e-3 * (end - start))
    a, b = start + inside, end - inside
    if end - start < SHORT * spacing:
        shares = 0.5 * (1.0 - np.cos(np.pi * np.arange(NODES) / (NODES - 1)))
        return Stretch(start, slice(0), a + (b - a) * shares, np.empty(0), False, False)
    first = int(np.searchsorted(grid, a + REGULAR * spacing))
    last = int(np.searchsorted(grid, b - REGULAR * spacing, side="right")) - 1
    head = a + (grid[first] - a) * GRADED
    tail = (b - (b - grid[last]) * GRADED)[::-1]
    even = last - first == round((grid[last] - grid[first]) / spacing)
    return Stretch(start, slice(first, last + 1), head, tail, even, False)


def _smooth(stretch: Stretch, time: Array, values: Array, allowed: float, room: Pieces) -> int:
    """Fill in the pieces of a smooth stretch; return how many."""
    rows = np.empty(len(time) // 2 + 2, dtype=np.intp)
    count = fit_pieces(
        time,
        values,
        stretch.start,
        len(stretch.head),
        len(stretch.head) + (stretch.rows.stop - stretch.rows.start if stretch.even else 0),
        _TABLE,
        allowed,
        np.empty(NODES, dtype=np.intp),
        rows,
        room.velocity,
    )
    room.time[:count] = time[rows[:count]]
    room.time[0] = stretch.start
    return int(count)


def _roughly(stretch: Stretch, time: Array, values: Array, allowed: float, room: Pieces) -> int:
    """Fill in a cubic between each two samples, through two more; return how many."""
    count = len(time) - 1
    nodes = min(4, count + 1)
    first = np.clip(np.arange(count) - 1, 0, count + 1 - nodes)
    stencils = first[:, None] + np.arange(nodes)
    room.time[:count] = time[:-1]
    room.velocity[:count] = 0.0
    since = time[stencils] - time[:-1, None]
    powers = since[..., None] ** np.arange(nodes)
    room.velocity[:count, :nodes] = np.linalg.solve(powers, values[stencils][..., None])[..., 0]
    return count


def _checked(value: object, t: float) -> float:
    try:
        return quantity(value, "m/s", field="velocity", source="simulate")
    except InputError as error:
        raise InputError(f"{error.reason} at t = {t:g} s", field="velocity") from None


def _lagrange() -> Array:
    """Coefficients of Lagrange's polynomials of a uniform stencil about its piece's start."""
    nodes = np.arange(NODES) - float(BEFORE)
    others = [np.delete(nodes, j) for j in range(NODES)]
    return np.array([np.poly(o)[::-1] / np.prod(x - o) for x, o in zip(nodes, others, strict=True)])


_TABLE = _lagrange()


def _differences(count: int) -> Array:
    """Coefficients of the differences that tell a smooth stencil, see `mark_smooth`."""
    high = count - 2
    wanted = [(high, 0), (high, 1)]
    if count == NODES:
        wanted += [
            (high + 1, 0),
            (high - 1, 1),
            (high - 3, 2),
            (high, 0),
            (high - 2, 1),
            (high - 4, 2),
        ]
    rows = np.zeros((len(wanted), count))
    for row, (order, before) in zip(rows, wanted, strict=True):
        row[before : before + order + 1] = [
            (-1) ** k * math.comb(order, k) for k in range(order + 1)
        ]
    return rows


_DIFFERENCES = {count: _differences(count) for count in STENCILS}
