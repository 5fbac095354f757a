"""The gripper's physical description against the thesis, and its way to YAML and back."""

from __future__ import annotations

import copy
import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from hma_gripper_sim import GripperDesign, InputError, Material, Tip


@pytest.fixture
def mapping(design: GripperDesign, tmp_path: Path) -> dict[str, Any]:
    """The thesis' design as the nested fields of its YAML file."""
    path = tmp_path / "design.yaml"
    design.to_yaml(path)
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert isinstance(content, dict)
    return content


def put(mapping: dict[str, Any], field: str, value: object) -> dict[str, Any]:
    """A copy of nested fields with one of them replaced."""
    changed = copy.deepcopy(mapping)
    *sections, last = field.split(".")
    owner = changed
    for section in sections:
        owner = owner[section]
    owner[last] = value
    return changed


def test_figures_of_the_thesis(design: GripperDesign) -> None:
    """Section, stiffness, masses (thesis 3.2, A.1, B.1), to the digits they are given with.

    I = h w^3 / 12, EI = 3.3227e-4 N m^2, tip 0.76832 g, whole gripper 4.53 g, phi_0 = 97 degrees.
    """
    assert design.second_moment_of_area == pytest.approx(3.7333e-11, rel=1e-5)
    assert design.bending_stiffness == pytest.approx(3.3227e-4, rel=2e-5)
    assert design.tip_mass == pytest.approx(0.76832e-3, rel=1e-12)
    assert design.mass == pytest.approx(4.53e-3, rel=1e-3)
    assert design.line_density * 2.1e-3 == pytest.approx(0.057624e-3, rel=1e-12)
    assert design.line_density * 1.72e-3 == pytest.approx(0.0471968e-3, rel=1e-12)
    assert design.damping_length == pytest.approx(1.72e-3, rel=1e-12)
    assert design.corner == pytest.approx((9.55e-3, -2e-3), rel=1e-12)
    assert design.top_end == pytest.approx(11.55e-3, rel=1e-12)
    assert math.degrees(design.beam_angle) == pytest.approx(7.0, rel=1e-15)


def test_mass_is_that_of_all_parts(design: GripperDesign) -> None:
    """11 top GBEs of 0.057624 g, 50 beam GBEs of 0.0471968 g, two tips of 0.76832 g."""
    assert design.mass == pytest.approx(
        11 * 0.057624e-3 + 50 * 0.0471968e-3 + 2 * 0.76832e-3, rel=1e-12
    )


