"""The error of a run, estimated from runs of the same motion that should give the same.

``verify=True`` repeats a run three times beside it (`Companions`):

tighter
    At a tolerance smaller by `TIGHTER`.  The error of a second-order method is proportional to
    its tolerance, so that the difference is all of the run's error but 1 / `TIGHTER` of it.
moved
    At the run's own tolerance, with the object a picometre elsewhere.  Where that alone
    changes the result by more than was asked, the scene is sensitive: no tolerance helps.
refined
    At the run's own tolerance with a finer ``gauss`` discretisation: the error of the model.
    Its start pose is its own, so only a run from the start pose is repeated with it.

Together with the run itself they take less than six times its CPU time: the tighter run
sqrt(`TIGHTER`) times as many steps, the other two about one run each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.integrator import COARSEST, Motion
from hma_gripper_sim.outcome import SimulationError
from hma_gripper_sim.scene import Scene

if TYPE_CHECKING:
    from hma_gripper_sim.simulation import Simulation
    from hma_gripper_sim.trace import Trace

Array = NDArray[np.float64]

TIGHTER = 4.0
"""By how much the tolerance of the tighter run is smaller: twice the steps, a quarter of the error.

A larger one leaves less of the error out but takes more of the six runs' time.
"""

ALL_OF_IT = TIGHTER / (TIGHTER - 1.0)
"""The run's error relative to its difference from the tighter run, of which a part is missing."""

MOVE = (1e-12, 1e-12)
"""Displacement (x, z) of the object in the moved run [m], outwards in the frame of each half.

Mirror images move to opposite sides, so that a symmetric scene stays one.
"""

REFINED = (3, 6)
"""GBEs of half the top beam and of a side beam in the refined model, if the run's has no more.

In ``gauss`` they are within 1e-4 of the converged force unless the beams come close to buckling.
"""

MORE = (1, 2)
"""GBEs that the refined model of a ``gauss`` scene has more, at least."""


@dataclass(frozen=True)
class ErrorEstimate:
    """How far a run is from the exact solution of its equations, and these from the continuum.

    Errors of the force are relative to its largest magnitude in the run; RMS and maximum are over
    the samples, angles of both sides together.

    Parameters
    ----------
    force_rms, force_max
        Of the actuator force by the time stepping; None: the tighter run gave nothing.
    phi_rms, phi_max
        Of the angles of deflection by the time stepping [rad]; None: likewise.
    sensitive_from
        When the run with the object a picometre elsewhere parts from its twin by more than was
        asked [s]; from there on errors are chance.  None: it does not.
    model_force_rms, model_phi_rms
        Of the discretisation, against a finer one [-, rad].  Not smaller than the time stepping's
        errors can be told.  None: the run did not start at the start pose, or the finer model
        gave nothing.
    failures
        What of the companion runs ended early, and what that leaves unsaid.
    force, phi
        The estimated errors at the samples [N, rad], as far as the tighter run came:
        shapes (k,) and (k, 2), right and left.
    """

    force_rms: float | None
    force_max: float | None
    phi_rms: float | None
    phi_max: float | None
    sensitive_from: float | None
    model_force_rms: float | None
    model_phi_rms: float | None
    failures: tuple[str, ...]
    force: Array = field(repr=False, compare=False)
    phi: Array = field(repr=False, compare=False)

    def __str__(self) -> str:
        parts = []
        if self.force_rms is None:
            parts.append("unknown")
        if self.force_rms is not None and self.force_max is not None:
            parts.append(
                f"force {100.0 * self.force_rms:.2g} % RMS, {100.0 * self.force_max:.2g} % at most"
            )
        if self.phi_rms is not None and self.phi_max is not None:
            rms, most = math.degrees(self.phi_rms), math.degrees(self.phi_max)
            parts.append(f"phi {rms:.2g}° RMS, {most:.2g}° at most")
        if self.model_force_rms is not None and self.model_phi_rms is not None:
            angle = math.degrees(self.model_phi_rms)
            parts.append(f"model {100.0 * self.model_force_rms:.2g} % of the force, {angle:.2g}°")
        if self.sensitive_from is not None:
            parts.append(f"sensitive to a picometre from t = {self.sensitive_from:.4g} s")
        return "; ".join(parts)


class Samples(NamedTuple):
    """What of a run is compared: time [s], force [N], shapes (k,), and both angles, (k, 2)."""

    time: Array
    force: Array
    phi: Array


