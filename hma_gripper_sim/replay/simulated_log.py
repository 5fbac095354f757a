"""The simulation along a course, in blocks of bounded memory, and the log of it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hma_gripper_sim.bags.log_metadata import REMARKS_KEY, remarks_text
from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.device.tick_messages import Stamps, TickMessages, data_message
from hma_gripper_sim.device.topics import CMD_VELOCITY, CONTOUR, STAMPED_TOPICS
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.motion.prescribed_motion import follow, part_of
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series
from hma_gripper_sim.replay.course import Course
from hma_gripper_sim.replay.simulated_settings import SimulatedSettings, metadata
from hma_gripper_sim.results.error_estimate import ErrorEstimate
from hma_gripper_sim.results.observation import join
from hma_gripper_sim.results.validity import Finding, findings, remarks
from hma_gripper_sim.simulation.companion_runs import Companions
from hma_gripper_sim.simulation.simulation import Simulation
from hma_gripper_sim.simulation.state import SimulationState
from hma_gripper_sim.simulation.trace import Trace

BLOCK = 4000
"""Samples that are simulated, turned into messages and written at a time."""

LEAD_IN_VELOCITY, LEAD_IN_REST = 0.004, 1.0
"""How a replay that starts elsewhere than at the start pose gets there [m/s], and then rests [s].

What the gripper did before the log began is not known; it is taken to have come straight down.
"""


@dataclass(frozen=True)
class Replay:
    """What a replay gave.

    Attributes
    ----------
    recording
        The signals that were logged.
    error_estimate
        How far it is from the exact solution, and its model from the continuum.
    validity
        Where it leaves what the model describes.
    """

    recording: Recording
    error_estimate: ErrorEstimate
    validity: tuple[Finding, ...]


def replay(
    course: Course,
    parameters: SimulatedSettings,
    output: Path,
    period_ns: int,
    progress: Callable[[float], None] = lambda time: None,
) -> Replay:
    """Simulate a scene along a course, and write what the node would have published.

    The same course and parameters give the same log, byte for byte.

    Parameters
    ----------
    output
        The rosbag2 directory to create.
    period_ns
        Between two samples in the log [ns].
    progress
        Called with the time of the course that has been written [s].

    Raises
    ------
    InputError
        The log cannot be written.
    SimulationError
        The simulation could not go on; what was simulated before is in the log.
    """
    simulation = Simulation(parameters.scene, parameters.tolerance)
    companions = Companions(simulation)
    texts = metadata(parameters.given)
    messages = TickMessages(parameters.scene)
    blocks, observed = [], []
    topics = (*STAMPED_TOPICS, CONTOUR, *((CMD_VELOCITY,) if len(course.commands.time) else ()))
    with LogWriter(output, topics, compressed=True, custom_data=texts) as log:
        log.write(CONTOUR.name, course.start, data_message(CONTOUR, parameters.contour))
        commands = _commands(course, period_ns)
        due, velocity = next(commands)
        for trace, kept, stamps in _blocks(simulation, companions, course, period_ns):
            states = trace.states(kept)
            for topic, stamp, content in messages.of_ticks(states, stamps):
                while due < stamp:
                    log.write(CMD_VELOCITY.name, due, data_message(CMD_VELOCITY, velocity))
                    due, velocity = next(commands)
                log.write(topic.name, stamp, content)
            blocks.append((stamps, _signals(states)))
            observed.append(trace.observed)
            progress((int(stamps[-1]) - course.start) * 1e-9)
        estimate = companions.estimate()
        validity = findings(parameters.scene, join(observed), estimate)
        log.describe(REMARKS_KEY, remarks_text(remarks(validity, estimate)))
    return Replay(_recording(str(output), blocks), estimate, validity)


_Block = tuple[Trace, slice, Stamps]


def _blocks(
    simulation: Simulation, companions: Companions, course: Course, period_ns: int
) -> Iterator[_Block]:
    """Yield traces, which of their samples are new, and the stamps of these [ns]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # each trace holds its own
        lead_in(simulation, course.travel, companions)
        begin, period = simulation.time, period_ns * 1e-9
        motion = course.motion._replace(time=course.motion.time + begin)
        count = int(course.duration / period + 1e-6)
        done, first = 0, 0  # samples so far; the very first one is new as well
        while done < count:
            upto = min(done + BLOCK, count)
            last = upto == count
            end = float(motion.time[-1]) if last else begin + period * upto
            part = part_of(motion, simulation.time, end)
            trace = simulation.advance_along(part, period)
            kept = slice(first, upto - done + 1)
            companions.advance_along(part, trace, kept)
            stamps = course.start + period_ns * np.arange(done + first, upto + 1, dtype=np.int64)
            if not trace.stats.converged:
                stamps = stamps[: max(0, len(trace.time) - first)]
                if len(stamps):
                    yield trace, slice(first, len(trace.time)), stamps
                time = float(trace.time[-1]) - begin
                raise SimulationError(trace.stats.outcome, time)
            yield trace, kept, stamps
            done, first = upto, 1


def lead_in(simulation: Simulation, travel: float, companions: Companions | None = None) -> None:
    """Bring the gripper from the start pose to where the course starts, and let it rest."""
    if travel == 0.0:
        return
    duration = abs(travel) / LEAD_IN_VELOCITY
    for length, velocity in ((duration, travel / duration), (LEAD_IN_REST, 0.0)):
        motion = follow(velocity, simulation.time, simulation.travel, length)
        trace = simulation.advance_along(motion, length)
        if companions is not None:
            companions.advance_along(motion, trace, slice(0, 0))
        if not trace.stats.converged:
            raise SimulationError(trace.stats.outcome, float(trace.time[-1]))


def _commands(course: Course, period_ns: int) -> Iterator[tuple[int, float]]:
    """Yield stamp [ns] and velocity of the commands; at the end one that is never due.

    Of repetitions within one sample only the last is kept: it is what a timeout counts from.
    """
    stamps = course.start + np.round(1e9 * course.commands.time).astype(np.int64)
    values = course.commands.value
    if len(values):
        sample = (stamps - course.start) // period_ns
        kept = np.append((np.diff(values) != 0.0) | (np.diff(sample) != 0), True)
        kept[1:] |= np.diff(values) != 0.0
        kept[0] = True
        yield from zip(stamps[kept].tolist(), values[kept].tolist(), strict=True)
    yield 2**63, 0.0


def _signals(states: SimulationState) -> dict[str, FloatArray]:
    signals: dict[str, Any] = {
        "travel": states.travel,
        "actuator_force": states.actuator_force,
        "phi_left": states.phi_left,
        "phi_right": states.phi_right,
        "bending_moment": np.maximum(states.moment_left, states.moment_right),
    }
    return signals


def _recording(source: str, blocks: list[tuple[Stamps, dict[str, FloatArray]]]) -> Recording:
    stamps = np.concatenate([stamps for stamps, _ in blocks])
    start = int(stamps[0])
    time = (stamps - start).astype(np.float64) * 1e-9
    signals = {
        name: Series(time, np.concatenate([signals[name] for _, signals in blocks]))
        for name in blocks[0][1]
    }
    return Recording(source, signals, start)
