"""Is the error that is asked for the error that is got? Scenes of a population are judged.

What a tolerance bounds is the RMS error over a run, at samples every millisecond: of the actuator
force relative to its largest in the run, and of both angles of deflection to a radian; the larger
of the two counts. An accuracy bounds the same, to the continuum instead of to the exact motion of
the model.

The reference is the same scene at a tolerance that is at least 30 times tighter. Some scenes are
sensitive: moving the object by a picometre changes the reference by a tenth of what was asked or
more. Nothing can foretell these better than to within their sensitivity, and 10 times that is
never counted as an error.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from hma_gripper_benchmarks.population import POPULATIONS, Population
from hma_gripper_benchmarks.worker import Worker, WorkerError, spread
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.motion.prescribed_motion import Velocity
from hma_gripper_sim.simulation.simulation import simulate

Array = NDArray[np.float64]
Marks = NDArray[np.bool_]

WORKERS = 2  # processes at a time
LIMIT = 30.0  # s of wall time for one run; what takes longer has ended early
PICOMETRE = 1e-12  # m; far less than an atom
TIGHTER = 30.0  # times, at least, for a reference
TIGHTEST = 100.0  # times, where that converges
CONTINUUM_TOLERANCE = 1e-6  # of the reference for an accuracy
ALLOWED = 10.0  # sensitivities that are no error
SENSITIVE = 0.1  # of what was asked; a sensitivity beyond it makes a scene sensitive
NOISE = 0.5  # of what was asked; by so much a picometre must not change a calm scene's run
GROSS, CALM = 0.3, 0.01  # an error of the force beyond the one in a scene less sensitive than that
# An event of the reference is a bend of its force over two samples that is so many times the
# median of those within so many samples, and as large as this share of the largest force.
SHARP, AROUND, SMALLEST_BEND = 10.0, 25, 1e-4
EVENT = 2  # samples (2 ms) on either side of an event in which an error may just be its timing


@dataclass(frozen=True)
class Job:
    """One simulation of a drawn scene.

    Parameters
    ----------
    population, seed
        What is simulated.
    error
        Tolerance or accuracy; of a reference, its tolerance.
    reference
        Whether it is one.
    moved
        Whether the object is a picometre further away.
    """

    population: str
    seed: int
    error: float
    reference: bool = False
    moved: bool = False


@dataclass(frozen=True)
class Run:
    """What a simulation gave.

    Parameters
    ----------
    failure
        Why it did not reach its end; then there is nothing else.
    force
        Of the actuator at the samples [N], shape (n_samples,).
    phi
        Angles of deflection, left and right [rad], shape (2, n_samples).
    energy_residual
        What is missing in the balance of energy, relative to its largest term.
    cpu_time
        Without what the motion's own function takes [s].
    """

    failure: str | None
    force: Array
    phi: Array
    energy_residual: float = math.nan
    cpu_time: float = math.nan


@dataclass(frozen=True)
class Judgement:
    """One scene at one asked error.

    Parameters
    ----------
    seed
        Of the scene.
    asked
        Tolerance or accuracy.
    failure
        Why the run ended early, or None.
    cpu_time
        Of the run [s]; None if it ended early.
    energy_residual
        Relative; None if it ended early.
    error
        To the reference; None, as all that follow, where the run or its reference is missing.
    force_error
        Of the force alone, RMS.
    largest_error
        Of the force at any sample but those within 2 ms of an event.
    sensitivity
        RMS change of the reference's force when the object is moved by a picometre.
    noise
        RMS change of the run's own force when the object is moved so.
    """

    seed: int
    asked: float
    failure: str | None
    cpu_time: float | None = None
    energy_residual: float | None = None
    error: float | None = None
    force_error: float = math.nan
    largest_error: float = math.nan
    sensitivity: float = math.nan
    noise: float = math.nan

    @property
    def is_judged(self) -> bool:
        """Whether there are a result and a reference."""
        return self.error is not None

    @property
    def ratio(self) -> float:
        """Error relative to what was asked."""
        return math.nan if self.error is None else self.error / self.asked

    @property
    def is_sensitive(self) -> bool:
        """Whether a picometre matters to the exact motion."""
        return self.sensitivity > SENSITIVE * self.asked

    @property
    def is_noisy(self) -> bool:
        """Whether a picometre matters to the run alone."""
        return not self.is_sensitive and not self.noise <= NOISE * self.asked

    @property
    def is_gross(self) -> bool:
        """Whether the force is wrong altogether."""
        return self.force_error > GROSS and self.sensitivity <= CALM

    def is_within(self, times: float) -> bool:
        """Whether the error is at most so many times what was asked."""
        return self.is_judged and (self.error or 0.0) <= max(
            times * self.asked, ALLOWED * self.sensitivity
        )


@dataclass(frozen=True)
class Level:
    """A population at one asked error."""

    asked: float
    judgements: Sequence[Judgement]

    @property
    def judged(self) -> list[Judgement]:
        """Those with a result and a reference."""
        return [one for one in self.judgements if one.is_judged]

    @property
    def calm(self) -> list[Judgement]:
        """Those of them that are not sensitive."""
        return [one for one in self.judged if not one.is_sensitive]

    @property
    def ended_early(self) -> int:
        """Runs that did not reach their end."""
        return sum(one.failure is not None for one in self.judgements)

    @property
    def without_reference(self) -> int:
        """Results that nothing can be said about."""
        return sum(one.failure is None and not one.is_judged for one in self.judgements)

    @property
    def sensitive(self) -> int:
        """Scenes to which a picometre matters."""
        return len(self.judged) - len(self.calm)

    @property
    def noisy(self) -> int:
        """Runs to which a picometre matters although the exact motion does not care."""
        return sum(one.is_noisy for one in self.judged)

    @property
    def gross(self) -> int:
        """Results that are wrong altogether."""
        return sum(one.is_gross for one in self.judged)

    def within(self, times: float) -> float:
        """Share of the judged runs whose error is at most so many times what was asked."""
        return _share(one.is_within(times) for one in self.judged)

    @property
    def median_ratio(self) -> float:
        """Of the errors of scenes that are not sensitive, relative to what was asked."""
        return _quantile([one.ratio for one in self.calm], 0.5)

    @property
    def worst(self) -> Judgement | None:
        """The largest error of a scene that is not sensitive."""
        return max(self.calm, key=lambda one: one.ratio, default=None)

    @property
    def largest_ratio(self) -> float:
        """Largest error of any sample outside of events, of scenes that are not sensitive."""
        return max((one.largest_error / self.asked for one in self.calm), default=math.nan)

    def energy_kept(self, bound: float) -> float:
        """Share of scenes that are not sensitive whose balance of energy is closed to a bound."""
        return _share((one.energy_residual or 0.0) <= bound for one in self.calm)

    def cpu_time(self, share: float) -> float:
        """Quantile of the CPU time of one run [s]."""
        spent = [one.cpu_time for one in self.judgements if one.cpu_time is not None]
        return _quantile(spent, share)


@dataclass(frozen=True)
class PopulationResult:
    """A population at all errors that were asked for."""

    key: str
    title: str
    levels: list[Level]

    def find(self, asked: float) -> Level | None:
        """The level of an asked error."""
        return next((level for level in self.levels if level.asked == asked), None)

    def work(self, error: float) -> Array:
        """CPU time that each scene takes to a true error [s], ascending; infinite: never got.

        Interpolated in logarithms between runs that are not sensitive, of which those that are
        slower and less accurate than another one do not count.
        """
        seeds = {one.seed for level in self.levels for one in level.calm}
        found = []
        for seed in seeds:
            points = [
                (max(one.error or 0.0, 1e-15), one.cpu_time or 0.0)
                for level in self.levels
                for one in level.calm
                if one.seed == seed
            ]
            found.append(time_at(error, points))
        return np.sort(found)


def time_at(error: float, points: Sequence[tuple[float, float]]) -> float:
    """CPU time that an error takes [s], interpolated in logarithms between (error, time).

    Infinite where none of the runs was that accurate; at larger errors than any run's, the
    time of the fastest.
    """
    best: list[tuple[float, float]] = []  # errors descending, times ascending
    for wrong, spent in sorted(points):
        if not best or spent < best[-1][1]:
            best.append((wrong, spent))
    best.reverse()
    errors, times = (np.log([point[i] for point in best]) for i in (0, 1))
    wanted = math.log(error)
    if wanted < errors[-1]:
        return math.inf
    return float(np.exp(np.interp(-wanted, -errors, times)))


def measure(
    population: Population,
    count: int,
    asked: Sequence[float],
    tick: Callable[[], None],
) -> PopulationResult:
    """Judge the scenes of the first `count` seeds at all errors that are asked for.

    Not after `use_one_core`: the workers would share that core.
    """
    perform(Job(population.key, 0, max(asked)))  # compiles, which no worker has the time for

    def work(worker: Worker[Job, Run], seed: int) -> list[Judgement]:
        return judge(population, seed, asked, lambda job: _attempt(worker, job))

    rows = []
    for judgements in spread(work, range(count), perform, LIMIT, WORKERS):
        rows.append(judgements)
        tick()
    rows.sort(key=lambda judgements: judgements[0].seed)
    levels = [
        Level(error, list(column))
        for error, column in zip(asked, zip(*rows, strict=True), strict=True)
    ]
    return PopulationResult(population.key, population.title, levels)


def _attempt(worker: Worker[Job, Run], job: Job) -> Run:
    try:
        return worker.call(job)
    except WorkerError as error:
        return _failed(str(error))


def _failed(reason: str) -> Run:
    return Run(reason, np.empty(0), np.empty((2, 0)))


class Clocked:
    """A motion's function that knows how long its calls took."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self._function = function
        self.spent = 0.0  # s

    def __call__(self, t: float) -> float:
        """Call it."""
        start = process_time()
        value = self._function(t)
        self.spent += process_time() - start
        return value


