"""Contours: their geometry against formulas, and everything that is no convex object."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from patience import patience
from scipy.spatial import ConvexHull

from hma_gripper_sim import Circle, Contour, InputError, Polygon, RoundedBox
from hma_gripper_sim.model.contours.base import face_normals
from hma_gripper_sim.model.contours.shapes import contour_from_mapping

SQUARE = [(0.0, 0.0), (0.02, 0.0), (0.02, 0.02), (0.0, 0.02)]


def area(outline: np.ndarray) -> float:
    """Area of a closed polygon by the shoelace formula; positive when counter-clockwise."""
    x, z = outline[:, 0], outline[:, 1]
    return 0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z))


def regular(n: int, radius: float = 0.015) -> np.ndarray:
    """Corners of a regular polygon, one of them on top, shape (n, 2)."""
    angle = 0.5 * math.pi + 2.0 * math.pi * np.arange(n) / n
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(
    ("contour", "wanted"),
    [
        (Circle(0.015), math.pi * 0.015**2),
        (RoundedBox(0.028, 0.02), 0.028 * 0.02),
        (RoundedBox(0.028, 0.02, 0.002), 0.028 * 0.02 - (4.0 - math.pi) * 0.002**2),
        (RoundedBox(0.028, 0.02, 0.01), 0.008 * 0.02 + math.pi * 0.01**2),
        (RoundedBox(0.02, 0.02, 0.01), math.pi * 0.01**2),
        (Polygon(SQUARE), 4e-4),
        (Polygon(SQUARE, rounding=0.003), 4e-4 - (4.0 - math.pi) * 0.003**2),
        (Polygon(SQUARE[::-1], rounding=0.003), 4e-4 - (4.0 - math.pi) * 0.003**2),
    ],
    ids=repr,
)
def test_outline(contour: Contour, wanted: float) -> None:
    """The outline is closed, convex, counter-clockwise, and encloses the right area.

    A circle drawn with 2000 corners lacks 1.6e-6 of its area.
    """
    outline = contour.outline(points_per_turn=2000)
    np.testing.assert_array_equal(outline[0], outline[-1])
    assert area(outline) == pytest.approx(wanted, rel=3e-6)
    assert ConvexHull(outline).volume == pytest.approx(area(outline), rel=1e-9)


def test_core_is_counter_clockwise_and_rounded_back_to_the_faces() -> None:
    """Core plus radius reaches exactly the faces of box and polygon."""
    for contour in (RoundedBox(0.028, 0.02, 0.002), Polygon(SQUARE, 0.002), Polygon(SQUARE)):
        core, radius = contour.core, contour.core_radius
        assert area(core) > 0.0
        outline = contour.outline()
        low, high = core.min(axis=0) - radius, core.max(axis=0) + radius
        np.testing.assert_allclose(outline.min(axis=0), low, atol=1e-15)
        np.testing.assert_allclose(outline.max(axis=0), high, atol=1e-15)
    np.testing.assert_allclose(
        np.ptp(RoundedBox(0.028, 0.02, 0.002).outline(), axis=0), [0.028, 0.02]
    )


def test_face_normals_point_outwards() -> None:
    """Perpendicular to the edge, of length one, away from the middle."""
    corners = Polygon(regular(7)).core
    normals = face_normals(corners)
    edges = np.roll(corners, -1, axis=0) - corners
    np.testing.assert_allclose(np.einsum("ij,ij->i", normals, edges), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-14)
    middles = corners + 0.5 * edges
    assert np.einsum("ij,ij->i", normals, middles).min() > 0.0


@pytest.mark.parametrize(
    ("contour", "symmetric"),
    [
        (Circle(0.015), True),
        (RoundedBox(0.028, 0.02, 0.002), True),
        (Polygon(regular(5)), True),
        (Polygon(regular(40)), True),
        (Polygon(SQUARE), False),  # not around x = 0
        (Polygon(np.array(SQUARE) - 0.01), True),
        (Polygon([(-0.01, 0.0), (0.012, 0.0), (0.0, 0.01)]), False),
    ],
    ids=repr,
)
def test_symmetry(contour: Contour, symmetric: bool) -> None:
    """Symmetric means the same mirrored in x = 0."""
    assert contour.is_symmetric is symmetric


def test_polygon_drops_what_says_nothing() -> None:
    """Clockwise order, a repeated first corner and corners within an edge change nothing."""
    plain = Polygon(SQUARE).core
    for points in (
        SQUARE[::-1],
        [*SQUARE, SQUARE[0]],
        [(0.0, 0.0), (0.01, 0.0), (0.02, 0.0), (0.02, 0.02), (0.01, 0.02), (0.0, 0.02)],
        np.array(SQUARE),
    ):
        core = Polygon(points).core
        assert {tuple(p) for p in core} == {tuple(p) for p in plain}
        assert area(core) == pytest.approx(4e-4)


def test_contours_are_values() -> None:
    """Equal when their fields are, whatever container the corners came in."""
    assert Polygon(SQUARE) == Polygon(np.array(SQUARE))
    assert hash(Polygon(SQUARE)) == hash(Polygon(tuple(SQUARE)))
    assert Polygon(SQUARE) != Polygon(SQUARE, rounding=1e-3)
    assert Circle(0.015) == Circle(0.015)


@pytest.mark.parametrize("rounding", [0.0099, 0.005])
def test_inset_of_a_polygon(rounding: float) -> None:
    """The core's faces lie `rounding` inside the polygon's faces, all around."""
    points = np.array([(0.0, 0.0), (0.03, 0.0), (0.035, 0.02), (0.01, 0.025)])
    polygon = Polygon(points, rounding=min(rounding, 0.009))
    core = polygon.core
    normals = face_normals(points)
    offsets = np.einsum("ij,ij->i", normals, points)
    reach = (core @ normals.T).max(axis=0)
    np.testing.assert_allclose(reach, offsets - polygon.rounding, atol=1e-12)


def test_a_short_face_vanishes_under_a_large_rounding() -> None:
    """A cut corner of 0.1 mm is lost under a rounding of 5 mm: four faces remain."""
    cut = [(0.0, 0.0), (0.02, 0.0), (0.02, 0.0199), (0.0199, 0.02), (0.0, 0.02)]
    assert len(Polygon(cut).core) == 5
    assert len(Polygon(cut, rounding=0.005).core) == 4


NUMBERS = [math.nan, math.inf, -math.inf, -0.01, "28 kg", "wide", None, True, [0.01], {}]


@pytest.mark.parametrize("value", NUMBERS, ids=repr)
def test_bad_numbers(value: Any) -> None:
    """Every dimension of every contour: one InputError naming class and field."""
    for build, source, field in (
        (lambda: Circle(value), "Circle", "radius"),
        (lambda: RoundedBox(value, 0.02), "RoundedBox", "width"),
        (lambda: RoundedBox(0.02, value), "RoundedBox", "height"),
        (lambda: RoundedBox(0.02, 0.02, value), "RoundedBox", "corner_radius"),
        (lambda: Polygon(SQUARE, value), "Polygon", "rounding"),
    ):
        with pytest.raises(InputError) as refusal:
            build()
        assert (refusal.value.source, refusal.value.field) == (source, field)
        assert refusal.value.reason


@pytest.mark.parametrize(
    ("build", "field"),
    [
        (lambda: Circle(0.0), "radius"),
        (lambda: RoundedBox(0.0, 0.02), "width"),
        (lambda: RoundedBox(0.02, 1e-9), "height"),
        (lambda: RoundedBox(0.028, 0.02, 0.0101), "corner_radius"),
        (lambda: Polygon(SQUARE, 0.0101), "rounding"),
        (lambda: Polygon(SQUARE, 1.0), "rounding"),
        (lambda: Polygon(SQUARE, 0.01), "rounding"),
    ],
)
def test_dimensions_that_do_not_fit(build: object, field: str) -> None:
    """Nothing without extent, no rounding larger than the object."""
    assert callable(build)
    with pytest.raises(InputError) as refusal:
        build()
    assert refusal.value.field == field


STAR = [(math.cos(a), math.sin(a)) for a in (0.0, 2.513, 5.027, 1.257, 3.770)]


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        ([], "at least three corners"),
        ([(0, 0), (1, 0)], "at least three corners"),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], "at least three corners"),
        ([0.0, 1.0, 2.0], "at least three corners"),
        ([(0, 0), (1, 0), (0,)], "expected numbers"),
        ([(0, 0), (1, 0), ("a", 1)], "expected numbers"),
        ([(0, 0), (1, 0), (None, 1)], ""),
        ("square", "expected numbers"),
        (None, ""),
        (3.0, "at least three corners"),
        ({"a": 1}, "expected numbers"),
        ([(0, 0), (0.02, 0), (math.nan, 0.02)], "finite"),
        ([(0, 0), (0.02, 0), (math.inf, 0.02)], "finite"),
        ([(0, 0), (1e-9, 0), (0, 1e-9)], "are the units metres"),
        ([(0, 0), (0, 0), (0, 0)], "are the units metres"),
        ([(0, 0), (0.02, 0), (0.02, 0), (0, 0.02)], "coincide"),
        ([(0, 0), (0.02, 0.02), (0.02, 0), (0, 0.02)], "crosses itself"),
        (STAR, "crosses itself"),
        ([*regular(5), *regular(5)], "crosses itself"),
        ([(0, 0), (0.02, 0), (0.005, 0.005), (0, 0.02)], "not convex"),
        ([(0, 0), (0.01, 0), (0.02, 0)], ""),
        ([(0, 0), (0.02, 0), (0.01, 0)], ""),
        ([(0, 0), (0.02, 0), (0.02, 1e-13), (0, 1e-13)], ""),
    ],
)
def test_bad_polygons(points: object, reason: str) -> None:
    """Self-crossing, dented, degenerate or no polygon at all."""
    with pytest.raises(InputError) as refusal:
        Polygon(points)  # type: ignore[arg-type]
    assert (refusal.value.source, refusal.value.field) == ("Polygon", "points")
    assert reason in refusal.value.reason


@pytest.mark.parametrize("seed", range(30))
def test_any_four_corners_are_taken_or_refused(seed: int) -> None:
    """Random quadrilaterals: taken exactly when they are in convex position and in order."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.02, 0.02, size=(4, 2))
    hull = list(ConvexHull(points).vertices)
    start = hull.index(0) if 0 in hull else 0
    order = hull[start:] + hull[:start]
    convex = order in ([0, 1, 2, 3], [0, 3, 2, 1])
    if convex:
        assert abs(area(Polygon(points).core)) == pytest.approx(abs(area(points)))
    else:
        with pytest.raises(InputError, match=r"crosses itself|not convex"):
            Polygon(points)


