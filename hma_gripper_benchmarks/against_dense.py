"""Is the reference right? Random scenes, against independently written equations.

The equations of `benchmark.dense` share no code with the package's solver, and scipy's Radau
integrates them, so that what the package gets wrong at every tolerance shows here. Friction is
regularised on both sides, with the same slip velocity. One difference is meant: where the tip's
flank may lie on a face, this package finds the centre of pressure, while the other equations know
a contact in one point.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from hma_gripper_benchmarks.asked_error import WORKERS
from hma_gripper_benchmarks.dense import LEFT, RIGHT, equations
from hma_gripper_benchmarks.peers import scipy_gripper
from hma_gripper_benchmarks.population import plain_tasks
from hma_gripper_benchmarks.scenes import REGULARISED, SAMPLE_PERIOD, Task
from hma_gripper_benchmarks.worker import Worker, WorkerError, spread
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.simulation.simulation import simulate
from hma_gripper_sim.simulation.trace import beam_tangent

LONGEST = 10.0  # s
LIMIT = 120.0  # s of wall time for one scene
TOLERANCE = 1e-6  # of this package, as for the references of the populations
RADAU_TOLERANCE = 1e-7


@dataclass(frozen=True)
class Difference:
    """How far Radau and the package are apart on one scene.

    Parameters
    ----------
    key, title
        Of the scene.
    flat
        Whether the tip's flank may lie on a face, so that the equations are not quite the same.
    failure
        Why there is no comparison, or None.
    force_rms, force_max
        Of the actuator force, relative to its largest.
    phi_rms
        Of both angles of deflection [rad].
    """

    key: str
    title: str
    flat: bool
    failure: str | None
    force_rms: float = math.nan
    force_max: float = math.nan
    phi_rms: float = math.nan


def measure(count: int, tick: Callable[[], None]) -> list[Difference]:
    """Compare on the first `count` scenes of the general population that both can express.

    Not after `use_one_core`: the workers would share that core.
    """
    tasks = list(islice(plain_tasks(LONGEST, lambda scene: True), count))
    compare(replace(tasks[0], parts=((SAMPLE_PERIOD, 0.0),)))  # compiles
    found = []
    for difference in spread(_attempt, tasks, compare, LIMIT, WORKERS):
        found.append(difference)
        tick()
    order = [task.key for task in tasks]
    return sorted(found, key=lambda difference: order.index(difference.key))


def _attempt(worker: Worker[Task, Difference], task: Task) -> Difference:
    try:
        return worker.call(task)
    except WorkerError as error:
        return Difference(task.key, task.title, _may_lie_flat(task), str(error))


def _may_lie_flat(task: Task) -> bool:
    return task.scene.contact == "continuous" and not isinstance(task.scene.contour, Circle)


def compare(task: Task) -> Difference:
    """Solve a task twice, both times with regularised friction."""
    scene = replace(task.scene, slip_velocity=REGULARISED)
    task = replace(task, scene=scene)
    flat = _may_lie_flat(task)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that the contact model leaves out
        try:
            trace = simulate(scene, task.velocity, task.duration, TOLERANCE, SAMPLE_PERIOD)
            sides = [_solve(task, side) for side in (RIGHT, LEFT)]
        except (SimulationError, scipy_gripper.OdeError) as error:
            return Difference(task.key, task.title, flat, str(error))
    if not trace.stats.converged:
        return Difference(task.key, task.title, flat, trace.stats.outcome.value)
    (right, phi_right), (left, phi_left) = sides
    force = right + left - scene.half.middle_mass * scene.gravity
    difference = (trace.actuator_force - force) / np.abs(force).max()
    angles = np.stack([trace.phi_right - phi_right, trace.phi_left - phi_left])
    return Difference(
        task.key,
        task.title,
        flat,
        None,
        float(np.sqrt(np.mean(difference**2))),
        float(np.abs(difference).max()),
        float(np.sqrt(np.mean(angles**2))),
    )


def _solve(task: Task, side: int) -> tuple[scipy_gripper.Array, scipy_gripper.Array]:
    """Load on the base [N] and angle of deflection [rad] at the samples."""
    scene = task.scene
    system = equations(scene, scene.slip_velocity, side)
    rest = scene.start_states[side].q
    _, states, load = scipy_gripper.integrate(
        task, system, rest, "Radau", RADAU_TOLERANCE, SAMPLE_PERIOD
    )
    return load, beam_tangent(scene.half, scipy_gripper.joint_angles(system, states))