def perform(job: Job) -> Run:
    """Simulate what a job says."""
    drawn = POPULATIONS[job.population].draw(job.seed)
    scene, tolerance = (drawn.converged, job.error) if job.reference else drawn.asking(job.error)
    if job.moved:
        scene = replace(scene, clearance=scene.clearance + PICOMETRE)
    velocity: Velocity = drawn.velocity
    clocked = None
    if callable(velocity) and not isinstance(velocity, PPoly):
        velocity = clocked = Clocked(velocity)
    with warnings.catch_warnings():
        # Parts that the contact model leaves out touch in some scenes; the solver is the subject.
        warnings.simplefilter("ignore")
        try:
            simulate(scene, 0.0, 1e-3, 1e-2)  # builds what a scene builds once
            start = process_time()
            trace = simulate(scene, velocity, drawn.duration, tolerance)
            force = trace.actuator_force
            spent = process_time() - start - (clocked.spent if clocked else 0.0)
        except SimulationError as error:
            return _failed(error.outcome.name)
        if not trace.stats.converged:
            return _failed(trace.stats.outcome.name)
        phi = np.stack([trace.phi_left, trace.phi_right])
        return Run(None, force, phi, abs(trace.energy.relative_residual), spent)


def judge(
    population: Population, seed: int, asked: Sequence[float], run: Callable[[Job], Run]
) -> list[Judgement]:
    """Judge one scene at all errors that are asked for."""
    job = Job(population.key, seed, math.nan)
    continuum = population.draw(seed).by_accuracy
    tolerances = [CONTINUUM_TOLERANCE] if continuum else list(_reference_tolerances(asked))
    reference, moved, tight = _failed("none"), _failed("none"), math.inf
    for tolerance in tolerances:
        best = replace(job, error=tolerance, reference=True)
        reference = run(best)
        if reference.failure is None:
            moved, tight = run(replace(best, moved=True)), tolerance
            break
    found = []
    for error in asked:
        close = continuum or tight <= error / TIGHTER
        known = close and reference.failure is None and moved.failure is None
        plain = replace(job, error=error)
        result = run(plain)
        if result.failure is not None or not known:
            found.append(unjudged(seed, error, result))
            continue
        again = run(replace(plain, moved=True))
        found.append(compare(seed, error, result, again, reference, moved))
    return found


