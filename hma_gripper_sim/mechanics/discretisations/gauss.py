"""Joints at Gauss-Legendre points: fourth order and more in the GBE's length.

GBEs are as long as the points' weights.  What a beam's curvature does to its shape is an integral
along the beam, and these points integrate it best: a tip force bends a beam of two such GBEs, a
beam with a weight of its own one of three, as the continuum for small angles.  The error falls
faster than any power of the GBE's length.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.discretisations.base import Discretisation, Partition

Array = NDArray[np.float64]


class Gauss(Discretisation):
    """Joints at the Gauss-Legendre points of the top beam and of the side beam."""

    name = "gauss"
    column_error = (5.0, 4)
    fewest = 2  # a single GBE bends as a beam does under one kind of load only
    joints_slide = True

    def partition(self, elements: int) -> Partition:
        """Joints at the points, GBEs as long as their weights."""
        points, weights = legendre.leggauss(elements)
        return Partition(0.5 * (1.0 + points), 0.5 * weights)

    def tangent_weights(self, elements: int, at: Array) -> Array:
        """The curvature is the polynomial through the joints' curvatures."""
        points, weights = legendre.leggauss(elements)
        # Legendre series of the polynomial that is 1 at one joint and 0 at the others, integrated.
        values = legendre.legvander(points, elements - 1)
        series = values * (np.arange(elements) + 0.5) * weights[:, None]
        integrals = legendre.legint(series, lbnd=-1.0, axis=1)
        return np.asarray(legendre.legval(2.0 * np.asarray(at) - 1.0, integrals.T).T / weights)

    def straightening(self, parts: tuple[Partition, ...]) -> Array:
        """How much shorter than bent ones hinged GBEs are, per square of the angle [m/rad^2].

        Foreshortening is half the integral of the square of the beam's angle.  What a hinge's step
        adds to it is its product with the angle, of which Gauss points leave nothing over the whole
        length, and half the square of the difference: (a^3 + b^3) / (6 (a + b)^2) for a joint
        that is a and b from the ends of its GBE.
        """
        inner = np.concatenate(
            [part.joints - np.cumsum(part.lengths) + part.lengths for part in parts]
        )
        lengths = np.concatenate([part.lengths for part in parts])
        return np.asarray((inner**3 + (lengths - inner) ** 3) / (6.0 * lengths**2))
