"""One simulated log compared with an experiment or with another log: the result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hma_gripper_sim.bags.log_metadata import logged_parameters, read_remarks
from hma_gripper_sim.comparison.alignment import align_recordings, estimated_delay
from hma_gripper_sim.comparison.angles import AngleComparison, compare_angles
from hma_gripper_sim.comparison.bounds import Bound, Verdict
from hma_gripper_sim.comparison.coverage import ENOUGH
from hma_gripper_sim.comparison.experiment_criteria import Comparison, align, compare
from hma_gripper_sim.comparison.phases import Phases, find_phases
from hma_gripper_sim.comparison.provenance import Facts, simulation_facts
from hma_gripper_sim.comparison.signal_errors import QUANTITIES, SignalErrors, signal_errors
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.experiments.experiment_file import is_experiment, read_experiment
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.recordings.run_figures import Run
from hma_gripper_sim.recordings.signal_map import SignalMap

_LEAST_DELAY, _BETTER = 0.02, 0.8
"""A delay of a signal [s] that is worth a note, and the share of its RMSE that is then left."""

_RELATIVE_TO_0 = (
    "the measured signal is 0 throughout (a dead or tared sensor?), so that no error is relative "
    "to it: give the bound a unit, such as 5mN"
)


@dataclass(frozen=True)
class LogComparison:
    """How far a simulated log is from an experiment.

    Attributes
    ----------
    title, simulated, experiment
        What is compared, in words, and the paths of both.
    alignment
        How their times were matched, in words.
    run, stated
        The simulated log on the time of an experiment, and that experiment, where it states
        something at instants; otherwise None.
    angles
        Rows of Table 5.3; empty where no angles were measured at instants.
    criteria
        What the experiment states, beside what was found.
    signals
        Errors over time; empty where the experiment has no log.
    phases
        Of the experiment's log; None without one.
    verdicts
        On the asked bounds.
    notes
        What was recovered or left out.
    simulation
        What was simulated.
    signal_map
        The file that said where the experiment's signals are; empty: as the node publishes them,
        or as the experiment says.
    """

    title: str
    simulated: str
    experiment: str
    alignment: str
    run: Run | None = None
    stated: Experiment | None = None
    angles: tuple[AngleComparison, ...] = ()
    criteria: tuple[Comparison, ...] = ()
    signals: tuple[SignalErrors, ...] = ()
    phases: Phases | None = None
    verdicts: tuple[Verdict, ...] = ()
    notes: tuple[str, ...] = ()
    simulation: Facts = ()
    signal_map: str = ""

    @property
    def passed(self) -> bool:
        """Whether the experiment's own bounds and the asked ones are kept."""
        return all(c.inside for c in self.criteria) and all(v.inside for v in self.verdicts)


def compare_files(
    simulated: Path,
    experiment: Path,
    *,
    simulated_map: Path | None = None,
    signal_map: Path | None = None,
    method: str = "auto",
    instants: Sequence[float] = (),
    bounds: Sequence[Bound] = (),
    least_coverage: float = ENOUGH,
) -> LogComparison:
    """Compare a log of ours with an experiment file, the name of a shipped one, or a log.

    Parameters
    ----------
    simulated_map, signal_map
        Files that say where the signals of the one and the other log are; None: where the node
        publishes them.
    method, instants, bounds, least_coverage
        See `compare_recordings`.

    Raises
    ------
    InputError
        Something given cannot be used; see there as well.
    """
    recording = read_recording(simulated, _entries(simulated_map))
    recording = replace(recording, notes=(*read_remarks(simulated), *recording.notes))
    facts = simulation_facts(logged_parameters(simulated))
    if is_experiment(experiment):
        if signal_map is not None:
            raise InputError("an experiment file names its own", field="--signals")
        result = compare_experiment(
            recording,
            read_experiment(experiment),
            str(experiment),
            method=method,
            instants=instants,
            bounds=bounds,
            least_coverage=least_coverage,
        )
        return replace(result, simulation=facts)
    result = compare_recordings(
        recording,
        read_recording(experiment, _entries(signal_map)),
        title=f"{simulated.name} compared with {experiment.name}",
        method=method,
        instants=instants,
        bounds=bounds,
        least_coverage=least_coverage,
    )
    return replace(result, simulation=facts, signal_map=str(signal_map or ""))


def _entries(signal_map: Path | None) -> SignalMap | None:
    return None if signal_map is None else SignalMap.from_yaml(signal_map)


def compare_experiment(
    simulated: Recording,
    experiment: Experiment,
    path: str,
    *,
    method: str = "auto",
    instants: Sequence[float] = (),
    bounds: Sequence[Bound] = (),
    least_coverage: float = ENOUGH,
) -> LogComparison:
    """Compare a recording with all that an experiment has: its log, and what it has at instants."""
    if not (experiment.measured or experiment.published or experiment.log):
        raise InputError("states nothing to compare with: it is only planned", source=path)
    if experiment.log is None:
        if instants:
            raise InputError("has no log: only its own instants are known", source=path)
        return compare_instants(simulated, experiment, path, bounds)
    result = compare_recordings(
        simulated,
        experiment.log.recording,
        title=experiment.title,
        method=method,
        instants=instants,
        bounds=bounds,
        least_coverage=least_coverage,
    )
    if not (experiment.measured or experiment.published):
        return result
    stated = compare_instants(simulated, experiment, path)
    return replace(
        result,
        run=stated.run,
        stated=stated.stated,
        angles=stated.angles,
        criteria=stated.criteria,
    )


