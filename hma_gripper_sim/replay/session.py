"""A replay from what the user asks for to the comparison with what was recorded."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from hma_gripper_sim.bags.log_metadata import counted_messages, logged_parameters
from hma_gripper_sim.comparison.bounds import Bound
from hma_gripper_sim.comparison.log_comparison import (
    LogComparison,
    compare_experiment,
    compare_recordings,
)
from hma_gripper_sim.comparison.provenance import simulation_facts
from hma_gripper_sim.device.topics import CONTOUR
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.experiments.node_parameters import node_parameters
from hma_gripper_sim.recordings.reading import read_messages
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.replay.course import Course, commanded, measured, planned
from hma_gripper_sim.replay.simulated_log import Replay
from hma_gripper_sim.replay.simulated_log import replay as simulate_course
from hma_gripper_sim.replay.simulated_settings import (
    SimulatedSettings,
    flat,
)
from hma_gripper_sim.results.validity import remarks

FULL_RATE = 100.0
"""Samples per second [Hz] up to which every tick is logged."""

SLOWEST_TICKS = 20.0
"""Rate [Hz] of a log below which its samples are taken to be thinned, not the ticks themselves."""

ELSEWHERE = 1e-4
"""Travel [m] from the start pose, or from where commands should have led, that is worth a note."""


@dataclass(frozen=True)
class Request:
    """What the user asks for.

    Attributes
    ----------
    source, output
        The log or experiment to replay, and the log to write.
    experiment, recording
        What `read_source` has read of the source.
    basis
        ``commands``, ``travel``, or None: the commands where there are any.
    signal_map
        File that says where the signals of the log are.
    options
        Parameters, by the node's names; they override those of the source.
    rate
        Of the samples in the output [Hz]; None: that of the ticks, at most `FULL_RATE`.
    travel_tolerance
        How far the simulated travel may be from the measured one [m].
    bounds, least_coverage
        To judge the comparison by, and how much of a signal it takes.
    """

    source: Path
    output: Path
    experiment: Experiment | None
    recording: Recording | None
    basis: str | None
    signal_map: Path | None
    options: Mapping[str, object]
    rate: float | None
    travel_tolerance: float
    bounds: Sequence[Bound]
    least_coverage: float


def carry_out(request: Request) -> LogComparison | None:
    """Replay, write the log, say what was done, and compare with the source.

    Returns
    -------
    LogComparison or None
        None where nothing is known to compare with: of an experiment that is only planned.

    Raises
    ------
    InputError
        Something given cannot be used.
    SimulationError
        The simulation could not go on.
    """
    with _progress() as progress:
        experiment, recording = request.experiment, request.recording
        parameters = _parameters(request, experiment, recording)
        course = _course(request, experiment, recording, parameters)
        period_ns = _sample_period(request, parameters)
        task = progress.add_task("replaying", total=course.duration)
        began = time.perf_counter()
        result = simulate_course(
            course,
            parameters,
            request.output,
            period_ns,
            lambda done: progress.update(task, completed=done),
        )
        took = time.perf_counter() - began
    console = Console()
    said = (
        f"{course.duration:.6g} s of {parameters.contour!r}, friction "
        f"{parameters.scene.friction:g}, following {course.basis}: replayed in {took:.2g} s into "
        f"{request.output}"
    )
    console.print(said, markup=False, highlight=False, soft_wrap=True)
    comparison = _compare(request, experiment, recording, result)
    trusted = remarks(result.validity, result.error_estimate)
    notes = (*_start(course), *course.notes, *_elsewhere(course, comparison), *trusted)
    if comparison is not None:
        return replace(
            comparison,
            notes=(*notes, *comparison.notes),
            simulation=simulation_facts(parameters.given),
            signal_map=str(request.signal_map or ""),
        )
    for note in notes:
        console.print(f"note: {note}", markup=False, highlight=False, soft_wrap=True)
    return None


def _parameters(
    request: Request, experiment: Experiment | None, recording: Recording | None
) -> SimulatedSettings:
    if experiment is not None:
        given = flat(node_parameters([experiment]))
    else:
        given = logged_parameters(request.source)
        known = "contour" in given and counted_messages(request.source).get(CONTOUR.name, 1) == 1
        if not known and "contour" not in request.options:
            given |= _logged_contour(request.source, request.signal_map)
    if recording is not None and "publish_rate" not in given:
        given["publish_rate"] = _tick_rate(recording)
    return SimulatedSettings.parse({**given, **request.options})


def _logged_contour(source: Path, signal_map: Path | None) -> dict[str, object]:
    """Return the object that a log of the node says was in place."""
    hint = "name the object: --contour"
    if signal_map is not None:
        raise InputError(hint, source=str(source))
    try:
        names = {str(message.content.data) for message in read_messages(source, [CONTOUR.name])}
    except InputError:
        raise InputError(f"does not say what was gripped; {hint}", source=str(source)) from None
    if len(names) != 1:
        listed = ", ".join(sorted(names))
        raise InputError(
            f"several objects were in place ({listed}): split the log, or {hint}",
            field=CONTOUR.name,
            source=str(source),
        )
    return {"contour": names.pop()}


def _tick_rate(recording: Recording) -> float:
    """Rate of the ticks [Hz] that a log was made at, as far as its travel shows it."""
    if "travel" not in recording.signals or len(recording["travel"].time) < 2:
        return FULL_RATE
    rate = 1.0 / max(1e-3, float(np.median(np.diff(recording["travel"].time))))
    return rate if rate >= SLOWEST_TICKS else FULL_RATE


def _course(
    request: Request,
    experiment: Experiment | None,
    recording: Recording | None,
    parameters: SimulatedSettings,
) -> Course:
    if recording is None:
        if request.basis == "travel" or experiment is None:
            raise InputError("has no log", field="--from", source=str(request.source))
        return planned(experiment.motion, parameters.limits, parameters.period_ns * 1e-9)
    basis = request.basis
    if basis is None:
        basis = "commands" if "velocity_command" in recording.signals else "travel"
    if basis == "commands":
        return commanded(recording, parameters.limits, parameters.period_ns * 1e-9)
    return measured(recording, request.travel_tolerance)


def _sample_period(request: Request, parameters: SimulatedSettings) -> int:
    """Time between two samples in the output [ns]: a whole number of ticks."""
    ticks = math.ceil(1e9 / (FULL_RATE * parameters.period_ns) - 1e-6)
    if request.rate is not None:
        ticks = max(1, round(1e9 / (request.rate * parameters.period_ns)))
    return ticks * parameters.period_ns


def _compare(
    request: Request, experiment: Experiment | None, recording: Recording | None, result: Replay
) -> LogComparison | None:
    source = str(request.source)
    if experiment is not None:
        if not (experiment.measured or experiment.published or experiment.log or request.bounds):
            return None
        return compare_experiment(
            result.recording,
            experiment,
            source,
            bounds=request.bounds,
            least_coverage=request.least_coverage,
        )
    if recording is None:
        raise InputError("has no log", source=source)
    title = f"Replay of {request.source.name}"
    return compare_recordings(
        result.recording,
        recording,
        title=title,
        bounds=request.bounds,
        least_coverage=request.least_coverage,
    )


def _start(course: Course) -> tuple[str, ...]:
    """Say if the gripper had to be brought to where the log starts."""
    if abs(course.travel) <= ELSEWHERE:
        return ()
    return (
        f"the log starts at a travel of {course.travel * 1e3:.4g} mm: the gripper was brought "
        "there from the start pose",
    )


def _elsewhere(course: Course, comparison: LogComparison | None) -> tuple[str, ...]:
    """Say if the commands have led elsewhere than the recorded gripper went."""
    if comparison is None or not len(course.commands.time):
        return ()
    for signal in comparison.signals:
        if signal.name == "travel" and signal.overall.maximum > ELSEWHERE:
            return (
                f"the commands lead up to {signal.overall.maximum * 1e3:.3g} mm away from the "
                "measured travel: other commands, limits or ticks were in force, or the log began "
                "in motion; try --from travel",
            )
    return ()


def _progress() -> Progress:
    """On the error output, and only on a terminal."""
    errors = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        console=errors,
        transient=True,
        disable=not errors.is_terminal,
    )
