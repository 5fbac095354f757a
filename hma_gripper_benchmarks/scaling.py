"""What a Newton iteration costs per joint, and what memory a simulation takes."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import cast

import numpy as np
from numpy.typing import NDArray

from hma_gripper_benchmarks.measuring import interleaved
from hma_gripper_sim.kernels.chain import eliminate, place, substitute
from hma_gripper_sim.kernels.compiled import COMPILED
from hma_gripper_sim.kernels.stage import Model, Workspace, allocate
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.simulation.simulation import Simulation

Array = NDArray[np.float64]

RATE = 1e3  # 1/s; of a stage of about 3 ms
ITERATED_JOINTS = 300_000  # per timing


@dataclass(frozen=True)
class ScalingRow:
    """One resolution.

    Parameters
    ----------
    joints
        Of one half.
    iteration_time
        CPU time of one Newton iteration of one half [s].
    memory
        Of a `Simulation` of that half: state and buffers [byte].
    """

    joints: int
    iteration_time: float
    memory: int

    @property
    def time_per_joint(self) -> float:
        """[s]"""
        return self.iteration_time / self.joints

    @property
    def memory_per_joint(self) -> float:
        """[byte]"""
        return self.memory / self.joints


def measure(
    resolutions: tuple[tuple[int, int], ...], rounds: int, tick: Callable[[], None]
) -> list[ScalingRow]:
    """Measure half grippers of (top, beam) GBEs."""
    design = GripperDesign.thesis_2013()
    joints, runs, counts, memory = [], [], [], []
    for top, beam in resolutions:
        scene = Scene(
            design,
            Circle(radius=0.015),
            discretisation="thesis",
            elements_top=top,
            elements_beam=beam,
        )
        model = scene.models[0]
        n = len(scene.half.joints)
        count = max(1, ITERATED_JOINTS // n)
        joints.append(n)
        counts.append(count)
        runs.append(_iterations(model, count))
        memory.append(_memory(scene))
    for run in runs:
        run()
    times = interleaved(runs, rounds, tick)
    return [
        ScalingRow(n, spent / count, size)
        for n, spent, count, size in zip(joints, times, counts, memory, strict=True)
    ]


def _iterations(model: Model, count: int) -> Callable[[], None]:
    n = model.chain.rest.size
    workspace = allocate(model)
    q, v, a = (np.zeros(n) for _ in range(3))
    iterate = _compiled()
    return lambda: iterate(model, workspace, q, v, a, count)


@cache
def _compiled() -> Callable[..., None]:
    """Compile `_iterate`, anew in every process: numba's cache would miss changed kernels."""
    if not COMPILED:
        return _iterate
    import numba

    return cast("Callable[..., None]", numba.njit(error_model="numpy", _nrt=False)(_iterate))


def _memory(scene: Scene) -> int:
    Simulation(scene)  # what the scene keeps for itself is not the simulation's
    tracemalloc.start()
    try:
        simulation = Simulation(scene)
        size, _ = tracemalloc.get_traced_memory()
        del simulation
    finally:
        tracemalloc.stop()
    return size


def _iterate(model: Model, workspace: Workspace, q: Array, v: Array, a: Array, count: int) -> None:
    """Newton iterations of the chain; the increments are computed, not applied."""
    for _ in range(count):
        place(model.chain, workspace.base, model.gravity, q, v, a, workspace.chain, workspace.tip)
        eliminate(model.chain, RATE, q, v, workspace.chain, workspace.tip)
        substitute(workspace.chain, workspace.contact.correction, workspace.increment)
