"""The motion of a drive that is given velocities, from tick to tick."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.braking import limited_velocity
from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


class Axis(NamedTuple):
    """What a drive may do.

    Attributes
    ----------
    max_velocity, change
        Largest velocity, and its largest change in one tick [m/s].
    travel_min, travel_max
        [m]
    timeout
        Ticks after which a command that is not renewed expires; 0: never.
    period
        Of a tick [s].
    """

    max_velocity: float
    change: float
    travel_min: float
    travel_max: float
    timeout: int
    period: float


class Moving(NamedTuple):
    """State of a drive between two ticks: travel [m], velocity and command [m/s], its age."""

    travel: float
    velocity: float
    wanted: float
    age: int


@kernel
def clamped(axis: Axis, velocity: float) -> float:
    """Return the nearest velocity that the drive may have [m/s]."""
    return min(max(velocity, -axis.max_velocity), axis.max_velocity)


@kernel
def is_expired(axis: Axis, age: int) -> bool:
    """Whether a command that has been in force for so many ticks is too old."""
    return axis.timeout > 0 and age >= axis.timeout


@kernel
def next_velocity(axis: Axis, wanted: float, travel: float, velocity: float) -> tuple[float, bool]:
    """Velocity at the end of the coming tick [m/s], and whether a travel limit holds it back."""
    ahead, behind = axis.travel_max - travel, travel - axis.travel_min
    return limited_velocity(wanted, velocity, ahead, behind, axis.change, axis.period)


@kernel
def tick(axis: Axis, state: Moving, command: float) -> Moving:
    """Let one tick pass; `command` is what came before it, NaN if nothing did [m/s]."""
    wanted, age = state.wanted, state.age
    if not math.isnan(command):
        wanted, age = clamped(axis, command), 0
    if is_expired(axis, age):
        wanted = 0.0
    velocity, _ = next_velocity(axis, wanted, state.travel, state.velocity)
    travel = state.travel + 0.5 * (state.velocity + velocity) * axis.period
    return Moving(travel, velocity, wanted, age + 1)


@kernel
def drive_profile(axis: Axis, commands: Array, travel: Array, velocity: Array) -> None:
    """Move as `hma_gripper_sim.device.drive.Drive` does when it is commanded velocities only.

    Parameters
    ----------
    commands
        Velocity that came before each tick, NaN where none did [m/s], shape (n,).
    travel, velocity
        At the ends of the ticks [m, m/s], shape (n + 1,); row 0 is the start, the others are
        filled in. At the start the velocity is that which was commanded.
    """
    state = Moving(travel[0], velocity[0], velocity[0], 0)
    for k in range(commands.size):
        state = tick(axis, state, commands[k])
        travel[k + 1], velocity[k + 1] = state.travel, state.velocity


@kernel
def _tick_that_took(
    axis: Axis,
    state: Moving,
    at: int,
    applied: int,
    j: int,
    first: int,
    end: int,
    window: int,
    measured: Array,
    values: Array,
    exact: float,
    taken: NDArray[np.int64],
) -> int:
    """Find the tick from `first` on from which command `j` explains the motion until `end`.

    `state` is that before tick `at`, when `applied` commands have been taken; -1: none does.
    """
    best, found = exact, -1
    for candidate in range(first, min(end - 1, taken[j] + window + 1)):
        trial, pending, worst = state, applied, 0.0
        for k in range(at, end):
            command = np.nan
            while pending < j and taken[pending] <= k:
                command = values[pending]
                pending += 1
            if k == candidate:
                pending, command = j + 1, values[j]
            while j < pending < values.size and taken[pending] <= k:  # it is renewed
                command = values[pending]
                pending += 1
            before = trial.travel
            trial = tick(axis, trial, command)
            if k < first:
                continue
            if math.isnan(measured[k]):
                worst = np.inf
                break
            worst = max(worst, abs(trial.travel - before - measured[k]))
            if worst > exact:
                break
        nearer = found < 0 or abs(candidate - taken[j]) < abs(found - taken[j])
        if worst <= exact and (worst < 0.5 * best or nearer):
            best, found = worst, candidate
    return found


@kernel
def settle_commands(
    axis: Axis,
    travel: float,
    velocity: float,
    measured: Array,
    values: Array,
    near: int,
    far: int,
    horizon: int,
    exact: float,
    taken: NDArray[np.int64],
) -> int:
    """Find by which tick each command was taken, where the measured travel shows it.

    A log says when a command was seen by whoever wrote it. The drive may have taken it a tick
    earlier or later; many, if one of them was held up. A command that changes the velocity is
    moved to where the drive's motion is the measured one until `horizon` ticks later: by up to
    `near` ticks, or else by up to `far` ticks. If it is so nowhere, it stays where it is.

    Parameters
    ----------
    travel, velocity
        Before the first tick [m, m/s].
    measured
        Way that was made in each tick, NaN where it is not known [m], shape (n,).
    values
        Of the commands [m/s], shape (m,).
    exact
        Largest difference of the ways [m] that is rounding.
    taken
        Tick that takes each command, never decreasing, below n; changed in place, shape (m,).

    Returns
    -------
    int
        How many were moved.
    """
    count, moved = measured.size, 0
    state, at, applied = Moving(travel, velocity, velocity, 0), 0, 0
    for j in range(values.size):
        if j > 0:
            taken[j] = max(taken[j], taken[j - 1])
            if values[j] == values[j - 1]:
                continue
        found = -1
        for window in (near, far):
            first = max(taken[j] - window, taken[j - 1] if j > 0 else 0)
            if window == near:
                earliest = max(taken[j] - far, taken[j - 1] if j > 0 else 0)
                while at < earliest:  # under the commands before this one
                    command = np.nan
                    while applied < j and taken[applied] <= at:
                        command = values[applied]
                        applied += 1
                    state = tick(axis, state, command)
                    at += 1
            end = min(count, taken[j] + window + horizon)
            for later in range(j + 1, values.size):
                if values[later] != values[later - 1]:
                    end = min(end, taken[later] - window)
                    break
                if taken[later] >= end:
                    break
            found = _tick_that_took(
                axis, state, at, applied, j, first, end, window, measured, values, exact, taken
            )
            if found >= 0:
                break
        if found >= 0 and found != taken[j]:
            taken[j] = found
            moved += 1
    return moved
