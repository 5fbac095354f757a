"""Times faster than MuJoCo at MuJoCo's own error, over random scenes.

Circles and boxes of the general population whose motion is phases of constant velocity, which
MuJoCo's base follows exactly: any design, off the axis or not, continuous contact with the tip's
capsule. MuJoCo's friction is a regularised one. Where the base only ever goes down, both sides
have its law, as on the published scenes; where it rests or turns back, a regularised law would
creep, and the reference is set-valued friction, which MuJoCo approaches with a stiff slope.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from hma_gripper_benchmarks import this_package
from hma_gripper_benchmarks.asked_error import time_at
from hma_gripper_benchmarks.population import plain_tasks
from hma_gripper_benchmarks.scenes import REGULARISED, Task
from hma_gripper_benchmarks.series import Series
from hma_gripper_benchmarks.work_precision import timed_rows
from hma_gripper_benchmarks.worker import Worker, WorkerError
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.model.contours.rounded_box import RoundedBox

SHORTEST, LONGEST = 0.5, 10.0  # s; a shorter run has too few samples to be compared
TOLERANCES = (2e-2, 5e-3, 1e-3, 3e-4, 1e-4, 3e-5)
REFERENCE_TOLERANCE = 1e-6
LIMIT = 120.0  # s of wall time for one scene
TYPICAL = 0.5  # of the largest force: the normal force at which both laws of friction agree
TOUCHED = 1e-6  # relative; in free flight at constant velocities the force stays the same


@dataclass(frozen=True)
class Comparison:
    """One scene with one of MuJoCo's settings.

    Parameters
    ----------
    key, title
        Of the scene.
    setting
        MuJoCo's.
    error
        MuJoCo's RMS error of the actuator force, relative to the force's largest.
    peer_time
        MuJoCo's CPU time [s]; None: its result is too wrong for its speed to count.
    own_time
        This package's to the same error, both halves stepped [s]; infinite: it was never got.
    """

    key: str
    title: str
    setting: str
    error: float
    peer_time: float | None = None
    own_time: float = math.nan

    @property
    def ratio(self) -> float | None:
        """Times faster."""
        return None if self.peer_time is None else self.peer_time / self.own_time


def measure(count: int, rounds: int, tick: Callable[[], None]) -> list[Comparison]:
    """Compare on the first `count` scenes that MuJoCo can express and in which something happens.

    Those that take too long are left out.
    """
    found: list[Comparison] = []
    scenes = 0
    worker = Worker(compare, LIMIT)
    try:
        for task in _expressible():
            try:
                comparisons = worker.call((task, rounds))
            except WorkerError:
                continue
            if comparisons:
                found += comparisons
                scenes += 1
                tick()
            if scenes == count:
                return found
    finally:
        worker.close()
    return found


def _expressible() -> Iterator[Task]:
    """Tasks that MuJoCo can do, with the friction law that both are to follow."""
    for task in plain_tasks(LONGEST, lambda scene: isinstance(scene.contour, Circle | RoundedBox)):
        if task.duration < SHORTEST:
            continue
        only_down = all(velocity > 0.0 for _, velocity in task.parts)
        scene = replace(
            task.scene,
            contact="continuous",
            symmetry=False,
            slip_velocity=REGULARISED if only_down else 0.0,
        )
        yield replace(task, scene=scene)


def compare(job: tuple[Task, int]) -> list[Comparison]:
    """Compare both of MuJoCo's settings with this package at several tolerances, in turns.

    In so many rounds; empty where nothing is touched or where there is no reference.
    """
    task, rounds = job
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that the contact model leaves out
        try:
            reference = this_package.reference_of(task, task.scene, REFERENCE_TOLERANCE)
        except RuntimeError:
            return []
        if np.ptp(reference.force) <= TOUCHED * np.abs(reference.force).max():
            return []
        return _compare(task, reference, rounds)


def _compare(task: Task, reference: Series, rounds: int) -> list[Comparison]:
    from hma_gripper_benchmarks.peers import mujoco_gripper

    typical = TYPICAL * float(np.abs(reference.force).max())
    theirs = [
        mujoco_gripper.candidate(task, setting, typical)
        for setting in (mujoco_gripper.ROBUST, mujoco_gripper.ACCURATE)
    ]
    mine = [this_package.candidate(task, task.scene, tolerance) for tolerance in TOLERANCES]
    rows = timed_rows([(one, reference) for one in (*theirs, *mine)], rounds, lambda _: None)
    points = [
        (row.error.force_rms, row.cpu_time)
        for row in rows[len(theirs) :]
        if row.error is not None and row.cpu_time is not None
    ]
    found = []
    for row in rows[: len(theirs)]:
        error = row.error.force_rms if row.error is not None else math.inf
        plain = Comparison(task.key, task.title, row.setting, error)
        if row.cpu_time is None or not points:
            found.append(plain)
        else:
            spent = time_at(error, points)
            found.append(replace(plain, peer_time=row.cpu_time, own_time=spent))
    return found
