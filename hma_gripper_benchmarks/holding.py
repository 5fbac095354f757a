"""What a gripper is for: does the force stay while it holds?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hma_gripper_benchmarks import this_package
from hma_gripper_benchmarks.scenes import Task

RELAXED = 2.0  # s after the stop the viscous part of the force has died away
TOLERANCE = 1e-3


@dataclass(frozen=True)
class Holding:
    """Force while the base rests.

    Parameters
    ----------
    force
        At the end [N].
    creep
        Its change from `RELAXED` after the stop to the end [N].
    """

    force: float
    creep: float


def measure(task: Task) -> Holding:
    """Hold at the default tolerance, with the set-valued friction of the task."""
    trace = this_package.run(task, task.scene, TOLERANCE, 0.001)
    held = trace.time >= task.parts[0][0] + RELAXED
    force = trace.actuator_force[held]
    return Holding(float(force[-1]), float(np.ptp(force)))
