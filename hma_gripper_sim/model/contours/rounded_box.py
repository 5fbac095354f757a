"""Boxes with rounded corners."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.model.contours.base import SMALLEST, Contour
from hma_gripper_sim.model.numbers import check_numbers, number
from hma_gripper_sim.units import quantity

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RoundedBox(Contour):
    """A box with rounded corners, centred on its own frame.

    Parameters
    ----------
    width, height
        Outer dimensions in x and z [m].
    corner_radius
        [m]; 0 gives sharp corners.
    """

    kind: ClassVar[str] = "box"

    width: float = field(metadata=number("m", "Width of a box [m].", minimum=SMALLEST))
    height: float = field(metadata=number("m", "Height of a box [m].", minimum=SMALLEST))
    corner_radius: float = field(
        default=0.0, metadata=number("m", "Corner radius of a box [m].", minimum=0.0)
    )

    def __post_init__(self) -> None:
        check_numbers(self)
        largest = 0.5 * min(self.width, self.height)
        quantity(
            self.corner_radius, "m", field="corner_radius", source="RoundedBox", maximum=largest
        )

    @property
    def core_radius(self) -> float:
        """The corner radius [m]."""
        return self.corner_radius

    @property
    def core(self) -> Array:
        """Centres of the corner arcs, shape (4, 2); fewer where they coincide."""
        x = 0.5 * self.width - self.corner_radius
        z = 0.5 * self.height - self.corner_radius
        corners = [(-x, -z), (x, -z), (x, z), (-x, z)]
        return np.array(list(dict.fromkeys((a + 0.0, b + 0.0) for a, b in corners)))
