"""Scenes: where the object stands, what is chosen, and what is refused."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from hma_gripper_sim import Circle, Contour, GripperDesign, InputError, Polygon, RoundedBox, Scene

CONTOURS: dict[str, Contour] = {
    "circle": Circle(0.015),
    "box": RoundedBox(0.028, 0.028, 0.002),
    "sharp": RoundedBox(0.028, 0.028),
    "wide": RoundedBox(0.08, 0.01, 0.001),
    "roof": Polygon([(-0.02, 0.0), (0.02, 0.0), (0.0, 0.02)], 0.001),
    "lopsided": Polygon([(-0.02, 0.0), (0.015, -0.003), (0.008, 0.02)]),
}


def stress_free_tip(design: GripperDesign, points: np.ndarray, side: float) -> np.ndarray:
    """World coordinates of points of the tip's frame, undeformed at travel 0, shape (k, 2)."""
    along = np.exp(1j * math.radians(-83.0))
    origin = 9.55e-3 - 2e-3j + 43e-3 * along
    placed = origin + (points[:, 0] + 1j * points[:, 1]) * along
    return np.column_stack([side * placed.real, placed.imag])


def outline_distance(outline: np.ndarray, points: np.ndarray) -> float:
    """Smallest distance of points to a closed outline, by projection on all its edges [m]."""
    start, edge = outline[:-1], np.diff(outline, axis=0)
    proper = np.linalg.norm(edge, axis=1) > 0.0
    start, edge = start[proper], edge[proper]
    smallest = math.inf
    for point in points:
        share = np.einsum("ij,ij->i", point - start, edge) / np.einsum("ij,ij->i", edge, edge)
        feet = start + np.clip(share, 0.0, 1.0)[:, None] * edge
        smallest = min(smallest, float(np.linalg.norm(point - feet, axis=1).min()))
    return smallest


def gap_after(scene: Scene, travel: float) -> float:
    """Gap of the stress-free gripper, lowered by `travel`, to the object's outline [m]."""
    tip = scene.design.tip
    if scene.contact == "continuous":
        ends = np.array([tip.capsule_start, tip.capsule_end])
        points = ends[0] + np.linspace(0.0, 1.0, 401)[:, None] * (ends[1] - ends[0])
        radius = tip.radius
    else:
        points, radius = np.array(tip.points), 0.0
    outline = scene.contour.outline(2000) + scene.object_position
    gaps = [
        outline_distance(outline, stress_free_tip(scene.design, points, side) - (0.0, travel))
        for side in (1.0, -1.0)
    ]
    return min(gaps) - radius


@pytest.mark.parametrize("offset", [0.0, 0.004])
@pytest.mark.parametrize("contact", ["continuous", "sampled"])
@pytest.mark.parametrize("name", CONTOURS)
def test_first_touch_after_the_clearance(
    design: GripperDesign, name: str, contact: str, offset: float
) -> None:
    """Lowered by the clearance the stress-free tip just touches the object; before it does not.

    Distances by projection on outlines drawn with 2000 points per turn and 401 points of the
    capsule's axis: good to 1e-7 m.
    """
    scene = Scene(design, CONTOURS[name], contact=contact, offset=offset, clearance=0.004)
    assert gap_after(scene, 0.004) == pytest.approx(0.0, abs=2e-7)
    for travel in (0.0, 0.0039):
        assert gap_after(scene, travel) > 1e-5


@pytest.mark.parametrize("discretisation", ["thesis", "midpoint", "gauss"])
def test_placement_does_not_depend_on_the_resolution(
    design: GripperDesign, discretisation: str
) -> None:
    """The stress-free gripper is the same for every number of GBEs."""
    base = Scene(design, Circle(0.015)).object_position
    for beam in (3, 8, 40):
        scene = Scene(
            design,
            Circle(0.015),
            discretisation=discretisation,
            elements_top=2,
            elements_beam=beam,
        )
        assert scene.object_position == pytest.approx(base, abs=1e-13)


