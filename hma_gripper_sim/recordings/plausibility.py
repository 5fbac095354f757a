"""Signals that no gripper gives, and what in the signal map is the likely cause."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from hma_gripper_sim.recordings.recording import Recording, Series
from hma_gripper_sim.recordings.signal_map import Signal, SignalMap

LARGEST_PHI, SMALLEST_PHI = 1.05 * math.pi, 0.1
"""Between these [rad] is the largest angle of deflection of any gripper."""

LARGEST_STROKE = 0.5
"""A gripper's way is less [m]."""

AT_REST = 1e-4
"""Way [m] that a gripper that stands still does not make."""

ON_TOP = 0.1
"""Share of the stroke from its top down to where a tare is taken to be free of load."""

_FEW, _SHORT = 50, 2e-3
"""Samples, and stroke [m], without which nothing is said about a stroke."""

_DOWN, _FREE = 0.9, 0.1
"""Shares of the stroke: where the way down ends, and up to where the gripper is free."""

_WRONG_SIGN, _NO_FORCE = 2.0, 0.05
"""How many times larger than upwards the force goes downwards if its sign is wrong, and [N] below
which neither counts."""

_APART = 6e-4
"""Way [m] between the onsets of force and φ from which on their clocks are in doubt.

Both begin to change at the touch, but not along the same course: of 48 simulated scenes (circles
and a box, 2 to 20 mm/s, friction 0 to 1.2) their onsets were up to 0.44 mm apart.
"""

_ONSET, _BINS, _CLEAR = 0.3, 500, 10.0
"""Share of the largest change up to which a signal shows its onset, averages that are taken of it
up to there at most, and how many times its scatter the change must be."""


def doubts(signals: Mapping[str, Series], entries: Sequence[Signal]) -> Iterator[str]:
    """Yield what is hard to believe of the signals of a log, with the likely cause.

    Parameters
    ----------
    signals
        By name.
    entries
        Of the signal map, which say what was tared.
    """
    for name in ("phi_left", "phi_right"):
        if name in signals:
            yield from _angle_doubts(name, signals[name])
    travel = signals.get("travel")
    if travel is None:
        return
    stroke = float(np.ptp(travel.value))
    if stroke > LARGEST_STROKE:
        yield (
            f"travel: ranges over {stroke:.3g} m: is its unit wrong, such as a missing 'unit: mm' "
            "in the signal map?"
        )
    if stroke < _SHORT or len(travel.value) < _FEW:
        return
    for entry in entries:
        if entry.tare and entry.name in signals:
            yield from _tare_doubts(entry, signals[entry.name], travel)
    if "actuator_force" in signals:
        yield from _sign_doubts(signals["actuator_force"], travel)
        yield from _clock_doubts(signals, travel)


def has_known_zero(recording: Recording, signal_map: SignalMap | None) -> bool:
    """Return whether the travel's zero is a place where the gripper stood, not a mean on its way.

    It is unknown if the gripper moved from each quarter of the time of its tare to the next: how
    far it had come before the log began, nothing tells.
    """
    entries = [e for e in signal_map.signals if e.name == "travel"] if signal_map else []
    if "travel" not in recording.signals or not entries:
        return True
    travel, tare = recording["travel"], min(entry.tare for entry in entries)
    ends = float(travel.time[0]) + tare * np.linspace(0.0, 1.0, 5)
    quarters = [travel.between(*pair).value for pair in pairwise(ends.tolist())]
    if not all(quarter.size for quarter in quarters):
        return True
    moves = np.diff([np.median(quarter) for quarter in quarters])
    return bool(np.abs(moves).min() <= AT_REST)


def _angle_doubts(name: str, phi: Series) -> Iterator[str]:
    largest = float(np.abs(phi.value).max())
    if largest > LARGEST_PHI:
        yield (
            f"{name}: reaches {math.degrees(largest):.4g}°, which no angle of deflection does: is "
            "'unit: deg' missing in the signal map?"
        )
    elif 0.0 < largest < SMALLEST_PHI:
        yield (
            f"{name}: never exceeds {math.degrees(largest):.2g}°: is it in radians, against the "
            "'unit' in the signal map?"
        )


