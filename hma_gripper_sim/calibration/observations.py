"""What was measured in an experiment, and the same out of a simulation."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.motion.prescribed_motion import part_of
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series
from hma_gripper_sim.replay.course import measured
from hma_gripper_sim.replay.simulated_log import lead_in
from hma_gripper_sim.simulation.simulation import Simulation

SIGNALS = ("actuator_force", "phi_left", "phi_right")
"""What is compared, where it was measured."""

AVERAGED = 0.05
"""Time [s] over which the samples of a log are averaged, and the simulation alike.

For some 15 ms after a touch the force chatters, at around 1 kHz. What a log catches of it depends
on where its samples happen to lie; the squared error as a function of, say, the clearance would
have a jump wherever a peak passes one of them.
"""

ROUND_OFF = 1e-6
"""Share of a stretch by which rounding may put a sample before it."""

FINEST, MOST_SIMULATED = 1e-3, 200_000
"""Shortest period [s], and number, of the samples of a simulation that is interpolated between."""

TOLERANCE = 1e-4
"""Of the solver: a twentieth of what neighbouring parameters (`fitting.DIFFERENCE`) change.

Their difference has far smaller errors, which are nearly the same in both.
"""


Simulated = Mapping[str, Series]
"""Signals of a simulation by name, from the start of the motion on."""


@dataclass(frozen=True)
class Observation:
    """A signal that was measured.

    Attributes
    ----------
    name
        One of `SIGNALS`.
    time, value
        When, from the start of the motion, and what [s, SI], shape (n,).
    width
        Of the stretch of time around each `time` that `value` is the mean over [s], shape (n,).
    uncertainty
        Standard uncertainty of each value [SI], shape (n,); None: unknown, but the same for all.
    """

    name: str
    time: FloatArray
    value: FloatArray
    width: FloatArray
    uncertainty: FloatArray | None


@dataclass(frozen=True)
class Trial:
    """A motion, and what was observed in its course.

    Attributes
    ----------
    motion
        From time 0.
    observations
        At least one.
    notes
        What the user should know about them.
    """

    motion: Motion
    observations: tuple[Observation, ...]
    notes: tuple[str, ...] = ()

    def simulate(self, scene: Scene) -> Simulated | None:
        """Simulate the motion, from time 0 on, in a scene; None if that cannot be done."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a trial of parameters may lead anywhere
            try:
                simulation = Simulation(scene, TOLERANCE)
                lead_in(simulation, float(self.motion.travel[0]))
            except SimulationError:
                return None
            begin = simulation.time
            motion = self.motion._replace(time=self.motion.time + begin)
            length = float(motion.time[-1] - begin)
            trace = simulation.advance_along(motion, max(FINEST, length / MOST_SIMULATED))
        if not trace.stats.converged:
            return None
        return {name: Series(trace.time - begin, getattr(trace, name)) for name in self.signals}

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of what was observed."""
        return tuple(dict.fromkeys(observation.name for observation in self.observations))

    def observed(
        self, simulated: Simulated, logged: Mapping[str, float] = MappingProxyType({})
    ) -> list[FloatArray]:
        """Return each observation as a simulation gives it.

        Parameters
        ----------
        logged
            How it came into the log: ``force_delay`` and ``angle_delay`` [s], by which the signals
            are late there, and ``force_bias`` and ``angle_bias`` [SI], which are added; 0 if left
            out.
        """
        means = []
        for observation in self.observations:
            kind = "force" if observation.name == "actuator_force" else "angle"
            due = replace(observation, time=observation.time - logged.get(f"{kind}_delay", 0.0))
            mean = _means(simulated[observation.name], due)
            means.append(mean + logged.get(f"{kind}_bias", 0.0))
        return means


def trial(experiment: Experiment, source: str, travel_tolerance: float) -> Trial:
    """Return what an experiment says about a gripper's parameters.

    Where it has a log, that is its samples, along the measured travel; else its measurements at
    instants, along its motion.

    Parameters
    ----------
    travel_tolerance
        How far the simulated travel may be from the measured one [m].

    Raises
    ------
    InputError
        The log cannot be read or replayed, or holds none of `SIGNALS`.
    """
    if experiment.log is None:
        return Trial(_stated_motion(experiment), tuple(_at_instants(experiment)))
    recording = experiment.log.recording
    course = measured(recording, travel_tolerance)
    begin = 1e-9 * (course.start - recording.start)
    observations = tuple(
        _observation(name, recording, begin, course.duration, experiment.log.uncertainties)
        for name in SIGNALS
        if name in recording.signals
    )
    if not any(len(observation.time) for observation in observations):
        raise InputError(f"has none of {', '.join(SIGNALS)} beside the travel", source=source)
    return Trial(course.motion, observations, (*recording.notes, *course.notes))


def _observation(
    name: str,
    recording: Recording,
    begin: float,
    duration: float,
    uncertainties: Mapping[str, float],
) -> Observation:
    series = recording[name].between(begin, begin + duration)
    return averaged(
        name, Series(series.time - begin, series.value), uncertainties.get(name), AVERAGED
    )


def averaged(name: str, series: Series, uncertainty: float | None, width: float) -> Observation:
    """Average a series over stretches of time.

    Parameters
    ----------
    uncertainty
        Standard uncertainty of a sample [SI], if it is known; that of a mean of n is √n smaller.
    width
        Of a stretch [s].
    """
    if not len(series.time):
        return Observation(name, series.time, series.value, series.time, None)
    first = np.flatnonzero(np.diff(np.floor(series.time / width + ROUND_OFF), prepend=-np.inf))
    counts = np.diff(np.append(first, len(series.time)))
    time, value = (np.add.reduceat(part, first) / counts for part in (series.time, series.value))
    spacing = float(np.median(np.diff(series.time))) if len(series.time) > 1 else 0.0
    last = np.append(first[1:], len(series.time)) - 1
    return Observation(
        name,
        time,
        value,
        series.time[last] - series.time[first] + spacing,
        None if uncertainty is None else uncertainty / np.sqrt(counts),
    )


def _means(simulated: Series, observation: Observation) -> FloatArray:
    """Means of a simulated signal over the stretches of an observation."""
    time, value = simulated.time, simulated.value
    steps = 0.5 * (value[1:] + value[:-1]) * np.diff(time)
    integral = np.concatenate([[0.0], np.cumsum(steps)])
    half = 0.5 * observation.width
    start = np.clip(observation.time - half, time[0], time[-1])
    end = np.clip(observation.time + half, time[0], time[-1])
    length = end - start
    mean = (np.interp(end, time, integral) - np.interp(start, time, integral)) / np.where(
        length > 0.0, length, 1.0
    )
    return np.where(length > 0.0, mean, np.interp(observation.time, time, value))


def _stated_motion(experiment: Experiment) -> Motion:
    points = np.array(experiment.way_points)
    velocity = np.array([segment.velocity for segment in experiment.motion])
    jump = np.ones(len(velocity), dtype=np.bool_)
    motion = Motion(points[:, 0].copy(), points[:, 1].copy(), velocity[:, None], jump)
    last = max(measurement.time for measurement in experiment.measurements)
    return part_of(motion, 0.0, last) if last > 0.0 else motion


def _at_instants(experiment: Experiment) -> Iterator[Observation]:
    for name in SIGNALS:
        points = [m for m in experiment.measurements if m.figure == name]
        if points:
            uncertainty = np.array([m.uncertainty for m in points])
            yield Observation(
                name,
                np.array([m.time for m in points]),
                np.array([m.value for m in points]),
                np.zeros(len(points)),
                uncertainty if uncertainty.all() else None,
            )
