"""Which tick took a command whose effect shows late: one that renews another, until it expires."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.kernels.drive_profile import Axis, drive_profile
from hma_gripper_sim.recordings.recording import FloatArray

Ticks = npt.NDArray[np.int64]

_HOPELESS = 20
"""Places one after the other that no command explains: the way is not that of such a drive."""

_SEEN = 2
"""Ticks by which the way is the measured one for longer where an effect is where it was seen."""


def profile(
    axis: Axis, commands: FloatArray, travel: float, velocity: float
) -> tuple[FloatArray, FloatArray]:
    """Travel [m] and velocity [m/s] of the drive at the ends of its ticks, from a start on.

    Parameters
    ----------
    commands
        Velocity that came before each tick, NaN where none did [m/s].
    """
    travels, velocities = np.empty((2, len(commands) + 1))
    travels[0], velocities[0] = travel, velocity
    drive_profile(axis, commands, travels, velocities)
    return travels, velocities


def by_tick(count: int, ticks: Ticks, values: FloatArray) -> FloatArray:
    """Return the velocity that came before each tick: of several the last, NaN where none did."""
    commands = np.full(count, np.nan)
    commands[ticks] = values
    return commands


def settle_renewals(
    axis: Axis,
    start: tuple[float, float],
    way: FloatArray,
    values: FloatArray,
    slack: tuple[int, int],
    horizon: int,
    exact: float,
    ticks: Ticks,
) -> None:
    """Find by which tick commands were taken, where the measured travel shows it only later.

    A command that renews another changes nothing when it is taken. It shows when it expires, or if
    it moves a drive again that had stopped. Where the drive's way is not the measured one, the last
    command, or the next, is moved to where it is so until `horizon` ticks later, or until another
    command may show. If it is so nowhere, it stays where it is.

    Parameters
    ----------
    start
        Travel [m] and velocity [m/s] before the first tick.
    way
        That was made in each tick, NaN where it is not known [m], shape (n,).
    values
        Of the commands [m/s], shape (m,).
    slack
        Ticks by which a log may be wrong about when a command was taken: usually, and at most.
    exact
        Largest difference of the ways [m] that is rounding.
    ticks
        Tick that takes each command, never decreasing, below n; changed in place, shape (m,).
    """
    count, after, failures = len(way), 0, 0
    while failures < _HOPELESS:
        driven = profile(axis, by_tick(count, ticks, values), *start)
        wrong = _first_wrong(driven[0], way, after, exact)
        if wrong == count:
            return
        here = int(np.searchsorted(ticks, wrong, side="right")) - 1
        known = min(wrong + horizon, count)
        best, moved, to = (wrong, 0), -1, 0
        for j in (here, here + 1):
            if not 0 <= j < len(ticks):
                continue
            enough = known
            if j + 1 < len(ticks):
                enough = min(known, max(wrong + 1, int(ticks[j + 1]) - slack[0]))
            places = _places(ticks, j, slack[1], count)
            end = min(count, max(wrong, int(ticks[j])) + slack[1] + horizon)
            until = _explained(axis, driven, way, values, ticks, j, places, after, end, exact)
            for i, place in enumerate(places):
                # Where one tick later is one tick better, the effect is only put off.
                beside = until[i - 1] if i else until[min(1, len(until) - 1)]
                # The longer the better, and the nearer to where it was logged.
                score = min(until[i], known), -abs(place - int(ticks[j]))
                if until[i] >= max(enough, beside + _SEEN) and score > best:
                    best, moved, to = score, j, place
        if moved >= 0:
            ticks[moved] = to
            after, failures = wrong + 1, 0
        else:
            after, failures = wrong + horizon, failures + 1


def _explained(
    axis: Axis,
    driven: tuple[FloatArray, FloatArray],
    way: FloatArray,
    values: FloatArray,
    ticks: Ticks,
    j: int,
    places: range,
    after: int,
    end: int,
    exact: float,
) -> list[int]:
    """Return until which tick the way is the measured one, with command j at each of its places.

    One looks from `after` to `end`. `driven` are travel and velocity as the commands are now.
    """
    # A command sets what the drive's state does not tell: what is wanted, and its age.
    begin = int(ticks[j - 1]) if j else 0
    first, last = (int(np.searchsorted(ticks, tick)) for tick in (begin, end))
    until = []
    for place in places:
        trial = ticks[first:last] - begin
        trial[j - first] = place - begin
        commands = by_tick(end - begin, trial, values[first:last])
        travels, _ = profile(axis, commands, driven[0][begin], driven[1][begin])
        until.append(begin + _first_wrong(travels, way[begin:end], max(0, after - begin), exact))
    return until


def _places(ticks: Ticks, j: int, far: int, count: int) -> range:
    """Where a command may be moved to, between those before and after it."""
    low = max(int(ticks[j - 1]) if j else 0, int(ticks[j]) - far)
    high = min(int(ticks[j + 1]) if j + 1 < len(ticks) else count - 1, int(ticks[j]) + far)
    return range(low, high + 1)


def _first_wrong(travels: FloatArray, way: FloatArray, after: int, exact: float) -> int:
    """Return the first tick from `after` on whose way is not the measured one; n: none."""
    wrong = np.abs(np.diff(travels) - way)[after:] > exact  # never where it is not known
    return after + int(np.argmax(wrong)) if wrong.any() else len(way)
