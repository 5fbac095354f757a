"""What the gripper is made to do in a replay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Segment
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.kernels.drive_profile import settle_commands
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.motion.prescribed_motion import of_ticks, through_points
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series
from hma_gripper_sim.replay.renewals import by_tick, profile, settle_renewals

FASTEST = 1.0
"""Largest velocity [m/s] that a measured travel may have: beyond it, it has jumped."""

RENEWAL = 0.1
"""Time [s] between two commands of the same velocity in a plan."""

_ARRIVED = 1e-9
"""How near [m] to a way point the gripper is at it."""

_SMOOTHED, _FEW = 4.0, 10
"""Standard deviations of a travel's noise that a tolerance has to be for few corners to be left,
and samples that it takes to tell them."""

_GAP = 2.0
"""Ticks without a sample of the travel that are a gap."""

_ON_TIME = 1e-3
"""Share of a tick by which the stamp of a sample at its end may differ from it."""

_EARLY = 1e-6
"""Share of a tick by which rounding may put a command before the tick that it was logged at."""

_SLACK = (2, 30)
"""Ticks that a log may be wrong by about when a command was taken: usually, and at most."""

_HORIZON = 10
"""Ticks after a change of the velocity by which its effect is recognised."""

_EXACT = 1e-10
"""Difference [m] of the ways made in one tick that is rounding."""

_NO_COMMANDS = Series(np.empty(0), np.empty(0))


@dataclass(frozen=True)
class Course:
    """A motion of the prismatic joint, and where it comes from.

    Parameters
    ----------
    basis
        What it follows, in words.
    start
        Stamp of its time 0 [ns].
    motion
        From time 0.
    commands
        The velocities that were sent [s, m/s]; none where it follows a measured travel.
    notes
        What the user should know about it.
    """

    basis: str
    start: int
    motion: Motion
    commands: Series = _NO_COMMANDS
    notes: tuple[str, ...] = ()

    @property
    def travel(self) -> float:
        """Where it starts [m]."""
        return float(self.motion.travel[0])

    @property
    def duration(self) -> float:
        """[s]"""
        return float(self.motion.time[-1])


def commanded(recording: Recording, limits: DriveLimits, period: float) -> Course:
    """Let the node's drive take the recorded commands again.

    The first tick ends one period after the first sample of the travel. A command is taken by
    the tick in whose time it was logged; one that was logged at the very end of a tick is taken
    by the next: it was logged by someone who had seen that tick's results. Where the travel was
    logged at every tick and shows, to rounding, that another one of the ticks around took it, that
    one does; likewise a drive that came into the log in motion goes on in motion.

    Parameters
    ----------
    recording
        With ``velocity_command``, and with ``travel`` if it is known where the gripper was.
    limits
        Of the drive.
    period
        Of its ticks [s].
    """
    commands = recording["velocity_command"]
    begin, end = float(commands.time[0]), float(commands.time[-1]) + limits.command_timeout
    travel = 0.0
    if "travel" in recording.signals:
        measured = recording["travel"]
        begin, end = float(measured.time[0]), float(measured.time[-1])
        travel = float(measured.value[0])
    count = math.floor((end - begin) / period + _EARLY)
    if count < 1:
        raise InputError(
            f"lasts {end - begin:g} s, less than one tick", field="travel", source=recording.source
        )
    widened = replace(
        limits,
        travel_min=min(limits.travel_min, travel),
        travel_max=max(limits.travel_max, travel),
    )
    notes = []
    if widened != limits:
        notes.append(
            f"the log starts at a travel of {travel * 1e3:.4g} mm, outside the drive's range "
            f"{limits.travel_min * 1e3:.4g} to {limits.travel_max * 1e3:.4g} mm, which was widened"
        )
    ticks = np.floor((commands.time - begin) / period + _EARLY).astype(np.int64)
    known = ticks < count
    ticks, values = np.maximum(ticks[known], 0), commands.value[known]
    way = _way_by_tick(recording, begin, period, count)
    logged = ticks.copy()
    velocity = _first_velocity(way, period)
    axis = widened.axis(period)
    settle_commands(axis, travel, velocity, way, values, *_SLACK, _HORIZON, _EXACT, ticks)
    settle_renewals(axis, (travel, velocity), way, values, _SLACK, _HORIZON, _EXACT, ticks)
    moved = int(np.count_nonzero(ticks != logged))
    if moved:
        most = int(np.abs(ticks - logged).max())
        notes.append(
            f"the measured travel shows that {moved} of {len(ticks)} commands were taken earlier "
            f"or later than they were logged, by up to {most} tick{'s' if most > 1 else ''}"
        )
    notes += _gaps(recording, period)
    motion = _driven(by_tick(count, ticks, values), widened, period, travel, velocity)
    sent = Series(period * ticks.astype(np.float64), values)
    start = recording.start + round(1e9 * begin)
    return Course("the commanded velocity", start, motion, sent, tuple(notes))


def measured(recording: Recording, tolerance: float) -> Course:
    """Follow the recorded travel within a tolerance [m], at constant velocities between samples.

    Raises
    ------
    InputError
        There are fewer than two samples, or the travel jumps.
    """
    travel = recording["travel"]
    distinct = np.append(np.diff(travel.time) > 0.0, True)  # a paused node repeats its stamp
    time, value = travel.time[distinct], travel.value[distinct]
    if len(time) < 2:
        raise InputError("a single sample is no motion", field="travel", source=recording.source)
    rates = np.diff(value) / np.diff(time)
    fastest = int(np.argmax(np.abs(rates)))
    if abs(rates[fastest]) > FASTEST:
        raise InputError(
            f"jumps by {(value[fastest + 1] - value[fastest]) * 1e3:.4g} mm at {time[fastest]:g} s "
            "of the log, as after a reset: replay the parts before and after it on their own",
            field="travel",
            source=recording.source,
        )
    motion = through_points(time - time[0], value, tolerance)
    start = recording.start + round(1e9 * float(time[0]))
    return Course("the measured travel", start, motion, notes=_scatter(value, tolerance))


def _scatter(travel: FloatArray, tolerance: float) -> tuple[str, ...]:
    """Say if the travel scatters by more than the tolerance keeps out of the motion."""
    # Of white noise of unit deviation the second difference has √6; the median is no outlier's.
    deviation = float(np.median(np.abs(np.diff(travel, 2)))) / (0.6745 * np.sqrt(6.0))
    if len(travel) < _FEW or 0.75 * _SMOOTHED * deviation <= tolerance:
        return ()
    return (
        f"the travel scatters by {deviation * 1e6:.2g} um, which the dampers turn into force: "
        f"--travel-tolerance {_SMOOTHED * deviation * 1e6:.2g}um keeps that out",
    )


def planned(segments: Sequence[Segment], limits: DriveLimits, period: float) -> Course:
    """Command the segments of a motion from the start pose, as the demo does over ROS.

    A segment that moves is commanded until its end has been reached, a hold for its time; at the
    end the drive is stopped.
    """
    taken: list[FloatArray] = []
    travel, velocity, target = 0.0, 0.0, 0.0
    renewal = max(1, round(RENEWAL / period))
    for segment in (*segments, Segment(0.0, limits.max_velocity / limits.max_acceleration)):
        target += segment.velocity * segment.duration
        sign = np.sign(segment.velocity)
        # Reaching it may take longer by the ramps of the drive.
        ramps = 2.0 * (abs(velocity) + abs(segment.velocity)) / limits.max_acceleration
        extra = math.ceil(ramps / period) + 2 if sign else 0
        commands = np.full(math.ceil(segment.duration / period - _EARLY) + extra, np.nan)
        commands[::renewal] = segment.velocity
        travels, velocities = profile(limits.axis(period), commands, travel, velocity)
        count = len(commands)
        if sign:
            reached = np.flatnonzero(sign * (travels[1:] - target) >= -_ARRIVED)
            count = int(reached[0]) + 1 if reached.size else count
        taken.append(commands[:count])
        travel, velocity = float(travels[count]), float(velocities[count])
    commands = np.concatenate(taken)
    sent = np.flatnonzero(~np.isnan(commands))
    return Course(
        "the experiment's motion",
        0,
        _driven(commands, limits, period, 0.0, 0.0),
        Series(period * sent.astype(np.float64), commands[sent]),
    )


def _driven(
    commands: FloatArray, limits: DriveLimits, period: float, travel: float, velocity: float
) -> Motion:
    travels, velocities = profile(limits.axis(period), commands, travel, velocity)
    return of_ticks(0.0, period, travels, velocities)


def _gaps(recording: Recording, period: float) -> list[str]:
    """Say where the travel was not logged for longer than between the other ticks."""
    if "travel" not in recording.signals:
        return []
    spacing = np.diff(recording["travel"].time)
    longest = int(np.argmax(spacing))
    if not np.median(spacing) < _GAP * period < spacing[longest]:
        return []
    return [
        f"the travel has gaps, the longest of {spacing[longest]:.4g} s at "
        f"{recording['travel'].time[longest]:.6g} s: if the node was paused there, its command has "
        "expired in the replay"
    ]


def _first_velocity(way: FloatArray, period: float) -> float:
    """Velocity at which a drive came into the log [m/s]: not 0 if it made the same way twice."""
    if len(way) < 2 or not abs(way[1] - way[0]) < _EXACT or abs(way[0]) < _EXACT:
        return 0.0
    return float(way[0] / period)


def _way_by_tick(recording: Recording, begin: float, period: float, count: int) -> FloatArray:
    """Way that the recorded gripper made in each tick [m]; NaN where it was not logged."""
    at = np.full(count + 1, np.nan)
    if "travel" in recording.signals:
        travel = recording["travel"]
        ticks = (travel.time - begin) / period
        rows = np.round(ticks).astype(np.int64)
        on_time = (np.abs(ticks - rows) < _ON_TIME) & (rows >= 0) & (rows <= count)
        at[rows[on_time]] = travel.value[on_time]
    return np.diff(at)
