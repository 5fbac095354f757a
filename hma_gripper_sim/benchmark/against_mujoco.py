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
from itertools import islice

import numpy as np

from hma_gripper_sim.benchmark import own
from hma_gripper_sim.benchmark.asked_error import time_at
from hma_gripper_sim.benchmark.population import plain_tasks
from hma_gripper_sim.benchmark.scenes import REGULARISED, Task
from hma_gripper_sim.benchmark.series import Series
from hma_gripper_sim.benchmark.work_precision import timed_rows
from hma_gripper_sim.contour import Circle, RoundedBox

SHORTEST, LONGEST = 0.5, 10.0  # s; a shorter run has too few samples to be compared
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5)
REFERENCE_TOLERANCE = 1e-6
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

    Both of MuJoCo's settings and this package at several tolerances take turns.
    """
    found: list[Comparison] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that the contact model leaves out
        for task, reference in islice(_comparable(), count):
            found += _compare(task, reference, rounds)
            tick()
    return found


def _comparable() -> Iterator[tuple[Task, Series]]:
    """Yield the tasks that both can do, each with its reference."""
    simple = plain_tasks(LONGEST, lambda scene: isinstance(scene.contour, Circle | RoundedBox))
    for task in simple:
        if task.duration < SHORTEST:
            continue
        only_down = all(velocity > 0.0 for _, velocity in task.parts)
        scene = replace(
            task.scene,
            contact="continuous",
            symmetry=False,
            slip_velocity=REGULARISED if only_down else 0.0,
        )
        task = replace(task, scene=scene)
        try:
            reference = own.reference_of(task, scene, REFERENCE_TOLERANCE)
        except RuntimeError:
            continue
        if np.ptp(reference.force) > TOUCHED * np.abs(reference.force).max():
            yield task, reference


def _compare(task: Task, reference: Series, rounds: int) -> list[Comparison]:
    from hma_gripper_sim.benchmark.peers import mujoco_gripper

    typical = TYPICAL * float(np.abs(reference.force).max())
    theirs = [
        mujoco_gripper.candidate(task, setting, typical)
        for setting in (mujoco_gripper.ROBUST, mujoco_gripper.ACCURATE)
    ]
    mine = [own.candidate(task, task.scene, tolerance) for tolerance in TOLERANCES]
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
