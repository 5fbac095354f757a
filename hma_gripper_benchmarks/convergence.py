"""What each modelling choice costs: time steps, GBEs, contour, friction law, damping."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
from numpy.typing import NDArray

from hma_gripper_benchmarks.cantilever import ELASTICA
from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD, SPEED, Task
from hma_gripper_benchmarks.series import Deviation, Series, deviation, from_trace
from hma_gripper_benchmarks.this_package import REFERENCE_PERIOD
from hma_gripper_sim.analysis import cantilever_deflection
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.motion.prescribed_motion import Velocity
from hma_gripper_sim.simulation.simulation import simulate
from hma_gripper_sim.simulation.trace import Trace

Array = NDArray[np.float64]

TIGHT = 1e-5
CONTINUUM = (40, 200)  # GBEs per half that stand for the continuum
FIRST_ORDER, SECOND_ORDER, HIGH_ORDER = "thesis", "midpoint", "gauss"


@dataclass(frozen=True)
class StudyRow:
    """One model or setting against the reference of its study.

    Parameters
    ----------
    label
        What was varied, and its value.
    size
        By which convergence is measured: steps or GBEs per half.
    force_rms
        Relative to the largest force.
    phi_max
        [degree]
    peak
        Largest force [N].
    final
        Last force [N].
    cpu_time
        Of one run [s].
    """

    label: str
    size: int
    force_rms: float
    phi_max: float
    peak: float
    final: float
    cpu_time: float


@dataclass(frozen=True)
class Study:
    """One choice, its rows and the order at which the errors fall (None: not a convergence)."""

    title: str
    text: str
    rows: list[StudyRow]
    order: float | None = None


def studies(tasks: dict[str, Task], full: bool, tick: Callable[[], None]) -> list[Study]:
    """All studies."""
    return [
        _time_steps(_swing(tasks["cylinder_continuous"]), "Free swing, no contact", full, tick),
        _time_steps(
            tasks["cylinder_continuous"], "Cylinder, continuous contour, with contact", full, tick
        ),
        *cantilever_studies(full, tick),
        *_gripper(tasks["cylinder_continuous"], full, tick),
        _contours(tasks, tick),
        _friction(tasks["hold"], full, tick),
    ]


def order(sizes: list[float], errors: list[float]) -> float:
    """Slope at which errors fall with the size, by least squares in logarithms."""
    slope, _ = np.polyfit(np.log(sizes), np.log(errors), 1)
    return -float(slope)


def _run(task: Task, scene: Scene, tolerance: float, period: float) -> tuple[Trace, float]:
    start = process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        trace = simulate(scene, task.velocity, task.duration, tolerance, period)
    _ = trace.actuator_force
    return trace, process_time() - start


def _row(label: str, size: int, trace: Trace, spent: float, reference: Series) -> StudyRow:
    series = from_trace(trace)
    found: Deviation = deviation(series, reference)
    return StudyRow(
        label,
        size,
        found.force_rms,
        found.phi_max,
        float(series.force.max()),
        float(series.force[-1]),
        spent,
    )


def _reference(task: Task, scene: Scene, tolerance: float) -> Series:
    return from_trace(_run(task, scene, tolerance, REFERENCE_PERIOD)[0])


class _Swing(Task):
    """Accelerated evenly in free air, far above the object: smooth but for the start."""

    @property
    def velocity(self) -> Velocity:
        return lambda t: 20.0 * t


def _swing(task: Task) -> Task:
    return _Swing("swing", "Free swing", replace(task.scene, clearance=100.0), ((1.0, 0.0),))


def _time_steps(task: Task, text: str, full: bool, tick: Callable[[], None]) -> Study:
    scene = replace(task.scene, symmetry=None)
    reference = _reference(task, scene, 1e-8 if full else 1e-7)
    tick()
    rows = []
    for exponent in (2, 3, 4, 5, 6) if full else (2, 3, 4):
        trace, spent = _run(task, scene, 10.0**-exponent, SAMPLE_PERIOD)
        label = f"tolerance 1e-{exponent}"
        rows.append(_row(label, trace.stats.steps, trace, spent, reference))
        tick()
    return Study(
        f"Order in time, {text[0].lower()}{text[1:]}",
        "The order is that of the error over the accepted steps.",
        rows,
        order([row.size for row in rows], [row.force_rms for row in rows]),
    )


def cantilever_studies(full: bool, tick: Callable[[], None]) -> list[Study]:
    """Deflection of the thesis' cantilever with ever more GBEs."""
    found = []
    many = (10, 20, 50, 100, 200, 500) if full else (10, 20, 50)
    for kind, counts in (
        (FIRST_ORDER, many),
        (SECOND_ORDER, many),
        (HIGH_ORDER, (3, 4, 6, 8, 12, 16) if full else (3, 4, 6)),
    ):
        rows = []
        for n in counts:
            start = process_time()
            deflection = cantilever_deflection(n, kind)
            spent = process_time() - start
            error = abs(deflection / ELASTICA - 1.0)
            rows.append(StudyRow(f"{n} GBEs", n, error, math.nan, math.nan, math.nan, spent))
            tick()
        found.append(
            Study(
                f"Order in GBEs, cantilever, {kind}",
                "Relative error of the tip's deflection to the elastica.",
                rows,
                order([row.size for row in rows], [row.force_rms for row in rows]),
            )
        )
    return found


