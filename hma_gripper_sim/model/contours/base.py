"""Contours of rigid objects: convex outlines that the gripper presses on.

Every contour is a convex polygon (its core) rounded by a radius; a circle's core is a point.
Coordinates are (x, z) in the contour's own frame: x to the right, z up, the gripper's axis
at x = 0 when the object stands in the middle.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SMALLEST = 1e-6  # m; below this an edge or a radius is a mistake of units, not an object


class Contour(ABC):
    """A rigid convex outline.

    A shape is a frozen dataclass in a file of its own in this room.  It says how it is called in
    files and declares its numbers; files, the node's parameters and their documentation go by that.
    """

    kind: ClassVar[str]
    """What the shape is called in files and parameters."""

    sampled_normal: ClassVar[str] = "tip"
    """Whose normal sampled contact forces have unless a scene says otherwise, as in the thesis."""

    @property
    @abstractmethod
    def core(self) -> Array:
        """Counter-clockwise vertices of the polygon to be rounded [m], shape (m, 2)."""

    @property
    @abstractmethod
    def core_radius(self) -> float:
        """Rounding around the core [m]."""

    @property
    def is_symmetric(self) -> bool:
        """Whether the outline is its own mirror image in the line x = 0."""
        core = self.core
        mirrored = core * (-1.0, 1.0)
        apart = np.linalg.norm(core[:, None, :] - mirrored[None, :, :], axis=2)
        return bool(apart.min(axis=1).max() <= 1e-12)

    def outline(self, points_per_turn: int = 90) -> Array:
        """Closed outline for drawing [m], shape (k, 2); the last point repeats the first."""
        core, radius = self.core, self.core_radius
        if radius == 0.0:
            return np.vstack([core, core[:1]])
        pieces = []
        for i, vertex in enumerate(core):
            before = vertex - core[i - 1]
            after = core[(i + 1) % len(core)] - vertex
            start = math.atan2(-before[0], before[1])
            turn = (math.atan2(-after[0], after[1]) - start) % (2.0 * math.pi)
            whole_turn = len(core) == 1
            if whole_turn:
                turn = 2.0 * math.pi
            count = max(2, math.ceil(points_per_turn * turn / (2.0 * math.pi)) + 1)
            angle = start + turn * np.linspace(0.0, 1.0, count, endpoint=not whole_turn)
            pieces.append(vertex + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
        closed = np.vstack(pieces)
        return np.vstack([closed, closed[:1]])


def face_normals(vertices: Array) -> Array:
    """Outward unit normals of the edges that start at each vertex, shape (m, 2)."""
    if len(vertices) == 1:
        return np.zeros((1, 2))
    edges = np.roll(vertices, -1, axis=0) - vertices
    lengths = np.linalg.norm(edges, axis=1)[:, None]
    return np.asarray(np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths)
