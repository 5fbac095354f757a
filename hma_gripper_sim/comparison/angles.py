"""The angles of deflection at one instant, as in Table 5.3 of the thesis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.recordings.run_figures import FIGURES, Run


@dataclass(frozen=True)
class AngleComparison:
    """A row of Table 5.3 [s, rad].

    Attributes
    ----------
    title
        Of the experiment.
    time
        From the start of its motion.
    simulated
        Mean of the simulated left and right angle.
    left, right
        Measured.
    uncertainty
        Of a reading; the larger of both sides'.
    """

    title: str
    time: float
    simulated: float
    left: float
    right: float
    uncertainty: float

    @property
    def average(self) -> float:
        """Of the measured angles [rad]."""
        return 0.5 * (self.left + self.right)

    @property
    def relative_error(self) -> float:
        """Magnitude of the difference from the average, relative to it; NaN where that is 0."""
        return abs(self.simulated - self.average) / (self.average or math.nan)

    @property
    def spread(self) -> float:
        """How far the measured angles are from their average [rad]."""
        return 0.5 * abs(self.left - self.right)

    @property
    def verdict(self) -> str:
        """Whether the simulated angle is between the measured ones, or within the uncertainty."""
        error = abs(self.simulated - self.average)
        if error <= self.spread:
            return "inside"
        return "within reading" if error <= self.spread + self.uncertainty else "outside"

    def cells(self) -> tuple[str, ...]:
        """Return its values as text, as `ANGLE_HEADINGS` names them."""
        angles = (self.simulated, self.left, self.right, self.average)
        return (
            self.title,
            f"{self.time:g} s",
            *(f"{math.degrees(angle):.1f}°" for angle in angles),
            f"{self.relative_error:.1%}",
            f"±{math.degrees(self.spread):.1f}° {self.verdict}",
        )


ANGLE_HEADINGS = ("object", "at", "simulated", "left", "right", "average", "error", "spread")


def compare_angles(run: Run, experiment: Experiment) -> Iterator[AngleComparison]:
    """Yield a row for every instant at which both angles were measured."""
    for time in dict.fromkeys(measurement.time for measurement in experiment.measurements):
        at = {m.figure: m for m in experiment.measurements if m.time == time}
        if "phi_left" in at and "phi_right" in at:
            left, right = at["phi_left"], at["phi_right"]
            yield AngleComparison(
                experiment.title,
                time,
                FIGURES["phi_mean"].evaluate(run, time),
                left.value,
                right.value,
                max(left.uncertainty, right.uncertainty),
            )
