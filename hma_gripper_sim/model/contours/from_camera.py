"""Outlines of objects as a camera sees them: noisy, with many points, made into convex polygons."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, QhullError

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.contours.polygon import Polygon

Array = NDArray[np.float64]

MAX_CORNERS = 32
"""Corners that are kept: a circle of them is off by 0.5 % of its radius."""

DENT = 0.01
"""Depth of a dent, relative to the outline's size, up to which it is taken for noise."""

SMALLEST, LARGEST = 1e-3, 1.0
"""Sizes of an object [m]; anything beyond is in other units."""


def polygon_from_outline(points: ArrayLike, rounding: float = 0.0) -> Polygon:
    """Return the convex polygon that an outline shows.

    Dents within the noise are filled. Of more than `MAX_CORNERS` corners those are left out, one
    after the other, that take the least area with them (Visvalingam and Whyatt, Cartogr. J. 30,
    1993); what remains stays convex.

    Parameters
    ----------
    points
        Corners (x, z) in order, either way round [m], shape (n, 2).
    rounding
        Radius of the corners [m].

    Raises
    ------
    InputError
        Fewer than three points, not finite, not in metres, not convex, or crossing itself.
    """
    corners = np.asarray(points, dtype=float)
    if corners.ndim != 2 or corners.shape[1] != 2 or len(corners) < 3:
        raise _refuse(f"expected at least three points (x, z), got shape {corners.shape}")
    if not np.isfinite(corners).all():
        raise _refuse("must be finite")
    size = float(np.ptp(corners, axis=0).max())
    if not SMALLEST <= size <= LARGEST:
        raise _refuse(
            f"is {size:.3g} m in size, must be {SMALLEST:g} m to {LARGEST:g} m: "
            "are x and z in metres?"
        )
    try:
        hull = ConvexHull(corners)
    except QhullError:
        raise _refuse("encloses no area: x and z are used, y is not") from None
    depth = -float((corners @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1).min())
    if depth > DENT * size:
        raise _refuse(
            f"not convex, by {1e3 * depth:.3g} mm: send its convex hull, or one convex part of it"
        )
    order = np.roll(hull.vertices, -int(hull.vertices.argmin()))
    if not (np.diff(order) > 0).all() and not (np.diff(order[1:]) < 0).all():
        raise _refuse("the outline crosses itself")
    return Polygon(_simplified(corners[hull.vertices]), rounding)


def _simplified(corners: Array) -> Array:
    """Leave out corners of a convex polygon, those of the smallest triangles first."""
    while len(corners) > MAX_CORNERS:
        before, after = (
            np.roll(corners, 1, axis=0) - corners,
            np.roll(corners, -1, axis=0) - corners,
        )
        triangles = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
        corners = np.delete(corners, int(triangles.argmin()), axis=0)
    return corners


def _refuse(reason: str) -> InputError:
    return InputError(reason, field="points", source="outline")