def test_capsule_is_the_contour_that_the_points_sample(design: GripperDesign) -> None:
    """Each sampled point lies on the capsule, and its normal angle is the capsule's normal there.

    Twelve points to the nine digits they are printed with; the last two (CS_t13, CS_t14) up to
    5 micrometres inside, with angles good to a quarter of a degree.
    """
    tip = design.tip
    start, end = np.array(tip.capsule_start), np.array(tip.capsule_end)
    checked: list[np.ndarray] = []
    for point, angle in zip(np.array(tip.points), tip.normal_angles, strict=True):
        along = np.clip((point - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
        outwards = point - (start + along * (end - start))
        accuracy = 2e-12 if len(checked) < 12 else 6e-6
        checked.append(point)
        assert np.linalg.norm(outwards) == pytest.approx(tip.radius, abs=accuracy)
        normal = np.array([math.cos(angle), math.sin(angle)])
        assert normal @ outwards / np.linalg.norm(outwards) > math.cos(math.radians(0.25))


def test_bending_stress(design: GripperDesign) -> None:
    """sigma = M z / I with z = w / 2 (thesis Eq. 5.1), whatever the moment's sign."""
    assert design.bending_stress(5.41e-3) == pytest.approx(5.41e-3 * 2e-3 / 3.73333e-11, rel=1e-5)
    assert design.bending_stress(-5.41e-3) == design.bending_stress(5.41e-3)


def test_design_is_frozen_and_comparable(design: GripperDesign) -> None:
    """A design is a value."""
    assert design == GripperDesign.thesis_2013()
    assert hash(design) == hash(GripperDesign.thesis_2013())
    with pytest.raises(dataclasses.FrozenInstanceError):
        design.width = 1.0  # type: ignore[misc]


@pytest.mark.parametrize("factor", [1.0, 1.0 / 3.0, math.pi])
def test_yaml_round_trip_is_exact(design: GripperDesign, tmp_path: Path, factor: float) -> None:
    """Written and read back, every float has every bit, also where decimals do not end."""
    odd = dataclasses.replace(
        design,
        beam_length=0.043 * factor,
        joint_damping=0.01 * factor,
        tip=dataclasses.replace(design.tip, radius=0.002 * factor, inertia=2e-8 * factor),
    )
    path = tmp_path / "design.yaml"
    odd.to_yaml(path)
    assert GripperDesign.from_yaml(path) == odd
    assert GripperDesign.from_yaml(str(path)) == odd


def test_units_in_yaml(mapping: dict[str, Any], design: GripperDesign) -> None:
    """Texts with units are as good as SI numbers."""
    for field, text in {
        "width": "4 mm",
        "beam_angle": "7 degree",
        "material.youngs_modulus": "8.9 MPa",
        "material.density": "0.98 g/cm^3",
        "tip.area": "1.12 cm^2",
        "joint_damping": "10 mN*m*s/rad",
    }.items():
        mapping = put(mapping, field, text)
    read = GripperDesign.from_mapping(mapping)
    assert read.width == pytest.approx(design.width, rel=1e-14)
    assert read.beam_angle == pytest.approx(design.beam_angle, rel=1e-14)
    assert read.material.youngs_modulus == pytest.approx(8.9e6, rel=1e-14)
    assert read.material.density == pytest.approx(980.0, rel=1e-14)
    assert read.tip.area == pytest.approx(1.12e-4, rel=1e-14)
    assert read.joint_damping == pytest.approx(0.01, rel=1e-14)


NUMBERS = (
    "width",
    "height",
    "top_length",
    "beam_length",
    "beam_angle",
    "joint_damping",
    "material.density",
    "material.youngs_modulus",
    "material.stress_limit",
    "tip.area",
    "tip.inertia",
    "tip.radius",
)


@pytest.mark.parametrize("value", [math.nan, math.inf, "3 candela", "wide", None, True, [], {}])
@pytest.mark.parametrize("field", NUMBERS)
def test_bad_number(mapping: dict[str, Any], field: str, value: object) -> None:
    """Every number: not finite, of another dimension, of another type."""
    with pytest.raises(InputError) as refusal:
        GripperDesign.from_mapping(put(mapping, field, value), source="design.yaml")
    assert refusal.value.field == field
    assert str(refusal.value).startswith(f"design.yaml: {field}: ")


@pytest.mark.parametrize("value", [0.0, -1.0])
@pytest.mark.parametrize("field", [n for n in NUMBERS if n not in ("beam_angle", "joint_damping")])
def test_not_positive(mapping: dict[str, Any], field: str, value: float) -> None:
    """Lengths, masses and stiffnesses are positive."""
    with pytest.raises(InputError, match="must be greater than 0") as refusal:
        GripperDesign.from_mapping(put(mapping, field, value), source="design.yaml")
    assert refusal.value.field == field
    assert refusal.value.source == "design.yaml"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("top_elements", 0),
        ("top_elements", 2.5),
        ("beam_elements", -1),
        ("beam_elements", math.nan),
        ("beam_elements", "25"),
        ("beam_elements", True),
        ("beam_angle", 2.0),
        ("beam_angle", "100 degree"),
        ("joint_damping", -0.01),
        ("tip.centre_of_gravity", 3.0),
        ("tip.centre_of_gravity", [1.0]),
        ("tip.centre_of_gravity", [1.0, 2.0, 3.0]),
        ("tip.capsule_start", "1, 2"),
        ("tip.points", []),
        ("tip.points", 3.0),
        ("tip.points", [[0.0, 0.0], 1.0]),
        ("tip.normal_angles", [0.0]),
        ("tip.normal_angles", 1.0),
        ("material", 3.0),
        ("material", None),
        ("tip", []),
    ],
)
def test_inconsistent_value(mapping: dict[str, Any], field: str, value: object) -> None:
    """Counts, ranges, points and sections of the wrong shape are named with file and field."""
    with pytest.raises(InputError) as refusal:
        GripperDesign.from_mapping(put(mapping, field, value), source="design.yaml")
    assert refusal.value.source == "design.yaml"
    assert refusal.value.field is not None
    assert refusal.value.field.startswith(field)


