"""The discretisation of the thesis: first order in the GBE's length (thesis 3.2, A.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.discretisations.base import Discretisation, Partition
from hma_gripper_sim.mechanics.discretisations.midpoint import Midpoint
from hma_gripper_sim.model.gripper import GripperDesign

Array = NDArray[np.float64]


class Thesis(Discretisation):
    """A joint at the start of every GBE, the same damping at each joint.

    Bodies point along the beam at their middles, between which the curvature is constant.
    """

    name = "thesis"
    column_error = (1.0, 1)
    joints_at_sections = True

    def partition(self, elements: int) -> Partition:
        """Joints at the starts of equal GBEs."""
        return Partition(np.arange(elements) / elements, np.full(elements, 1.0 / elements))

    def tangent_weights(self, elements: int, at: Array) -> Array:
        """The curvature is constant from the middle of a body to that of the next."""
        place = np.asarray(at)[:, None] * elements
        share = np.clip(place - np.arange(elements) + 0.5, 0.0, 1.0)
        share[:, 0] = 1.0
        return np.asarray(share)

    def of_top_beam(self) -> Discretisation:
        """The middle GBE reaches half a GBE to each side: joints are in the middles of GBEs."""
        return Midpoint()

    def usual_elements(self, design: GripperDesign, asked: bool) -> tuple[tuple[int, int], str]:
        """As many as in the thesis."""
        return (design.top_elements, design.beam_elements), "as in the design"
