"""Cylinders seen along their axis."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.model.contours.base import SMALLEST, Contour
from hma_gripper_sim.model.numbers import check_numbers, number

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Circle(Contour):
    """A cylinder seen along its axis.

    Parameters
    ----------
    radius
        [m]
    """

    kind: ClassVar[str] = "circle"
    sampled_normal: ClassVar[str] = "object"

    radius: float = field(metadata=number("m", "Radius of a circle [m].", minimum=SMALLEST))

    def __post_init__(self) -> None:
        check_numbers(self)

    @property
    def core(self) -> Array:
        """The centre, shape (1, 2)."""
        return np.zeros((1, 2))

    @property
    def core_radius(self) -> float:
        """The radius [m]."""
        return self.radius
