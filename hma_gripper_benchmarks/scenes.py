"""What is timed: the thesis' gripper on its objects, in the motions that are compared."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.model.contours.rounded_box import RoundedBox
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.motion.prescribed_motion import Velocity

Array = NDArray[np.float64]
Phase = tuple[float, float]

SPEED = 0.004  # m/s
SAMPLE_PERIOD = 0.01  # s; at which every solver delivers its results
REGULARISED = 1e-4  # m/s; slip velocity of the friction law that all peers can express


def phases(*parts: Phase) -> Callable[[float], float]:
    """Velocity that is constant for a duration each: (duration [s], velocity [m/s])."""
    ends = list(accumulate(part[0] for part in parts))
    values = [part[1] for part in parts]

    def velocity(t: float) -> float:
        return values[min(bisect_right(ends, t), len(values) - 1)]

    return velocity


@dataclass(frozen=True)
class Task:
    """A scene and a motion to simulate.

    Parameters
    ----------
    key, title
        For files and for people.
    scene
        With both halves stepped and the friction law of the reference.
    parts
        (duration [s], velocity [m/s]) one after the other.
    """

    key: str
    title: str
    scene: Scene
    parts: tuple[Phase, ...]

    @property
    def duration(self) -> float:
        """[s]"""
        return sum(part[0] for part in self.parts)

    @property
    def velocity(self) -> Velocity:
        """Of the prismatic joint, as segments."""
        return self.parts

    @cached_property
    def samples(self) -> Array:
        """Times at which results are compared [s], shape (n_samples,)."""
        return np.asarray(SAMPLE_PERIOD * np.arange(round(self.duration / SAMPLE_PERIOD) + 1))


def tasks() -> dict[str, Task]:
    """All of them, by key."""
    design = GripperDesign.thesis_2013()
    cylinder, box = Circle(radius=0.015), RoundedBox(0.028, 0.028, corner_radius=0.002)
    sharp = RoundedBox(0.028, 0.028)
    press: tuple[Phase, ...] = ((7.0, SPEED),)

    def scene(contour: Circle | RoundedBox, contact: str, slip_velocity: float) -> Scene:
        return Scene(
            design,
            contour,
            clearance=0.005 if isinstance(contour, Circle) else 0.004,
            contact=contact,
            symmetry=False,
            slip_velocity=slip_velocity,
        )

    found = (
        Task(
            "cylinder_sampled",
            "Cylinder, sampled contour",
            scene(cylinder, "sampled", REGULARISED),
            press,
        ),
        Task("box_sampled", "Box, sampled contour", scene(box, "sampled", REGULARISED), press),
        Task(
            "cylinder_continuous",
            "Cylinder, continuous contour",
            scene(cylinder, "continuous", REGULARISED),
            press,
        ),
        Task(
            "box_continuous",
            "Box, continuous contour",
            scene(box, "continuous", REGULARISED),
            press,
        ),
        Task(
            "sharp_box_continuous",
            "Sharp-cornered box, continuous contour",
            scene(sharp, "continuous", REGULARISED),
            press,
        ),
        Task(
            "hold",
            "Hold on the cylinder, sampled contour",
            scene(cylinder, "sampled", 0.0),
            ((2.0, SPEED), (5.0, 0.0)),
        ),
        Task(
            "reversal",
            "Reversal on the cylinder, sampled contour",
            scene(cylinder, "sampled", 0.0),
            ((2.0, SPEED), (2.0, -SPEED)),
        ),
    )
    return {task.key: task for task in found}
