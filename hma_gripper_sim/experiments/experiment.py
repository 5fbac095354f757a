"""Experiments as data: the scene, the motion, what was measured and what was published."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from hma_gripper_sim.model.contours.base import Contour
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.recordings.signal_map import SignalMap

if TYPE_CHECKING:
    from hma_gripper_sim.mechanics.scene import Scene


@dataclass(frozen=True)
class Segment:
    """A stretch of the prismatic motion: `velocity` [m/s] for `duration` [s]."""

    velocity: float
    duration: float


@dataclass(frozen=True)
class Measurement:
    """A figure that was measured at one instant.

    Parameters
    ----------
    figure
        Its name in `hma_gripper_sim.recordings.run_figures.FIGURES`.
    time
        When, from the start of the motion [s].
    value, uncertainty
        SI.
    """

    figure: str
    time: float
    value: float
    uncertainty: float


@dataclass(frozen=True)
class Criterion:
    """What a figure should be, and the bounds that it must keep.

    Parameters
    ----------
    figure
        Its name in `hma_gripper_sim.recordings.run_figures.FIGURES`.
    time
        From the start of the motion [s]: when, or up to when.
    expected
        The stated value [SI], or None where only a window is known.
    lower, upper
        Bounds [SI]; infinite where the figure is reported without being judged.
    source
        Where the expectation comes from.
    """

    figure: str
    time: float
    expected: float | None
    lower: float
    upper: float
    source: str


@dataclass(frozen=True)
class ExperimentLog:
    """What was recorded while an experiment was made.

    Parameters
    ----------
    path
        Of the log.
    signal_map
        Where its signals are; None: where this project's own node publishes them.
    uncertainties
        Standard uncertainty of a sample, by signal [SI], where it is known.
    """

    path: Path
    signal_map: SignalMap | None
    uncertainties: Mapping[str, float]

    @cached_property
    def recording(self) -> Recording:
        """Its signals, read when first asked for; raises `InputError` as `read_recording` does."""
        return read_recording(self.path, self.signal_map)


@dataclass(frozen=True)
class Experiment:
    """A recorded experiment: measured at instants, or with a log.

    Parameters
    ----------
    name
        The file's name without its ending.
    title, source
        What it is, and where it was published.
    contour_name, contour
        The object; its name is the one it is selected by.
    clearance
        Travel from the start pose to the first touch [m].
    friction
        Coefficient between gripper and object.
    contact
        Contact model, ``"continuous"`` or ``"sampled"``.
    design
        The gripper.
    design_file
        Path of the file that describes it; None: it is the thesis'.
    motion
        Of the prismatic joint, from the start pose; the first segment is the approach. Empty where
        only the log says how the gripper moved.
    measurements
        What was measured on the real gripper.
    measured, published
        What a simulation of the experiment is compared with: the measurements, and figures that
        others published.
    log
        What was recorded; None: nothing but the instants.
    """

    name: str
    title: str
    source: str
    contour_name: str
    contour: Contour
    clearance: float
    friction: float
    contact: str
    design: GripperDesign
    design_file: str | None
    motion: tuple[Segment, ...]
    measurements: tuple[Measurement, ...]
    measured: tuple[Criterion, ...]
    published: tuple[Criterion, ...]
    log: ExperimentLog | None

    @property
    def approach(self) -> float:
        """How long the gripper moves towards the object [s]."""
        return self.motion[0].duration

    @property
    def way_points(self) -> tuple[tuple[float, float], ...]:
        """Time [s] and travel [m] at the start of the motion and after each segment."""
        points = [(0.0, 0.0)]
        for segment in self.motion:
            time, travel = points[-1]
            points.append((time + segment.duration, travel + segment.velocity * segment.duration))
        return tuple(points)

    def scene(self, design: GripperDesign | None = None) -> Scene:
        """Return the scene in which a gripper, by default its own, meets the object."""
        from hma_gripper_sim.mechanics.scene import Scene  # the solver: a comparison needs none

        return Scene(
            design or self.design,
            self.contour,
            friction=self.friction,
            clearance=self.clearance,
            contact=self.contact,
        )