class Companions:
    """The runs beside a simulation that show its error, at any time at the same instant.

    Parameters
    ----------
    simulation
        Where it stands now, they start; it is not touched.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._tolerance = min(simulation.tolerance, COARSEST)
        self._failures: dict[str, str] = {}
        self._runs: dict[str, Simulation] = {
            "tighter": simulation.twin(tolerance=self._tolerance / TIGHTER),
            "moved": simulation.twin(move=MOVE),
        }
        if simulation.at_start:
            try:
                self._runs["refined"] = simulation.twin(scene=refined_scene(simulation.scene))
            except SimulationError as error:
                self._failures["refined"] = str(error)
        self._plain: list[Samples] = []
        self._samples: dict[str, list[Samples]] = {name: [] for name in self._runs}

    def advance_along(self, motion: Motion, trace: Trace, kept: slice = slice(None)) -> None:
        """Follow a stretch of the motion, of which `trace` is the run's own result.

        Parameters
        ----------
        kept
            Samples of the trace that are new.
        """
        self._plain.append(_samples(trace, kept))
        for name, run in self._runs.items():
            if name in self._failures:
                continue
            result = run.solve_along(motion, trace.sample_period)
            self._samples[name].append(_samples(result, kept))
            if not result.stats.converged:
                end = float(result.time[-1])
                self._failures[name] = str(SimulationError(result.stats.outcome, end))

    def estimate(self) -> ErrorEstimate:
        """Return what the runs so far show."""
        runs = {name: _joined(parts) for name, parts in self._samples.items() if parts}
        failures = tuple(
            f"the {name} run ended early: {why}" for name, why in self._failures.items()
        )
        return estimate_error(
            _joined(self._plain),
            runs.get("tighter"),
            runs.get("moved"),
            runs.get("refined"),
            self._tolerance,
            failures,
        )


def refined_scene(scene: Scene) -> Scene:
    """Return the scene with a finer ``gauss`` model."""
    has = scene.resolution
    counts = REFINED
    if has.discretisation == "gauss":
        counts = (
            max(REFINED[0], has.elements_top + MORE[0]),
            max(REFINED[1], has.elements_beam + MORE[1]),
        )
    return scene.rediscretised("gauss", *counts)


def estimate_error(
    plain: Samples,
    tighter: Samples | None,
    moved: Samples | None,
    refined: Samples | None,
    tolerance: float,
    failures: tuple[str, ...] = (),
) -> ErrorEstimate:
    """Estimate the errors of a run from its companions, as far as each of them came.

    Parameters
    ----------
    tolerance
        What was asked of the run.
    """
    largest = float(np.abs(plain.force).max()) or 1.0
    force, phi = np.zeros(0), np.zeros((0, 2))
    if tighter is not None:
        force, phi = (ALL_OF_IT * part for part in _differences(plain, tighter))
    model_force, model_phi = np.zeros(0), np.zeros((0, 2))
    if refined is not None:
        model_force, model_phi = _differences(plain if tighter is None else tighter, refined)
    return ErrorEstimate(
        force_rms=_rms(force / largest),
        force_max=_max(force / largest),
        phi_rms=_rms(phi),
        phi_max=_max(phi),
        sensitive_from=(
            None if moved is None else _parting(plain, moved, tolerance * largest, tolerance)
        ),
        model_force_rms=_rms(model_force / largest),
        model_phi_rms=_rms(model_phi),
        failures=failures,
        force=force,
        phi=phi,
    )


def _parting(plain: Samples, moved: Samples, force: float, angle: float) -> float | None:
    """When two runs part by more than a force [N] or an angle [rad]; None if not in the RMS."""
    by_force, by_phi = _differences(plain, moved)
    if (_rms(by_force) or 0.0) <= force and (_rms(by_phi) or 0.0) <= angle:
        return None
    apart = (np.abs(by_force) > force) | (np.abs(by_phi).max(axis=1) > angle)
    return float(plain.time[np.argmax(apart)])


def _differences(a: Samples, b: Samples) -> tuple[Array, Array]:
    """Of force and angles, as long as both runs are."""
    count = min(len(a.time), len(b.time))
    return a.force[:count] - b.force[:count], a.phi[:count] - b.phi[:count]


def _rms(values: Array) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def _max(values: Array) -> float | None:
    return float(np.abs(values).max()) if len(values) else None


def _samples(trace: Trace, kept: slice) -> Samples:
    angles = np.column_stack([trace.phi_right, trace.phi_left])
    return Samples(trace.time[kept], trace.actuator_force[kept], angles[kept])


def _joined(parts: list[Samples]) -> Samples:
    return Samples(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
