"""How far the simulation behind a log can be trusted: what the log says was done, verified."""

from __future__ import annotations

from pathlib import Path

from hma_gripper_sim.bags.log_metadata import logged_parameters
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.replay.course import commanded
from hma_gripper_sim.replay.simulated_settings import SimulatedSettings
from hma_gripper_sim.results.validity import findings, remarks
from hma_gripper_sim.simulation.companion_runs import Companions
from hma_gripper_sim.simulation.simulation import Simulation


def verify_log(path: Path, recording: Recording) -> tuple[str, ...]:
    """Simulate along the commands of a log of the node once more, verified; return remarks.

    Parameters
    ----------
    path, recording
        The log, which says what was simulated, and its signals.

    Raises
    ------
    InputError
        The log does not say what was commanded, or from what start.
    """
    parameters = SimulatedSettings.parse(logged_parameters(path))
    period = parameters.period_ns * 1e-9
    course = commanded(recording, parameters.limits, period)
    simulation = Simulation(parameters.scene, parameters.tolerance)
    companions = Companions(simulation)
    trace = simulation.solve_along(course.motion, period)
    companions.advance_along(course.motion, trace)
    estimate = companions.estimate()
    return remarks(findings(parameters.scene, trace.observed, estimate), estimate)