def test_clearance_and_offset_place_the_object(design: GripperDesign) -> None:
    """More clearance is further down by as much; the offset is the object's x."""
    near = Scene(design, Circle(0.015), clearance=0.001).object_position
    far = Scene(design, Circle(0.015), clearance=0.011).object_position
    assert far[1] - near[1] == pytest.approx(-0.010, abs=1e-13)
    assert Scene(design, Circle(0.015), offset=-0.003).object_position[0] == -0.003


def test_object_that_passes_between_the_tips(design: GripperDesign) -> None:
    """Its top lies the clearance below the tips' lowest points."""
    for contact, drop in (("continuous", design.tip.radius), ("sampled", 0.0)):
        scene = Scene(design, Circle(0.002), contact=contact, clearance=0.004)
        tip = design.tip
        points = np.array(
            [tip.capsule_start, tip.capsule_end] if contact == "continuous" else tip.points
        )
        lowest = stress_free_tip(design, points, 1.0)[:, 1].min() - drop
        top = scene.object_position[1] + 0.002
        assert top == pytest.approx(lowest - 0.004, abs=1e-12)


def test_defaults(design: GripperDesign) -> None:
    """63 joints of the thesis; normals of the object for circles, of the tip otherwise."""
    scene = Scene(design, Circle(0.015))
    assert len(scene.joint_names) == 63
    assert scene.sampled_normal == "object"
    assert Scene(design, CONTOURS["box"]).sampled_normal == "tip"
    assert Scene(design, CONTOURS["roof"]).sampled_normal == "tip"
    assert scene.slip_velocity == 0.0
    assert scene.is_symmetric
    assert not dataclasses.replace(scene, offset=1e-6).is_symmetric
    assert not dataclasses.replace(scene, symmetry=False).is_symmetric
    assert not Scene(design, CONTOURS["lopsided"]).is_symmetric
    few = Scene(design, Circle(0.015), discretisation="midpoint")
    assert len(few.joint_names) == 21


def test_scene_is_a_value(design: GripperDesign) -> None:
    """Equal, replaceable, frozen."""
    scene = Scene(design, Circle(0.015))
    assert scene == Scene(design, Circle(0.015))
    assert dataclasses.replace(scene, friction=0.7) != scene
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.friction = 0.7  # type: ignore[misc]


NUMBERS = [math.nan, math.inf, -math.inf, "3 candela", "much", None, True, [0.6], {}, 1j]


@pytest.mark.parametrize("value", NUMBERS, ids=repr)
@pytest.mark.parametrize(
    "field",
    [
        "friction",
        "clearance",
        "offset",
        "normal_stiffness",
        "normal_damping",
        "slip_velocity",
        "gravity",
    ],
)
def test_bad_numbers(design: GripperDesign, field: str, value: Any) -> None:
    """Every number of a scene: InputError with class and field."""
    with pytest.raises(InputError) as refusal:
        Scene(design, Circle(0.015), **{field: value})
    assert (refusal.value.source, refusal.value.field) == ("Scene", field)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("friction", -0.1),
        ("clearance", -1e-6),
        ("normal_damping", -1.0),
        ("slip_velocity", -1e-9),
        ("gravity", -9.81),
        ("normal_stiffness", 0.0),
        ("normal_stiffness", -1.0),
        ("contact", "penalty"),
        ("contact", None),
        ("contact", 3),
        ("discretisation", "rigid"),
        ("discretisation", 2),
        ("elements_top", 0),
        ("elements_top", 1.5),
        ("elements_beam", -8),
        ("elements_beam", "8"),
        ("elements_beam", math.nan),
        ("elements_beam", True),
        ("sampled_normal", "world"),
        ("sampled_normal", 0),
        ("symmetry", True),
        ("symmetry", 1),
        ("symmetry", "no"),
        ("contour", None),
        ("contour", "circle"),
        ("contour", Circle),
        ("design", None),
        ("design", "thesis"),
        ("design", GripperDesign),
    ],
)
def test_bad_choices(design: GripperDesign, field: str, value: Any) -> None:
    """Ranges, choices and types: InputError with class, field and a reason."""
    arguments: dict[str, Any] = {"design": design, "contour": Circle(0.015), field: value}
    with pytest.raises(InputError) as refusal:
        Scene(**arguments)
    assert (refusal.value.source, refusal.value.field) == ("Scene", field)
    assert refusal.value.reason