def test_from_mapping() -> None:
    """A mapping with units gives the contour that Python would build."""
    assert contour_from_mapping({"type": "circle", "radius": "15 mm"}) == Circle(0.015)
    assert contour_from_mapping({"type": "box", "width": "28 mm", "height": 0.02}) == RoundedBox(
        0.028, 0.02
    )
    points = [["0 mm", 0], ["20 mm", 0], [0.02, 0.02], [0, "2 cm"]]
    assert contour_from_mapping(
        {"type": "polygon", "points": points, "rounding": "1 mm"}
    ) == Polygon(SQUARE, 0.001)


@pytest.mark.parametrize(
    ("mapping", "field"),
    [
        ({}, "type"),
        ({"type": "ellipse"}, "type"),
        ({"type": None}, "type"),
        ({"type": ["box"]}, "type"),
        ({"type": "circle"}, "radius"),
        ({"type": "circle", "radius": "15 kg"}, "radius"),
        ({"type": "circle", "radius": math.nan}, "radius"),
        ({"type": "circle", "radius": [1]}, "radius"),
        ({"type": "circle", "radius": 0.015, "colour": "red"}, "colour"),
        ({"type": "circle", "radius": 0.015, "width": 0.1}, "width"),
        ({"type": "box", "width": 0.02}, "height"),
        ({"type": "box", "width": 0.02, "height": 0.02, "corner_radius": "1 s"}, "corner_radius"),
        ({"type": "polygon"}, "points"),
        ({"type": "polygon", "points": [[0, 0], [1, "x"], [0, 1]]}, "points[1][1]"),
        ({"type": "polygon", "points": [[0, 0], [1, math.nan], [0, 1]]}, "points[1][1]"),
        ({"type": "polygon", "points": "square"}, "points"),
        ({"type": "polygon", "points": None}, "points"),
        ({"type": "polygon", "points": [[0, 0], [0.02, 0.02], [0.02, 0], [0, 0.02]]}, "points"),
        ({"type": "polygon", "points": SQUARE, "rounding": 1.0}, "rounding"),
    ],
)
def test_bad_mapping(mapping: dict[str, object], field: str) -> None:
    """File, dotted field and reason, seen from the file that holds the contour."""
    with pytest.raises(InputError) as refusal:
        contour_from_mapping(mapping, source="scene.yaml", field="contours.mine")
    assert refusal.value.source == "scene.yaml"
    assert refusal.value.field == f"contours.mine.{field}"
    assert str(refusal.value).startswith(f"scene.yaml: contours.mine.{field}: ")


