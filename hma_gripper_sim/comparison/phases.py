"""Approach, enveloping, hold and lift: what the gripper is doing, by its travel and force."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.recordings.recording import FloatArray, Series

PHASES = ("approach", "enveloping", "hold", "lift")

APPROACH, ENVELOPING, HOLD, LIFT, NONE = 0, 1, 2, 3, -1

DEFINITION = (
    "Touch: the travel at which, on the first way down, the force leaves its free value (of the "
    "first tenth of the stroke) by more than 5 % of its range and 5 times its free scatter. "
    "Approach: moving down, above touch. Enveloping: moving down, below touch. Hold: at rest "
    "below touch. Lift: moving up. Moving: faster than 10 % of the largest speed, over 0.1 s."
)

WITHOUT_FORCE = " There is no force to find the touch by: all of the way down is approach."

_WINDOW = 0.1
_MOVING = 0.1
_TOUCHED, _SCATTER = 0.05, 5.0
_FREE, _DOWN = 0.1, 0.9
"""Shares of the stroke: up to where it is taken to be free of contact, and where the way ends."""

_SPACING = 0.01


@dataclass(frozen=True)
class Phases:
    """What the gripper was doing, over time.

    Attributes
    ----------
    time
        [s], shape (n,)
    phase
        Index into `PHASES`, -1 for none of them, shape (n,).
    touch
        Travel of the first touch [m]; None where there is no force to tell it by.
    """

    time: FloatArray
    phase: npt.NDArray[np.int8]
    touch: float | None

    @property
    def definition(self) -> str:
        """In words."""
        return DEFINITION if self.touch is not None else DEFINITION + WITHOUT_FORCE

    def at(self, time: FloatArray) -> npt.NDArray[np.int8]:
        """Return the phase at each time [s]."""
        i = np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1)
        nearer = time - self.time[i - 1] < self.time[i] - time
        return self.phase[np.where(nearer, i - 1, i)]

    def spans(self) -> list[tuple[int, float, float]]:
        """Return phase, start and end [s] of each stretch of one phase, in order."""
        starts = np.flatnonzero(np.diff(self.phase, prepend=-2))
        ends = np.append(starts[1:], len(self.phase) - 1)
        return [
            (int(self.phase[a]), float(self.time[a]), float(self.time[b]))
            for a, b in zip(starts, ends, strict=True)
        ]


def find_phases(travel: Series, force: Series | None) -> Phases:
    """Tell the phases of a recording (`DEFINITION`).

    Parameters
    ----------
    travel
        [m]
    force
        The actuator's [N], on the same clock; None if it is not known.
    """
    count = max(2, int((travel.time[-1] - travel.time[0]) / _SPACING) + 1)
    time = np.linspace(travel.time[0], travel.time[-1], count)
    position = np.interp(time, travel.time, travel.value)
    half = 0.5 * _WINDOW
    later, earlier = (
        np.interp(np.clip(time + side, time[0], time[-1]), time, position) for side in (half, -half)
    )
    elapsed = np.clip(time + half, None, time[-1]) - np.clip(time - half, time[0], None)
    rate = (later - earlier) / elapsed
    threshold = _MOVING * float(np.abs(rate).max())
    down, up = rate > threshold, rate < -threshold
    touch = None if force is None else _touch(time, position, force)
    phase = np.full(count, NONE, dtype=np.int8)
    below = position >= (np.inf if touch is None else touch)
    phase[down] = APPROACH
    phase[down & below] = ENVELOPING
    phase[~down & ~up & below] = HOLD
    phase[up] = LIFT
    return Phases(time, phase, touch)


def _touch(time: FloatArray, position: FloatArray, force: Series) -> float | None:
    """Travel at which the force first leaves its free value; None if it never does."""
    above, deepest = float(position[0]), float(position.max())
    down = position[: 1 + int(np.argmax(position >= above + _DOWN * (deepest - above)))]
    value = np.interp(time[: len(down)], force.time, force.value)
    free = value[down <= above + _FREE * (deepest - above)]
    level, scatter = float(np.median(free)), float(np.std(free))
    threshold = max(_TOUCHED * float(np.ptp(force.value)), _SCATTER * scatter)
    left = np.abs(value - level) > threshold
    return float(down[int(np.argmax(left))]) if left.any() else None