def _reference_tolerances(asked: Sequence[float]) -> Iterator[float]:
    """Try first what serves all asked errors, then what serves but the coarser ones."""
    yield min(asked) / TIGHTEST
    for error in sorted(asked):
        yield error / TIGHTER


def unjudged(seed: int, asked: float, result: Run) -> Judgement:
    """What can be said of a run that failed, or that has no reference."""
    if result.failure is not None:
        return Judgement(seed, asked, result.failure)
    return Judgement(seed, asked, None, result.cpu_time, result.energy_residual)


def compare(
    seed: int, asked: float, result: Run, again: Run, reference: Run, moved: Run
) -> Judgement:
    """Judge a run by its reference, and both by their repetitions with the object moved."""
    scale = float(np.abs(reference.force).max())
    difference = (result.force - reference.force) / scale
    force_error = _rms(difference)
    return Judgement(
        seed,
        asked,
        None,
        result.cpu_time,
        result.energy_residual,
        max(force_error, _rms(result.phi - reference.phi)),
        force_error,
        float(np.abs(difference[~near_events(reference.force)]).max(initial=0.0)),
        _rms(moved.force - reference.force) / scale,
        math.inf if again.failure else _rms(again.force - result.force) / scale,
    )


def near_events(force: Array) -> Marks:
    """Samples within 2 ms of a jump of the force or of its slope, shape (n_samples,)."""
    near = np.zeros(len(force), dtype=np.bool_)
    if len(force) < 3:
        return near
    bend = np.abs(np.diff(force, 2))
    window = np.lib.stride_tricks.sliding_window_view(
        np.pad(bend, AROUND, mode="reflect" if len(bend) > AROUND else "edge"), 2 * AROUND + 1
    )
    usual = np.median(window, axis=1)
    events = (bend > SHARP * usual) & (bend > SMALLEST_BEND * np.abs(force).max())
    for row in np.flatnonzero(events) + 1:
        near[max(0, row - EVENT - 1) : row + EVENT + 2] = True
    return near


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _share(marks: Iterator[bool]) -> float:
    found = list(marks)
    return sum(found) / len(found) if found else math.nan


def _quantile(values: Sequence[float], share: float) -> float:
    return float(np.quantile(values, share)) if len(values) else math.nan
