"""Joints in the middles of GBEs: second order in the GBE's length."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.discretisations.base import Discretisation, Partition
from hma_gripper_sim.model.gripper import GripperDesign

Array = NDArray[np.float64]


class Midpoint(Discretisation):
    """A joint in the middle of every GBE, rigid parts on both sides.

    Bodies point along the beam at the ends of GBEs, between which the curvature is constant.
    """

    name = "midpoint"
    column_error = (1.5, 2)

    def partition(self, elements: int) -> Partition:
        """Joints in the middles of equal GBEs."""
        return Partition((np.arange(elements) + 0.5) / elements, np.full(elements, 1.0 / elements))

    def tangent_weights(self, elements: int, at: Array) -> Array:
        """The curvature is constant over a GBE."""
        place = np.asarray(at)[:, None] * elements
        return np.asarray(np.clip(place - np.arange(elements), 0.0, 1.0))

    def usual_elements(
        self, design: GripperDesign, asked: bool
    ) -> tuple[tuple[int, int], str] | None:
        """Few, where no accuracy asks for a number."""
        return None if asked else ((2, 8), "the default of the midpoint discretisation")
