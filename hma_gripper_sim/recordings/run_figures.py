"""The figures of a run that the thesis and experiments state."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.recordings.recording import Recording


@dataclass(frozen=True)
class Run:
    """A recorded motion of a gripper, matched in time with an experiment.

    Parameters
    ----------
    recording
        Its signals; time 0 is the start of the experiment's motion.
    design
        The gripper, whose section turns moments into stresses.
    travel_error
        Largest difference [m] from the experiment's travel during the approach.
    """

    recording: Recording
    design: GripperDesign
    travel_error: float


@dataclass(frozen=True)
class Figure:
    """A number that is read off a run.

    Parameters
    ----------
    label
        What it is called in tables.
    unit
        SI, in pint's notation.
    shown_unit, shown_per_si, decimals
        The unit it is printed in, how many of them make one SI unit, and how precisely.
    evaluate
        Its value [SI] in a run, at or up to a time [s].
    timed
        Whether it is a value at that time; if not, it sums up the motion until then.
    """

    label: str
    unit: str
    shown_unit: str
    shown_per_si: float
    decimals: int
    evaluate: Callable[[Run, float], float]
    timed: bool = False

    def shown(self, value: float) -> str:
        """Return `value` [SI] as text with the unit it is printed in."""
        return f"{value * self.shown_per_si:.{self.decimals}f} {self.shown_unit}"


def _highest(run: Run, signal: str, until: float) -> tuple[float, float]:
    """Return when [s] and how high [SI] a signal peaks until then; NaN without samples."""
    series = run.recording[signal].between(0.0, until)
    if not series.value.size:
        return math.nan, math.nan
    highest = int(np.argmax(series.value))
    return float(series.time[highest]), float(series.value[highest])


def _peak_force(run: Run, until: float) -> float:
    return _highest(run, "actuator_force", until)[1]


def _peak_force_time(run: Run, until: float) -> float:
    return _highest(run, "actuator_force", until)[0]


def _largest_moment(run: Run, until: float) -> float:
    return _highest(run, "bending_moment", until)[1]


def _largest_stress(run: Run, until: float) -> float:
    return run.design.bending_stress(_largest_moment(run, until))


def _longest_gap(run: Run, until: float) -> float:
    """Return the longest time [s] without a sample of some signal; commands come as they like."""
    signals = run.recording.signals.items()
    times = (s.between(0.0, until).time for name, s in signals if name != "velocity_command")
    return max(float(np.diff(time, prepend=0.0, append=until).max()) for time in times)


def _force(run: Run, time: float) -> float:
    return run.recording["actuator_force"].at(time)


def _angle(label: str, *signals: str) -> Figure:
    def mean(run: Run, time: float) -> float:
        return sum(run.recording[signal].at(time) for signal in signals) / len(signals)

    return Figure(label, "rad", "°", math.degrees(1.0), 2, mean, timed=True)


FIGURES: Mapping[str, Figure] = {
    "phi_left": _angle("φ left", "phi_left"),
    "phi_right": _angle("φ right", "phi_right"),
    "phi_mean": _angle("φ mean", "phi_left", "phi_right"),
    "actuator_force": Figure("F_act", "N", "N", 1.0, 3, _force, timed=True),
    "peak_actuator_force": Figure("F_act peak", "N", "N", 1.0, 3, _peak_force),
    "peak_actuator_force_time": Figure("F_act peak time", "s", "s", 1.0, 2, _peak_force_time),
    "max_bending_moment": Figure("M max", "N*m", "mN m", 1e3, 3, _largest_moment),
    "max_stress": Figure("σ max", "Pa", "MPa", 1e-6, 3, _largest_stress),
    "longest_gap": Figure("longest gap", "s", "s", 1.0, 2, _longest_gap),
    "travel_error": Figure("travel error", "m", "mm", 1e3, 3, lambda run, _: run.travel_error),
}
"""By the name that experiment files use."""