@pytest.mark.parametrize(
    ("field", "bad"),
    [
        ("tip.points", math.nan),
        ("tip.points", "1 kg"),
        ("tip.capsule_end", math.inf),
        ("tip.centre_of_gravity", None),
    ],
)
def test_bad_coordinate_is_located(mapping: dict[str, Any], field: str, bad: object) -> None:
    """One bad coordinate among many is found by its index."""
    _, name = field.split(".")
    points = copy.deepcopy(mapping["tip"][name])
    if name == "points":
        points[3][1] = bad
        wanted = f"{field}[3][1]"
    else:
        points[1] = bad
        wanted = f"{field}[1]"
    with pytest.raises(InputError) as refusal:
        GripperDesign.from_mapping(put(mapping, field, points))
    assert refusal.value.field == wanted


def test_one_bad_angle_is_located(mapping: dict[str, Any]) -> None:
    """The same for the normals' angles."""
    angles = [0.0] * 14
    angles[5] = math.nan
    with pytest.raises(InputError) as refusal:
        GripperDesign.from_mapping(put(mapping, "tip.normal_angles", angles))
    assert refusal.value.field == "tip.normal_angles[5]"


def test_capsule_needs_two_ends(mapping: dict[str, Any]) -> None:
    """A capsule whose ends coincide has no direction."""
    same = put(mapping, "tip.capsule_end", mapping["tip"]["capsule_start"])
    with pytest.raises(InputError, match="capsule_start") as refusal:
        GripperDesign.from_mapping(same)
    assert refusal.value.field == "tip.capsule_end"


def test_beams_must_not_start_beyond_the_middle(design: GripperDesign) -> None:
    """A top beam shorter than half the side beam's width leaves no room for it."""
    with pytest.raises(InputError, match="too short") as refusal:
        dataclasses.replace(design, top_length=1e-3)
    assert refusal.value.field == "top_length"


@pytest.mark.parametrize("section", ["", "material.", "tip."])
def test_unknown_and_missing_fields(mapping: dict[str, Any], section: str) -> None:
    """A misspelt field is refused, and a missing one named, in every section."""
    with pytest.raises(InputError, match="unknown field") as refusal:
        GripperDesign.from_mapping(put(mapping, f"{section}colour", "red"), source="d.yaml")
    assert refusal.value.field == f"{section}colour"
    owner = mapping[section[:-1]] if section else mapping
    for name in owner:
        lacking = copy.deepcopy(mapping)
        del (lacking[section[:-1]] if section else lacking)[name]
        with pytest.raises(InputError, match="is missing") as refusal:
            GripperDesign.from_mapping(lacking, source="d.yaml")
        assert refusal.value.field == f"{section}{name}"
        assert refusal.value.source == "d.yaml"


def test_constructor_checks_as_well(design: GripperDesign) -> None:
    """Built in Python, the same errors name the class."""
    with pytest.raises(InputError, match="Material: density: must be finite"):
        Material(density=math.nan, youngs_modulus=1.0, stress_limit=1.0)
    with pytest.raises(InputError, match="GripperDesign: width: must be greater than 0"):
        dataclasses.replace(design, width=-1.0)
    with pytest.raises(InputError, match="Tip: "):
        dataclasses.replace(design.tip, radius=0.0)


@pytest.mark.parametrize(("field", "value"), [("material", None), ("tip", 3), ("tip", {})])
def test_parts_of_another_type(design: GripperDesign, field: str, value: Any) -> None:
    """A part that is no Material and no Tip is refused when the design is built."""
    with pytest.raises(InputError) as refusal:
        dataclasses.replace(design, **{field: value})
    assert refusal.value.field == field


@pytest.mark.parametrize(
    "name", ["centre_of_gravity", "capsule_start", "capsule_end", "points", "normal_angles"]
)
def test_tip_built_in_python_names_itself(design: GripperDesign, name: str) -> None:
    """Errors of a Tip say that it is one."""
    assert isinstance(design.tip, Tip)
    changed: dict[str, Any] = {name: "nonsense"}
    with pytest.raises(InputError) as refusal:
        dataclasses.replace(design.tip, **changed)
    assert refusal.value.source == "Tip"


@pytest.mark.parametrize(
    "content", ["", "- a\n", "material: [\n", "width: 4 mm\n", "width: .nan\n", "\t- x"]
)
def test_unreadable_file(tmp_path: Path, content: str) -> None:
    """A file that holds no design: one InputError that begins with its path."""
    path = tmp_path / "design.yaml"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as refusal:
        GripperDesign.from_yaml(path)
    assert str(refusal.value).startswith(f"{path}: ")


def test_missing_file(tmp_path: Path) -> None:
    """The same where there is no file."""
    with pytest.raises(InputError, match="cannot be read"):
        GripperDesign.from_yaml(tmp_path / "nothing.yaml")