@pytest.mark.parametrize("mapping", [None, 3, "box", ["box"], []])
def test_no_mapping(mapping: object) -> None:
    """Something else where a contour is expected."""
    with pytest.raises(InputError, match=r"scene.yaml: contours.mine: expected a mapping"):
        contour_from_mapping(mapping, source="scene.yaml", field="contours.mine")  # type: ignore[arg-type]


DIAMOND = '''
"""Squares that stand on a corner."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.model.contours.base import SMALLEST, Contour
from hma_gripper_sim.model.numbers import check_numbers, number


@dataclass(frozen=True)
class Diamond(Contour):
    """A square that stands on a corner."""

    kind: ClassVar[str] = "diamond"

    radius: float = field(metadata=number("m", "Half a diamond's diagonal [m].", minimum=SMALLEST))

    def __post_init__(self) -> None:
        check_numbers(self)

    @property
    def core(self) -> NDArray[np.float64]:
        """Its corners."""
        return self.radius * np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])

    @property
    def core_radius(self) -> float:
        """Its corners are sharp."""
        return 0.0
'''

USES = """
import sys
from hma_gripper_sim import simulate
from hma_gripper_sim.model import contours

contours.__path__.append(sys.argv[1])
from hma_gripper_sim.device.settings import Settings
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.experiments.node_parameters import node_parameters
from hma_gripper_sim.replay.simulated_settings import flat

read = read_experiment(sys.argv[1] + "/diamond.yaml")
scene = Settings.parse(flat(node_parameters([read]))).scenes["mine"]
assert scene.contour == read.contour, scene.contour
trace = simulate(scene, 0.004, 2.0)
assert trace.actuator_force.max() > 0.05
print(type(scene.contour).__name__)
"""


def test_a_new_shape_is_one_new_file(tmp_path: Path) -> None:
    """Experiments and the node's parameters know it, and the solver presses on it."""
    (tmp_path / "diamond.py").write_text(DIAMOND)
    (tmp_path / "diamond.yaml").write_text("""
title: a diamond
source: made up
scene:
  contour: {name: mine, type: diamond, radius: 14 mm}
  clearance: 4 mm
  friction: 0.6
  contact: continuous
motion: [{velocity: 4 mm/s, duration: 7 s}]
""")
    done = subprocess.run(
        [sys.executable, "-c", USES, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=patience(300.0),
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "Diamond\n"
