"""What a discretisation of a beam has to say of itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.model.gripper import GripperDesign

Array = NDArray[np.float64]


class Partition(NamedTuple):
    """A flexible length divided into GBEs: where its joints are, and how long the GBEs are.

    Both have shape (n,) and the unit of the length.
    """

    joints: Array
    lengths: Array

    def times(self, length: float) -> Partition:
        """Return the partition of a length that is so many times as long."""
        return Partition(length * self.joints, length * self.lengths)


class Discretisation(ABC):
    """A way to divide beams into rigid bodies and joints, each of which stands for a GBE.

    A discretisation is a file of its own in this room.
    """

    name: ClassVar[str]
    """What it is called in scenes, files and parameters."""

    column_error: ClassVar[tuple[float, int]]
    """Relative error of a column's buckling load in n GBEs: coefficient and order, c / n^order.

    The column is clamped at one end and pinned at the other (see `mechanics.asked_accuracy`); the
    figures follow from the eigenvalues of the column of hinges, which the tests compute.
    """

    fewest: ClassVar[int] = 1
    """GBEs that a part needs at least."""

    joints_at_sections: ClassVar[bool] = False
    """Whether a joint stands at the start of its GBE: its moment is that section's.

    The damping of joints is then the same for GBEs of any length, as in the thesis, and the first
    GBE of a cantilever is welded to the clamp.  Other joints stand within their GBEs, with damping
    scaled as the stiffness is (Kelvin-Voigt).
    """

    joints_slide: ClassVar[bool] = False
    """Whether a joint slides along the beam as it turns, which a URDF cannot say."""

    @abstractmethod
    def partition(self, elements: int) -> Partition:
        """Divide the length 1 into GBEs."""

    @abstractmethod
    def tangent_weights(self, elements: int, at: Array) -> Array:
        """What each joint of a flexible length turns the beam's tangent by at places on it.

        Parameters
        ----------
        at
            Relative to the length, from its start, shape (m,).

        Returns
        -------
        array
            Per joint angle, shape (m, elements): the share of its GBE's bend on the near side of
            the place.
        """

    def straightening(self, parts: tuple[Partition, ...]) -> Array:
        """How much shorter than bent ones hinged GBEs are, per square of the angle [m/rad^2]."""
        return np.zeros(sum(len(part.joints) for part in parts))

    def of_top_beam(self) -> Discretisation:
        """Return the discretisation of the top beam."""
        return self

    def usual_elements(
        self, design: GripperDesign, asked: bool
    ) -> tuple[tuple[int, int], str] | None:
        """GBEs of half the top beam and of a side beam where none are given, and why so many.

        Parameters
        ----------
        asked
            Whether an accuracy is asked for.

        Returns
        -------
        tuple or None
            None: as many as an accuracy needs.
        """
        return None
