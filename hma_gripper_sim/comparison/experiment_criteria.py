"""Comparing a recorded run with an experiment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Criterion, Experiment
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.recordings.run_figures import FIGURES, Run

MAX_TRAVEL_ERROR = 1e-4
"""How far [m] the travel may stray from the experiment's motion during the approach.

A tenth of a millimetre changes φ at the thesis' lowest position by 0.05°.
"""

MAX_GAP = 0.01
"""Longest time between two samples of a signal, as a share of the approach's duration."""

_RAMP, _BRAKE = 0.1, 0.01
"""Shares of the approach's depth that are left to the drive's ramps at its two ends."""


@dataclass(frozen=True)
class Comparison:
    """A figure of a run beside what it should be.

    Parameters
    ----------
    criterion
        What it should be, and within which bounds.
    value
        What it is [SI].
    """

    criterion: Criterion
    value: float

    @property
    def relative_error(self) -> float | None:
        """As in Table 5.3, relative to what is expected; None where that is nothing or 0."""
        expected = self.criterion.expected
        return abs(self.value - expected) / abs(expected) if expected else None

    @property
    def judged(self) -> bool:
        """Whether a bound is stated at all."""
        return bool(np.isfinite(self.criterion.lower) or np.isfinite(self.criterion.upper))

    @property
    def inside(self) -> bool:
        """Whether the value keeps its bounds (NaN never does)."""
        return self.criterion.lower <= self.value <= self.criterion.upper


def align(recording: Recording, experiment: Experiment, design: GripperDesign) -> Run:
    """Match a recording's time with an experiment's by the travel of the approach.

    Time 0 is put where the recorded travel best follows the first segment of the experiment's
    motion. So the experiment's instants are found by how far the gripper has come, whatever the
    delay, the acceleration ramp and the moment of reversal were in the recording.

    Raises
    ------
    InputError
        The recorded travel does not cover the approach.
    """
    approach = experiment.motion[0]
    depth = approach.velocity * approach.duration
    travel = recording["travel"]
    reached = np.flatnonzero(travel.value >= depth * (1.0 - _BRAKE))
    down = slice(0, int(reached[0]) if reached.size else 0)
    time, value = travel.time[down], travel.value[down]
    steady = value > _RAMP * depth
    if travel.value[0] > _RAMP * depth or not steady.any():
        raise InputError(
            f"the approach goes from 0 to {depth * 1e3:g} mm, the recorded travel "
            f"from {travel.value[0] * 1e3:.4g} to {travel.value.max() * 1e3:.4g} mm "
            f"with {np.count_nonzero(steady)} samples on the way down",
            field="travel",
            source=recording.source,
        )
    delay = time[steady] - value[steady] / approach.velocity
    offset = float(delay.mean())
    travel_error = float(np.abs(delay - offset).max() * approach.velocity)
    return Run(recording.delayed(offset), design, travel_error)


def compare(run: Run, experiment: Experiment) -> tuple[Comparison, ...]:
    """Evaluate every criterion of an experiment on a run, and whether it is a run of it at all."""
    end = experiment.approach
    valid = (
        Criterion("travel_error", end, None, 0.0, MAX_TRAVEL_ERROR, "this run"),
        Criterion("longest_gap", end, None, 0.0, MAX_GAP * end, "this run"),
    )
    return tuple(
        Comparison(criterion, FIGURES[criterion.figure].evaluate(run, criterion.time))
        for criterion in (*experiment.measured, *experiment.published, *valid)
    )