def _tare_doubts(entry: Signal, tared: Series, travel: Series) -> Iterator[str]:
    """Yield whether the gripper moved, or touched, while a signal was taken to be zero."""
    begin = float(tared.time[0])
    during = travel.between(begin, begin + entry.tare).value
    if not during.size:
        return
    if np.ptp(during) > AT_REST + 0.01 * float(np.ptp(travel.value)):
        yield (
            f"{entry.name}: its tare was taken in motion: the travel changed by "
            f"{1e3 * float(np.ptp(during)):.3g} mm in these {entry.tare:g} s"
        )
    above = float(during.mean() - travel.value.min())
    if entry.name != "travel" and above > ON_TOP * float(np.ptp(travel.value)):
        yield (
            f"{entry.name}: its tare was taken {1e3 * above:.3g} mm below the top of the stroke: "
            "was the gripper under load?"
        )


def _sign_doubts(force: Series, travel: Series) -> Iterator[str]:
    """Yield whether the force goes the wrong way on the first way down."""
    top, stroke = float(travel.value.min()), float(np.ptp(travel.value))
    down = _on_the_way_down(force, travel)
    if down.value.size < _FEW:
        return
    at = np.interp(down.time, travel.time, travel.value)
    free = down.value[at <= top + _FREE * stroke]
    if not free.size:
        return
    zero = float(np.median(free))
    up, low = float(down.value.max()) - zero, zero - float(down.value.min())
    if low > max(_WRONG_SIGN * up, _NO_FORCE):
        yield (
            f"actuator_force: falls by {low:.3g} N on the way down and rises by {up:.3g} N at "
            "most: is its sign wrong ('scale: -1' in the signal map)?"
        )


def _on_the_way_down(series: Series, travel: Series) -> Series:
    """Return the part of a signal that was measured on the first way down."""
    top, stroke = float(travel.value.min()), float(np.ptp(travel.value))
    reached = int(np.argmax(travel.value >= top + _DOWN * stroke))
    return series.between(float(travel.time[0]), float(travel.time[reached]))


def _clock_doubts(signals: Mapping[str, Series], travel: Series) -> Iterator[str]:
    """Yield whether the force and the angles begin to change far apart on the first way down."""
    found = {
        name: onset(_on_the_way_down(signals[name], travel))
        for name in ("actuator_force", "phi_left", "phi_right")
        if name in signals
    }
    force = found.pop("actuator_force")
    angles = [at for at in found.values() if at is not None]
    if force is None or not angles:
        return
    phi = min(angles)  # an object beside the middle touches one side first
    way = float(np.diff(np.interp([force[0], phi[0]], travel.time, travel.value))[0])
    late = phi[0] - force[0]
    if abs(way) > _APART and abs(late) > force[1] + phi[1]:
        yield (
            f"actuator_force: begins to change {abs(late):.2g} s, or {1e3 * abs(way):.2g} mm of "
            f"the way, {'before' if late > 0.0 else 'after'} φ, where a touch changes both: are "
            "their clocks apart ('delay' in the signal map)?"
        )


def onset(series: Series) -> tuple[float, float] | None:
    """Return when a signal begins to change, and by how much its scatter leaves that open [s].

    It is the bend of the constant and the straight line from there on that meet the signal best, up
    to a share of its largest change. None: it does not change clearly.
    """
    if len(series.time) < _FEW:
        return None
    change = series.value - np.median(series.value[: len(series.value) // 10])
    largest = float(change[np.argmax(np.abs(change))])
    end = int(np.argmax(change * np.sign(largest) >= _ONSET * abs(largest))) + 1
    first = np.unique(np.linspace(0, end, min(end, _BINS), endpoint=False).astype(int))
    if len(first) < _FEW // 2:
        return None
    counts = np.diff(np.append(first, end))
    time = np.add.reduceat(series.time[:end], first) / counts
    value = np.add.reduceat(change[:end], first) / counts
    best = (math.inf, 0.0, 0.0)
    for bend in time[2:-2]:
        line = np.column_stack([np.ones_like(time), np.maximum(0.0, time - bend)])
        fitted, *_ = np.linalg.lstsq(line, value, rcond=None)
        scatter = float(np.sqrt(np.mean((value - line @ fitted) ** 2)))
        best = min(best, (scatter, float(bend), abs(float(fitted[1]))))
    scatter, bend, slope = best
    if slope == 0.0 or abs(largest) < _CLEAR * scatter:
        return None
    return bend, scatter / slope
