"""A sampled function as polynomials: where it is smooth, and the pieces that follow it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]
Marks = NDArray[np.bool_]

NODES = 12  # that a piece interpolates
BEFORE = 4  # of them before a piece that spans `STRIDE` intervals, and as many after it
STRIDE = 3
SMALLEST_BLOCK, LARGEST_BLOCK = 33, 1 << 16  # intervals that one piece may span
DECAY = 0.5  # at least, of differences by two orders where what is sampled is smooth


@kernel
def smooth_everywhere(values: Array, differences: Array, floor: float) -> bool:
    """Whether every other stencil is smooth (`mark_smooth`): each holds two differences."""
    last = values.size - differences.shape[1]
    for even in range(0, last + 2, 2):
        first = min(even, last)
        if not _is_smooth(values, first, differences, floor):
            return False
    return True


@kernel
def mark_smooth(
    values: Array, differences: Array, floor: float, inside: Marks, crossed: Marks
) -> None:
    """Mark the intervals and nodes of a uniform grid that are inside of a smooth stencil.

    A jump or a kink makes differences grow with their order. A stencil is smooth if two
    differences next to each other are at most `floor` (one alone may vanish by symmetry), or if
    both odd and even differences fall with their order, as far as they are above `floor`.

    Parameters
    ----------
    values
        Shape (n + 1,).
    differences
        Coefficients, one per node, of the two differences next to each other, and, if there are
        more rows, of three odd and three even ones, each by descending order; shape (2 or 8, m).
    inside, crossed
        Of each interval, shape (n,), and of each node, shape (n + 1,); only ever set.
    """
    until, m = 0, differences.shape[1]
    for first in range(values.size - m + 1):
        if _is_smooth(values, first, differences, floor):
            for k in range(max(first, until), first + m - 1):
                inside[k] = True
            until = first + m - 1
            for k in range(first + 1, first + m - 1):
                crossed[k] = True


@kernel
def _is_smooth(values: Array, first: int, differences: Array, floor: float) -> bool:
    small = True
    for row in range(2):
        if abs(_difference(values, first, differences, row)) > floor:
            small = False
    if small or differences.shape[0] == 2:
        return small
    for chain in range(2, 8, 3):
        above = _difference(values, first, differences, chain)
        for row in range(chain + 1, chain + 3):
            difference = _difference(values, first, differences, row)
            if abs(above) > max(floor, DECAY * abs(difference)):
                return False
            above = difference
    return True


@kernel
def _difference(values: Array, first: int, differences: Array, row: int) -> float:
    difference = 0.0
    for j in range(differences.shape[1]):
        difference += differences[row, j] * values[first + j]
    return difference


@kernel
def extrapolate(
    time: Array, values: Array, first: int, count: int, t: float, row: Array
) -> tuple[float, float]:
    """Value at `t` of the polynomial through `count` points, and how far the first one moves it.

    Neville's algorithm; `row` is scratch, shape (count,) or longer.
    """
    for i in range(count):
        row[i] = values[first + i]
    without_first = row[count - 1]
    for order in range(1, count):
        if order == count - 1:
            without_first = row[1]
        for i in range(count - order):
            begin, end = time[first + i], time[first + i + order]
            row[i] += (t - begin) / (end - begin) * (row[i + 1] - row[i])
    return row[0], abs(row[0] - without_first)


@kernel
def _interpolate(
    time: Array, values: Array, first: int, nodes: NDArray[np.intp], origin: float, out: Array
) -> None:
    """Coefficients of (t - origin)^k of the polynomial through nodes, by Newton's differences."""
    count = nodes.size
    for i in range(count):
        out[i] = values[first + nodes[i]]
    for order in range(1, count):
        for i in range(count - 1, order - 1, -1):
            out[i] = (out[i] - out[i - 1]) / (
                time[first + nodes[i]] - time[first + nodes[i - order]]
            )
    for i in range(count - 2, -1, -1):
        shift = time[first + nodes[i]] - origin
        for k in range(i, count - 1):
            out[k] -= shift * out[k + 1]


@kernel
def _follows(
    time: Array, values: Array, first: int, last: int, origin: float, out: Array, allowed: float
) -> bool:
    for i in range(first, last + 1):
        dt = time[i] - origin
        value = 0.0
        for k in range(NODES - 1, -1, -1):
            value = value * dt + out[k]
        if not abs(value - values[i]) <= allowed:
            return False
    return True


@kernel
def fit_pieces(
    time: Array,
    values: Array,
    origin: float,
    uniform_from: int,
    uniform_to: int,
    table: Array,
    allowed: float,
    nodes: NDArray[np.intp],
    start: NDArray[np.intp],
    out: Array,
) -> int:
    """Follow samples of a smooth function by polynomials; return how many.

    Where one polynomial is within `allowed` of all samples of a block, it is taken for the whole
    block, else one for three intervals at a time, through the nodes around them.

    Parameters
    ----------
    time, values
        Of the samples, shape (n,) with n >= NODES.
    origin
        Where the first piece starts, just before the first sample [s].
    uniform_from, uniform_to
        First sample of those with uniform spacing, and the one after the last.
    table
        What the value at each node of a uniform stencil adds to the coefficients of powers of
        (t - start) / spacing, shape (NODES, NODES).
    allowed
        Deviation.
    nodes
        Scratch, shape (NODES,).
    start, out
        Row of the sample that each piece starts at, shape (n,), and its coefficients of
        (t - start)^k, shape (n, NODES).
    """
    n = time.size
    spacing = 0.0
    if uniform_to > uniform_from + 1:
        spacing = (time[uniform_to - 1] - time[uniform_from]) / (uniform_to - 1 - uniform_from)
    at, count, size = 0, 0, SMALLEST_BLOCK
    while at < n - 1:
        size = min(size, n - 1 - at)
        if size >= SMALLEST_BLOCK or n == NODES:
            for j in range(NODES):
                nodes[j] = int(0.5 * size * (1.0 - np.cos(np.pi * j / (NODES - 1))) + 0.5)
                if n == NODES:
                    nodes[j] = j
            begin = time[at] if at > 0 else origin
            _interpolate(time, values, at, nodes, begin, out[count])
            if _follows(time, values, at, at + size, begin, out[count], allowed) or n == NODES:
                start[count] = at
                count += 1
                at += size
                size = min(2 * size, LARGEST_BLOCK)
                continue
            if size >= 2 * SMALLEST_BLOCK:
                size = size // 2
                continue
        size = SMALLEST_BLOCK
        block = min(n - 1, at + SMALLEST_BLOCK)
        while at < block:
            first = min(max(0, at - BEFORE), n - NODES)
            start[count] = at
            if first == at - BEFORE and uniform_from <= first and first + NODES <= uniform_to:
                for k in range(NODES):
                    out[count, k] = 0.0
                for j in range(NODES):
                    for k in range(NODES):
                        out[count, k] += table[j, k] * values[first + j]
                scale = 1.0
                for k in range(1, NODES):
                    scale /= spacing
                    out[count, k] *= scale
            else:
                for j in range(NODES):
                    nodes[j] = j
                begin = time[at] if at > 0 else origin
                _interpolate(time, values, first, nodes, begin, out[count])
            count += 1
            at += STRIDE
    return count
