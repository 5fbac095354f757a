"""Candidates of this package."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from hma_gripper_benchmarks.measuring import Candidate
from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD, Task
from hma_gripper_benchmarks.series import Series, from_trace
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.simulation.simulation import simulate
from hma_gripper_sim.simulation.trace import Trace

BOTH = "this package, both halves"
ONE = "this package, one half"
REDUCED = "this package, reduced"

REFERENCE_TOLERANCE = 1e-8
REFERENCE_PERIOD = 0.0005  # s
QUICK_REFERENCE_TOLERANCE = 1e-7


def run(task: Task, scene: Scene, tolerance: float, sample_period: float) -> Trace:
    """Simulate, with the forces sampled."""
    trace = simulate(scene, task.velocity, task.duration, tolerance, sample_period)
    if not trace.stats.converged:
        raise RuntimeError(trace.stats.outcome.value)
    _ = trace.actuator_force
    return trace


def candidate(task: Task, scene: Scene, tolerance: float, solver: str = BOTH) -> Candidate:
    """Simulate with one tolerance."""
    return Candidate(
        solver,
        f"tolerance {tolerance:.0e}",
        lambda: run(task, scene, tolerance, SAMPLE_PERIOD),
        from_trace,
    )


def candidates(task: Task, tolerances: Iterable[float]) -> list[Candidate]:
    """Both halves stepped, then one."""
    both, one = task.scene, replace(task.scene, symmetry=None)
    return [
        candidate(task, scene, tolerance, name)
        for scene, name in ((both, BOTH), (one, ONE))
        for tolerance in tolerances
    ]


def reference(task: Task, full: bool) -> Series:
    """The package's own converged result, sampled finely."""
    tolerance = REFERENCE_TOLERANCE if full else QUICK_REFERENCE_TOLERANCE
    return reference_of(task, replace(task.scene, symmetry=None), tolerance)


def reference_of(task: Task, scene: Scene, tolerance: float) -> Series:
    """The same of another model of the task's scene."""
    return from_trace(run(task, scene, tolerance, REFERENCE_PERIOD))
