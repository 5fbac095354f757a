"""Convex polygons."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import HalfspaceIntersection, QhullError

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.contours.base import SMALLEST, Contour, face_normals
from hma_gripper_sim.model.numbers import check_numbers, number

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Polygon(Contour):
    """A convex polygon, its corners optionally rounded (the faces stay where they are).

    Parameters
    ----------
    points
        Corners (x, z) in order, either way round [m], shape (n, 2).
    rounding
        Radius of the corners [m].
    """

    kind: ClassVar[str] = "polygon"

    points: ArrayLike = field(
        metadata=number("m", "Corners of a convex polygon: x1, z1, x2, z2, ... [m].", many=True)
    )
    rounding: float = field(
        default=0.0, metadata=number("m", "Radius of the corners of a polygon [m].", minimum=0.0)
    )
    _core: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        check_numbers(self)
        corners = _convex(self.points)
        object.__setattr__(self, "points", tuple((float(x), float(z)) for x, z in corners))
        core = _inset(corners, self.rounding) if self.rounding else corners
        object.__setattr__(self, "_core", core)

    @property
    def core_radius(self) -> float:
        """The rounding [m]."""
        return self.rounding

    @property
    def core(self) -> Array:
        """Counter-clockwise corners of the polygon, moved inwards by the rounding."""
        return self._core


def _convex(points: ArrayLike) -> Array:
    """Return the corners counter-clockwise, without repeated and collinear ones."""

    def refuse(reason: str) -> InputError:
        return InputError(reason, field="points", source="Polygon")

    try:
        corners = np.array(points, dtype=float)
    except (TypeError, ValueError):
        raise refuse("expected numbers (x, z) for each corner") from None
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise refuse(f"expected at least three corners (x, z), got shape {corners.shape}")
    if not np.isfinite(corners).all():
        raise refuse("must be finite")
    if np.allclose(corners[0], corners[-1], rtol=0.0, atol=1e-12):
        corners = corners[:-1]
    size = float(np.ptp(corners, axis=0).max())
    if size < SMALLEST:
        raise refuse(f"smaller than {SMALLEST:g} m: are the units metres?")
    edges = np.roll(corners, -1, axis=0) - corners
    if np.linalg.norm(edges, axis=1).min() < 1e-9 * size:
        raise refuse("two neighbouring corners coincide")
    following = np.roll(edges, -1, axis=0)
    turns = np.arctan2(
        edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0],
        np.einsum("ij,ij->i", edges, following),
    )
    if turns.sum() < 0.0:
        corners, turns = corners[::-1], -np.roll(turns[::-1], -1)
    if abs(turns.sum() - 2.0 * math.pi) > 1e-6:
        raise refuse("the outline crosses itself")
    if turns.min() < -1e-9:
        raise refuse("not convex: split the object or take its convex hull")
    bends = np.roll(turns, 1) > 1e-9
    if bends.sum() < 3:
        raise refuse("encloses no area")
    return np.asarray(corners[bends])


def _inset(corners: Array, distance: float) -> Array:
    """Move the faces of a convex polygon inwards; faces that vanish are dropped."""
    normals, offsets = _faces(corners)
    halfplanes = np.column_stack([normals, distance - offsets])
    centre = corners.mean(axis=0)
    try:
        if (normals @ centre + distance - offsets).max() >= 0.0:
            centre = _deepest_point(normals, offsets, distance)
        vertices = HalfspaceIntersection(halfplanes, centre).intersections
    except (QhullError, ValueError):
        raise InputError(
            f"too large for this polygon, got {distance:g} m", field="rounding", source="Polygon"
        ) from None
    middle = vertices.mean(axis=0)
    order = np.argsort(np.arctan2(vertices[:, 1] - middle[1], vertices[:, 0] - middle[0]))
    vertices = vertices[order]
    apart = np.linalg.norm(vertices - np.roll(vertices, 1, axis=0), axis=1)
    return np.asarray(vertices[apart > 1e-12])


def _deepest_point(normals: Array, offsets: Array, distance: float) -> Array:
    from scipy.optimize import linprog

    solution = linprog(
        [0.0, 0.0, -1.0],
        A_ub=np.column_stack([normals, np.ones(len(normals))]),
        b_ub=offsets,
        bounds=[(None, None), (None, None), (0.0, None)],
    )
    if not solution.success or solution.x[2] <= distance:
        raise ValueError("nothing is left inside")
    return np.asarray(solution.x[:2])


def _faces(vertices: Array) -> tuple[Array, Array]:
    normals = face_normals(vertices)
    return normals, np.einsum("ij,ij->i", normals, vertices)