def _gripper(task: Task, full: bool, tick: Callable[[], None]) -> list[Study]:
    """All discretisations against a fine midpoint model, with both laws of damping."""
    scene = replace(task.scene, symmetry=None)
    design = scene.design
    top, beam = CONTINUUM if full else (10, 50)
    fine = replace(scene, discretisation=SECOND_ORDER, elements_top=top, elements_beam=beam)
    tolerance = 1e-6 if full else TIGHT
    reference = _reference(task, fine, tolerance)
    tick()
    many = ((1, 3), (2, 8), (5, 25), (10, 50), (20, 100)) if full else ((1, 3), (2, 8), (5, 25))
    found = []
    for kind, counts, scaled, title in (
        (HIGH_ORDER, ((1, 2), (2, 3), (2, 4), (3, 6)), True, "gauss, Kelvin-Voigt damping"),
        (SECOND_ORDER, many, True, "midpoint, Kelvin-Voigt damping"),
        (FIRST_ORDER, many, True, "thesis, Kelvin-Voigt damping"),
        (FIRST_ORDER, many, False, "thesis, the same damping at every joint"),
    ):
        rows = []
        for top, beam in counts:
            used = design
            if scaled and kind == FIRST_ORDER:
                factor = beam / design.beam_elements
                used = replace(design, joint_damping=factor * design.joint_damping)
            model = replace(
                scene, design=used, discretisation=kind, elements_top=top, elements_beam=beam
            )
            trace, spent = _run(task, model, tolerance, SAMPLE_PERIOD)
            rows.append(_row(f"{top} + {beam} GBEs", top + beam, trace, spent, reference))
            tick()
        found.append(
            Study(
                f"Order in GBEs, gripper, {title}",
                f"Cylinder, continuous contour, against midpoint with {CONTINUUM[0]} + "
                f"{CONTINUUM[1]} GBEs per half."
                if full
                else "Cylinder, continuous contour, against midpoint with 10 + 50 GBEs per half.",
                rows,
                order([row.size for row in rows], [row.force_rms for row in rows]),
            )
        )
    return found


def _contours(tasks: dict[str, Task], tick: Callable[[], None]) -> Study:
    rows = []
    for name in ("cylinder", "box"):
        task = tasks[f"{name}_continuous"]
        smooth = replace(task.scene, symmetry=None)
        reference = _reference(task, smooth, TIGHT)
        for contact in ("continuous", "sampled"):
            scene = replace(smooth, contact=contact)
            trace, spent = _run(task, scene, 1e-3, SAMPLE_PERIOD)
            rows.append(_row(f"{name}, {contact}", 0, trace, spent, reference))
            tick()
    return Study(
        "Sampled against continuous contour",
        "Thesis discretisation; differences to the continuous contour: the price of 14 points.",
        rows,
    )


def _friction(task: Task, full: bool, tick: Callable[[], None]) -> Study:
    scene = replace(task.scene, symmetry=None)
    reference = _reference(task, scene, 1e-8 if full else 1e-6)
    tick()
    rows = []
    for slip_velocity in (0.0, 1e-9, 1e-6, 1e-5, 1e-4, 1e-3):
        trace, spent = _run(task, replace(scene, slip_velocity=slip_velocity), 1e-3, SAMPLE_PERIOD)
        label = f"{slip_velocity:.0e} m/s" if slip_velocity else "set-valued"
        rows.append(_row(label, 0, trace, spent, reference))
        tick()
    return Study(
        "Regularised against set-valued friction",
        f"Pressed at {1e3 * SPEED:g} mm/s for 2 s, then held for 5 s; the last force shows the "
        "creep.",
        rows,
    )
