"""Contours of rigid objects: convex outlines that the gripper presses on.

Every contour is a convex polygon (its core) rounded by a radius; a circle's core is a point.
Coordinates are (x, z) in the contour's own frame: x to the right, z up, the gripper's axis
at x = 0 when the object stands in the middle.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import HalfspaceIntersection, QhullError

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.units import choice, quantity, refuse_unknown

Array = NDArray[np.float64]

SMALLEST = 1e-6  # m; below this an edge or a radius is a mistake of units, not an object


class Contour(ABC):
    """A rigid convex outline."""

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


@dataclass(frozen=True)
class Circle(Contour):
    """A cylinder seen along its axis.

    Parameters
    ----------
    radius
        [m]
    """

    radius: float
    sampled_normal: ClassVar[str] = "object"

    def __post_init__(self) -> None:
        value = quantity(self.radius, "m", field="radius", source="Circle", minimum=SMALLEST)
        object.__setattr__(self, "radius", value)

    @property
    def core(self) -> Array:
        """The centre, shape (1, 2)."""
        return np.zeros((1, 2))

    @property
    def core_radius(self) -> float:
        """The radius [m]."""
        return self.radius


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

    width: float
    height: float
    corner_radius: float = 0.0

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = quantity(
                getattr(self, name), "m", field=name, source="RoundedBox", minimum=SMALLEST
            )
            object.__setattr__(self, name, value)
        value = quantity(
            self.corner_radius,
            "m",
            field="corner_radius",
            source="RoundedBox",
            minimum=0.0,
            maximum=0.5 * min(self.width, self.height),
        )
        object.__setattr__(self, "corner_radius", value)

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

    points: ArrayLike
    rounding: float = 0.0
    _core: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rounding = quantity(self.rounding, "m", field="rounding", source="Polygon", minimum=0.0)
        corners = _convex(self.points)
        object.__setattr__(self, "points", tuple((float(x), float(z)) for x, z in corners))
        object.__setattr__(self, "rounding", rounding)
        object.__setattr__(self, "_core", _inset(corners, rounding) if rounding else corners)

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


def face_normals(vertices: Array) -> Array:
    """Outward unit normals of the edges that start at each vertex, shape (m, 2)."""
    if len(vertices) == 1:
        return np.zeros((1, 2))
    edges = np.roll(vertices, -1, axis=0) - vertices
    lengths = np.linalg.norm(edges, axis=1)[:, None]
    return np.asarray(np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths)


_KINDS: dict[str, tuple[type[Contour], tuple[str, ...]]] = {
    "circle": (Circle, ("radius",)),
    "box": (RoundedBox, ("width", "height", "corner_radius")),
    "polygon": (Polygon, ("points", "rounding")),
}


def contour_from_mapping(
    mapping: Mapping[str, Any], *, source: str | None = None, field: str | None = None
) -> Contour:
    """Build a contour from fields such as ``{"type": "box", "width": "28 mm", ...}``.

    Raises
    ------
    InputError
        An unknown type or field, a missing one, or a value that cannot be used.
    """
    try:
        if not isinstance(mapping, Mapping):
            raise InputError("expected a mapping of fields")
        if "type" not in mapping:
            raise InputError(f"is missing: one of {', '.join(_KINDS)}", field="type")
        name = choice(mapping["type"], tuple(_KINDS), field="type")
        kind, known = _KINDS[name]
        refuse_unknown(mapping, ("type", *known))
        values: dict[str, Any] = {}
        for key in known:
            if key in mapping:
                values[key] = _lengths(mapping[key], key)
            elif key not in ("corner_radius", "rounding"):
                raise InputError("is missing", field=key)
        return kind(**values)
    except InputError as error:
        plain = InputError(error.reason, field=error.field)
        raise plain.within(source=source, field_prefix=field) from None


def _lengths(value: Any, field: str) -> Any:
    if isinstance(value, (list, tuple)):
        return [_lengths(item, f"{field}[{i}]") for i, item in enumerate(value)]
    return quantity(value, "m", field=field)
