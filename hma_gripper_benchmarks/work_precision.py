"""Time against error: this package and the installed peers on the same tasks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from hma_gripper_benchmarks import peers, this_package
from hma_gripper_benchmarks.convergence import CONTINUUM
from hma_gripper_benchmarks.measuring import Candidate, interleaved
from hma_gripper_benchmarks.scenes import Task
from hma_gripper_benchmarks.series import Deviation, Series, deviation

LARGEST_ERROR = 0.05  # RMS of the force; beyond it a run is wrong and its speed no figure
AGREEMENT = 5e-3  # to which two references of a task must agree
TOLERANCES = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6)
QUICK_TOLERANCES = (1e-2, 1e-3, 1e-4)
QUICK_TASKS = ("cylinder_sampled", "box_sampled", "cylinder_continuous", "hold")
ACCURACIES = (0.03, 0.01, 0.003)
REDUCED_TOLERANCES = (3e-2, 1e-2, 3e-3, 1e-3)


@dataclass(frozen=True)
class WorkRow:
    """One solver with one setting on one task.

    Parameters
    ----------
    solver, setting
        For people.
    cpu_time
        Median [s]; None when the result was too wrong to be timed.
    error
        To the reference; None when there was no result.
    failure
        Why there is no time.
    """

    solver: str
    setting: str
    cpu_time: float | None
    error: Deviation | None
    failure: str | None = None


@dataclass(frozen=True)
class TaskResult:
    """All solvers on one task.

    Parameters
    ----------
    key, title
        Of the task.
    duration
        Simulated [s].
    reference
        What the errors are measured against.
    agreement
        RMS difference of the force to scipy's independent reference, relative to its largest;
        None: not computed.
    rows
        One for each setting of each solver.
    """

    key: str
    title: str
    duration: float
    reference: str
    agreement: float | None
    rows: list[WorkRow]

    def fastest(self, solver: str, error: float) -> WorkRow | None:
        """Fastest row of a solver with at most this RMS error of the force."""
        rows = [
            row
            for row in self.rows
            if row.solver == solver
            and row.cpu_time is not None
            and row.error is not None
            and row.error.force_rms <= error
        ]
        return min(rows, key=lambda row: row.cpu_time or 0.0, default=None)

    def find(self, solver: str, setting: str) -> WorkRow | None:
        """Row of a setting that was timed."""
        for row in self.rows:
            if row.solver == solver and row.setting == setting and row.cpu_time is not None:
                return row
        return None


def measure(
    tasks: dict[str, Task], full: bool, rounds: int, tick: Callable[[str], None]
) -> list[TaskResult]:
    """Run every task with every solver."""
    return [
        _measure_task(task, full, rounds, tick)
        for key, task in tasks.items()
        if full or key in QUICK_TASKS
    ]


def measure_reduced(task: Task, full: bool, rounds: int, tick: Callable[[str], None]) -> TaskResult:
    """Scenes that choose their model by an accuracy, against the converged continuum."""
    top, beam = CONTINUUM
    plain = replace(task.scene, symmetry=None, slip_velocity=0.0)
    fine = replace(plain, discretisation="midpoint", elements_top=top, elements_beam=beam)
    tolerance = 1e-6 if full else 1e-5
    tick(f"{task.title}: reference of the continuum")
    continuum = this_package.reference_of(task, fine, tolerance)
    found = []
    for accuracy in ACCURACIES:
        scene = replace(
            plain, accuracy=accuracy, discretisation=None, elements_top=None, elements_beam=None
        )
        for step_tolerance in REDUCED_TOLERANCES if full else REDUCED_TOLERANCES[1:2]:
            named = this_package.candidate(task, scene, step_tolerance, this_package.REDUCED)
            found.append(replace(named, setting=f"accuracy {100 * accuracy:g} %, {named.setting}"))
    rows = timed_rows([(candidate, continuum) for candidate in found], rounds, tick)
    return TaskResult(
        f"{task.key}_reduced",
        f"{task.title.partition(',')[0]}, reduced by accuracy",
        task.duration,
        f"midpoint, {top} + {beam} GBEs per half, tolerance {tolerance:.0e}",
        None,
        rows,
    )


def _measure_task(task: Task, full: bool, rounds: int, tick: Callable[[str], None]) -> TaskResult:
    tick(f"{task.title}: reference")
    reference = this_package.reference(task, full)
    tolerance = this_package.REFERENCE_TOLERANCE if full else this_package.QUICK_REFERENCE_TOLERANCE
    text = f"this package, tolerance {tolerance:.0e}"
    agreement, for_peers = None, reference
    if full or task.key == "cylinder_sampled":
        certified = _scipy_reference(task, full)
        agreement = deviation(certified, reference).force_rms
        if agreement > AGREEMENT:
            raise RuntimeError(
                f"{task.title}: the reference is {100 * agreement:.2g} % off scipy's"
            )
        if task.scene.contact == "continuous":
            # Where faces meet flat, this package finds the centre of pressure; the peers
            # know a single point of contact, and are judged by what they try to solve.
            for_peers = certified
            text += ", for peers scipy's Radau (contact in a point)"
    pairs = [
        (candidate, reference)
        for candidate in this_package.candidates(task, TOLERANCES if full else QUICK_TOLERANCES)
    ]
    for name in peers.PEERS:
        if peers.installed_version(name) is not None:
            pairs += [
                (candidate, for_peers) for candidate in peers.load(name).candidates(task, full)
            ]
    return TaskResult(
        task.key,
        task.title,
        task.duration,
        text,
        agreement,
        timed_rows(pairs, rounds, lambda _: tick(task.title)),
    )


def _scipy_reference(task: Task, full: bool) -> Series:
    from hma_gripper_benchmarks.peers import scipy_gripper

    tolerance = 1e-7 if full else 1e-5
    candidate = scipy_gripper.candidate(task, "Radau", tolerance, this_package.REFERENCE_PERIOD)
    return candidate.series(candidate.run())


def timed_rows(
    pairs: list[tuple[Candidate, Series]], rounds: int, tick: Callable[[str], None]
) -> list[WorkRow]:
    """Check every candidate against its reference, then time those that passed."""
    rows: list[WorkRow] = []
    timed: list[int] = []
    runs: list[Callable[[], Any]] = []
    for candidate, reference in pairs:
        tick(candidate.solver)
        row = _check(candidate, reference)
        if row.failure is None:
            timed.append(len(rows))
            runs.append(candidate.run)
        rows.append(row)
    for index, spent in zip(timed, interleaved(runs, rounds, lambda: tick("timing")), strict=True):
        rows[index] = replace(rows[index], cpu_time=spent)
    return rows


def _check(candidate: Candidate, reference: Series) -> WorkRow:
    try:
        series = candidate.series(candidate.run())
    except RuntimeError as error:
        return WorkRow(candidate.solver, candidate.setting, None, None, str(error))
    found = deviation(series, reference)
    failure = None
    if not found.force_rms <= LARGEST_ERROR:
        failure = f"{100 * found.force_rms:.3g} % RMS off"
    return WorkRow(candidate.solver, candidate.setting, None, found, failure)
