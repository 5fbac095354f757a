"""What the sampled contour of a tip cannot see: what fits between two of its points."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.model.contours.base import Contour, face_normals
from hma_gripper_sim.model.gripper import Tip

Array = NDArray[np.float64]


def largest_spacing(tip: Tip) -> float:
    """Largest distance between two neighbouring points of a tip's sampled contour [m].

    The points lie on a convex curve; seen from their middle, neighbours follow each other.  The
    longest distance of all is the side that is not sampled.
    """
    points = np.array(tip.points)
    if len(points) < 3:
        return math.inf
    from_middle = points - points.mean(axis=0)
    order = np.argsort(np.arctan2(from_middle[:, 1], from_middle[:, 0]))
    around = points[order]
    distances = np.linalg.norm(np.roll(around, -1, axis=0) - around, axis=1)
    return float(np.sort(distances)[-2])


def smallest_width(contour: Contour) -> float:
    """Smallest width of an outline in any direction [m]; it is reached across one of its faces."""
    core = contour.core
    across = 0.0
    if len(core) > 2:
        heights = core @ face_normals(core).T
        across = float(np.ptp(heights, axis=0).min())
    return across + 2.0 * contour.core_radius


def hidden_depth(contour: Contour, spacing: float) -> float:
    """How far a corner of an outline reaches in between two points before they touch it [m].

    The two points lie evenly on both sides of the corner; of all corners the deepest counts.
    """
    core, radius = contour.core, contour.core_radius
    half = 0.5 * spacing
    if len(core) < 3:
        return radius - math.sqrt(max(0.0, radius**2 - half**2))
    edges = np.roll(core, -1, axis=0) - core
    direction = np.arctan2(edges[:, 1], edges[:, 0])
    turns = (direction - np.roll(direction, 1)) % (2.0 * math.pi)
    return max(_corner_depth(0.5 * (math.pi - float(turn)), radius, half) for turn in turns)


def _corner_depth(slant: float, radius: float, half: float) -> float:
    """Depth at which a rounded corner is 2 `half` wide; its faces slant by so much to its axis."""
    arc = radius * math.cos(slant)  # half the width where the rounding ends
    if half <= arc:
        return radius - math.sqrt(radius**2 - half**2)
    return radius * (1.0 - math.sin(slant)) + (half - arc) / math.tan(slant)