def compare_recordings(
    simulated: Recording,
    experiment: Recording,
    *,
    title: str,
    method: str = "auto",
    instants: Sequence[float] = (),
    bounds: Sequence[Bound] = (),
    least_coverage: float = ENOUGH,
) -> LogComparison:
    """Compare two logs.

    Parameters
    ----------
    method
        See `align_recordings`.
    instants
        Times of the experiment's log to report as well [s].
    bounds
        To judge by.
    least_coverage
        Share of a measured signal that has to be covered for a bound on it to be kept.

    Raises
    ------
    InputError
        The logs cannot be aligned, have no signal in common, or lack one that a bound is on.
    """
    moved, alignment = align_recordings(simulated, experiment, method)
    phases = None
    if "travel" in experiment.signals and np.ptp(experiment["travel"].time) > 0.0:
        phases = find_phases(experiment["travel"], experiment.signals.get("actuator_force"))
    signals = tuple(signal_errors(moved, experiment, phases, instants))
    if not signals:
        raise InputError(
            f"has no signal at a time at which {experiment.source} has it as well",
            source=simulated.source,
        )
    return LogComparison(
        title,
        simulated.source,
        experiment.source,
        alignment.description,
        signals=signals,
        phases=phases,
        verdicts=tuple(
            _judge_signal(bound, signals, experiment.source, least_coverage) for bound in bounds
        ),
        notes=(*_notes(simulated, experiment, signals), *_delays(moved, experiment)),
    )


def _delays(simulated: Recording, experiment: Recording) -> Iterator[str]:
    """Yield which measured signals would be met better if they were taken to be late."""
    for name in ("actuator_force", "phi_left", "phi_right"):
        if name not in simulated.signals or name not in experiment.signals:
            continue
        found = estimated_delay(simulated[name], experiment[name])
        if found is None or abs(found[0]) < _LEAST_DELAY or found[1] > _BETTER:
            continue
        delay, left = found
        yield (
            f"{QUANTITIES[name].label}: would be met better, with {100.0 * left:.2g} % of its "
            f"RMSE, if it came {abs(delay):.2g} s {'late' if delay > 0.0 else 'early'} in the "
            f"experiment's log: are its clocks apart ('delay: {delay:.2g} s' in the signal map)?"
        )


def compare_instants(
    simulated: Recording, experiment: Experiment, path: str, bounds: Sequence[Bound] = ()
) -> LogComparison:
    """Compare a log with what an experiment measured at instants.

    Raises
    ------
    InputError
        The log does not cover the experiment's approach, or a bound is on what was not measured.
    """
    run = align(simulated, experiment, experiment.design)
    offset = (run.recording.start - simulated.start) * 1e-9
    criteria = compare(run, experiment)
    return LogComparison(
        experiment.title,
        simulated.source,
        path,
        "aligned by the travel of the approach: the experiment's motion starts at "
        f"{offset:.6g} s of the simulated log",
        run=run,
        stated=experiment,
        angles=tuple(compare_angles(run, experiment)),
        criteria=criteria,
        verdicts=tuple(_judge_criterion(bound, criteria, path) for bound in bounds),
        notes=_notes(simulated),
    )


def _judge_signal(
    bound: Bound, signals: Sequence[SignalErrors], source: str, least_coverage: float
) -> Verdict:
    field = f"--max-error {bound.name}"
    for signal in signals:
        if signal.name == bound.name:
            error = signal.overall.maximum
            if bound.relative and not signal.largest:
                raise InputError(_RELATIVE_TO_0, field=field, source=source)
            scale = signal.largest if bound.relative else 1.0
            return Verdict(bound, error / scale, signal.coverage, least_coverage)
    raise InputError("is not in both logs", field=field, source=source)


def _judge_criterion(bound: Bound, criteria: Sequence[Comparison], source: str) -> Verdict:
    field = f"--max-error {bound.name}"
    errors = []
    for comparison in criteria:
        expected = comparison.criterion.expected
        if comparison.criterion.figure != bound.name or expected is None:
            continue
        if bound.relative and not expected:
            raise InputError(_RELATIVE_TO_0, field=field, source=source)
        scale = abs(expected) if bound.relative else 1.0
        errors.append(abs(comparison.value - expected) / scale)
    if not errors:
        raise InputError("was not measured", field=field, source=source)
    return Verdict(bound, float(np.max(errors)))  # NaN if one of them is


def _notes(
    simulated: Recording, experiment: Recording | None = None, signals: Sequence[SignalErrors] = ()
) -> tuple[str, ...]:
    recordings = (simulated,) if experiment is None else (simulated, experiment)
    notes = [f"{recording.source}: {note}" for recording in recordings for note in recording.notes]
    notes += [
        f"{signal.quantity.label}: {signal.skipped} samples not compared, in gaps of the other log"
        for signal in signals
        if signal.skipped
    ]
    notes += [
        f"{signal.quantity.label}: the simulated log covers {100.0 * signal.coverage.share:.3g} % "
        f"of what was measured, with gaps of up to {signal.coverage.largest_gap:.3g} s"
        for signal in signals
        if not signal.coverage.is_enough(ENOUGH)
    ]
    return tuple(notes)
