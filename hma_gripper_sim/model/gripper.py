"""Physical description of a gripper: material, cross section, lengths and tip."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.numbers import check_numbers, number, positive, read_numbers
from hma_gripper_sim.units import quantity
from hma_gripper_sim.yaml_reading import read_yaml

Array = NDArray[np.float64]
Point = tuple[float, float]


@dataclass(frozen=True)
class Material:
    """Hot-melt adhesive as a linear elastic material.

    Parameters
    ----------
    density
        [kg/m^3]
    youngs_modulus
        [Pa]
    stress_limit
        End of the linear stress-strain range [Pa] (thesis 5.2, after Brodbeck et al.).
    """

    density: float = field(metadata=positive("kg/m^3"))
    youngs_modulus: float = field(metadata=positive("Pa"))
    stress_limit: float = field(metadata=positive("Pa"))

    def __post_init__(self) -> None:
        check_numbers(self)


@dataclass(frozen=True)
class Tip:
    """The rigid tip of a side beam.

    Its frame starts at the end of the beam: x continues the beam, y is 90 degrees
    counter-clockwise from it (for the right tip: away from the gripper's axis).

    Parameters
    ----------
    area
        Of the drawn outline [m^2].
    centre_of_gravity
        (x, y) [m].
    inertia
        About the centre of gravity [kg m^2].
    capsule_start, capsule_end
        Ends of the axis of the capsule that forms the contour in contact [m].
    radius
        Of the capsule [m].
    points
        Sampled contact points (x, y) [m].
    normal_angles
        Direction of the outward normal at each of them, from x [rad].
    """

    area: float = field(metadata=positive("m^2"))
    centre_of_gravity: Point = field(metadata=number("m", many=True))
    inertia: float = field(metadata=positive("kg*m^2"))
    capsule_start: Point = field(metadata=number("m", many=True))
    capsule_end: Point = field(metadata=number("m", many=True))
    radius: float = field(metadata=positive("m"))
    points: tuple[Point, ...] = field(metadata=number("m", many=True))
    normal_angles: tuple[float, ...] = field(metadata=number("rad", many=True))

    def __post_init__(self) -> None:
        check_numbers(self)
        for name in ("centre_of_gravity", "capsule_start", "capsule_end"):
            object.__setattr__(self, name, _point(getattr(self, name), field=name))
        if not isinstance(self.points, Sequence) or not self.points:
            raise InputError("expected a list of (x, y) points", field="points", source="Tip")
        points = tuple(_point(p, field=f"points[{i}]") for i, p in enumerate(self.points))
        if not isinstance(self.normal_angles, Sequence) or len(self.normal_angles) != len(points):
            raise InputError(
                f"expected one angle for each of the {len(points)} points",
                field="normal_angles",
                source="Tip",
            )
        angles = tuple(
            quantity(a, "rad", field=f"normal_angles[{i}]", source="Tip")
            for i, a in enumerate(self.normal_angles)
        )
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "normal_angles", angles)
        if math.dist(self.capsule_start, self.capsule_end) == 0.0:
            raise InputError("must differ from capsule_start", field="capsule_end", source="Tip")


@dataclass(frozen=True)
class GripperDesign:
    """A passive compliant gripper: a top beam, two side beams, two rigid tips.

    Parameters
    ----------
    material
        What it is made of.
    tip
        The tip at the end of each side beam.
    width
        In-plane thickness of all beams [m].
    height
        Out-of-plane thickness [m].
    top_length
        Flexible length of the top beam on each side of the middle [m].
    top_elements
        GBEs on that length in the thesis' discretisation.
    beam_length
        Flexible length of a side beam [m].
    beam_elements
        GBEs on that length in the thesis' discretisation.
    beam_angle
        Outward slant of the side beams from the vertical [rad].
    joint_damping
        Of one joint of the thesis' side beam [N m s/rad].
    """

    material: Material
    tip: Tip
    width: float = field(metadata=positive("m"))
    height: float = field(metadata=positive("m"))
    top_length: float = field(metadata=positive("m"))
    top_elements: int = field(metadata=number("", minimum=1, whole=True))
    beam_length: float = field(metadata=positive("m"))
    beam_elements: int = field(metadata=number("", minimum=1, whole=True))
    beam_angle: float = field(metadata=number("rad", minimum=-0.5 * math.pi, maximum=0.5 * math.pi))
    joint_damping: float = field(metadata=number("N*m*s/rad", minimum=0.0))

    def __post_init__(self) -> None:
        for name, kind in (("material", Material), ("tip", Tip)):
            if not isinstance(getattr(self, name), kind):
                raise InputError(
                    f"expected a {kind.__name__}, got {getattr(self, name)!r}",
                    field=name,
                    source="GripperDesign",
                )
        check_numbers(self)
        if self.corner[0] <= 0.0:
            raise InputError(
                "too short: the side beam would start beyond the middle",
                field="top_length",
                source="GripperDesign",
            )

    @classmethod
    def thesis_2013(cls) -> GripperDesign:
        """The gripper of the thesis (Fig. 3.1, A.1 Parameters.m, B.1)."""
        mm = 1e-3
        samples = (  # CS_t1 .. CS_t14: x [mm], y [mm], angle of the outward normal [degree]
            (5.150757595, -10.020815280, -135.0),
            (12.289596972, -5.710403028, -45.0),
            (7.979184720, -10.020815280, -45.0),
            (6.564971157, -10.606601718, -90.0),
            (14.443333542, -3.556666458, -45.0),
            (13.364995700, -4.635004300, -45.0),
            (11.214198244, -6.785801756, -45.0),
            (10.135860402, -7.864139598, -45.0),
            (9.057522561, -8.942477439, -45.0),
            (7.330338022, -10.454360783, -67.5),
            (5.799604293, -10.454360783, -112.5),
            (16.600009224, -1.399990776, -45.0),
            (17.031748681, 0.770510047, 22.5),
            (17.138007330, -0.414256067, -12.25),
        )
        return cls(
            material=Material(density=980.0, youngs_modulus=8.9e6, stress_limit=1.2e6),
            tip=Tip(
                area=1.12e-4,
                centre_of_gravity=(8.808687272 * mm, -2.331376882 * mm),
                inertia=0.020395151e-6,
                capsule_start=(6.564971157 * mm, -8.606601718 * mm),
                capsule_end=(15.185795662 * mm, 0.014222786 * mm),
                radius=2.0 * mm,
                points=tuple((x * mm, y * mm) for x, y, _ in samples),
                normal_angles=tuple(math.radians(angle) for _, _, angle in samples),
            ),
            width=4.0 * mm,
            height=7.0 * mm,
            top_length=10.5 * mm,
            top_elements=5,
            beam_length=43.0 * mm,
            beam_elements=25,
            beam_angle=math.radians(7.0),
            joint_damping=0.01,
        )

    @classmethod
    def from_mapping(
        cls, mapping: Mapping[str, Any], *, source: str | None = None
    ) -> GripperDesign:
        """Build a design from nested fields; texts may carry units (``"4 mm"``).

        Raises
        ------
        InputError
            A field is missing, unknown, of a wrong unit, not finite, or inconsistent.
        """
        try:
            values = read_numbers(cls, mapping)
            values["material"] = _section(mapping, "material", Material)
            values["tip"] = _section(mapping, "tip", Tip)
            return cls(**values)
        except InputError as error:
            raise error.within(source=source) from None

    @classmethod
    def from_yaml(cls, path: str | Path) -> GripperDesign:
        """Read a design from a YAML file such as `to_yaml` writes.

        Raises
        ------
        InputError
            Names the file, the field and the reason.
        """
        return cls.from_mapping(read_yaml(path), source=str(path))

    def to_yaml(self, path: str | Path) -> None:
        """Write the design, in SI units, for `from_yaml` to read back exactly."""
        content = {
            "material": _plain(self.material),
            **{key: value for key, value in _plain(self).items() if key not in ("material", "tip")},
            "tip": _plain(self.tip),
        }
        Path(path).write_text(
            "# Gripper design, SI units (m, kg, s, rad)\n"
            + yaml.safe_dump(content, sort_keys=False, default_flow_style=None),
            encoding="utf-8",
        )

    @property
    def corner(self) -> Point:
        """Start of the right side beam, from the middle of the top beam's axis (x, z) [m]."""
        element = self.top_length / self.top_elements
        return (self.top_length + 0.5 * element - 0.5 * self.width, -0.5 * self.width)

    @property
    def top_end(self) -> float:
        """Outer end of the top beam, half a GBE beyond its flexible length [m]."""
        return self.top_length * (1.0 + 0.5 / self.top_elements)

    @property
    def second_moment_of_area(self) -> float:
        """Of the beams' cross section [m^4]."""
        return self.height * self.width**3 / 12.0

    @property
    def bending_stiffness(self) -> float:
        """E I of the beams [N m^2]."""
        return self.material.youngs_modulus * self.second_moment_of_area

    @property
    def damping_length(self) -> float:
        """Length of the GBE that `joint_damping` belongs to [m]."""
        return self.beam_length / self.beam_elements

    @property
    def line_density(self) -> float:
        """Mass of a beam per length [kg/m]."""
        return self.material.density * self.width * self.height

    @property
    def tip_mass(self) -> float:
        """Mass of one tip [kg]."""
        return self.tip.area * self.height * self.material.density

    @property
    def mass(self) -> float:
        """Mass of the whole gripper [kg]."""
        return 2.0 * (self.line_density * (self.top_end + self.beam_length) + self.tip_mass)

    def bending_stress(self, moment: float) -> float:
        """Largest stress in a section under a bending moment [Pa] (thesis Eq. 5.1)."""
        return abs(moment) * 0.5 * self.width / self.second_moment_of_area


def _point(value: object, *, field: str) -> Point:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 2:
        raise InputError(f"expected a point (x, y), got {value!r}", field=field, source="Tip")
    x, y = (quantity(item, "m", field=field, source="Tip") for item in value)
    return (x, y)


def _section(mapping: Mapping[str, Any], name: str, kind: Any) -> Any:
    section = mapping[name]
    if not isinstance(section, Mapping):
        raise InputError("expected a mapping of fields", field=name)
    try:
        return kind(**read_numbers(kind, section))
    except InputError as error:
        raise InputError(error.reason, field=error.field).within(field_prefix=name) from None


def _plain(described: Any) -> dict[str, Any]:
    def plain(value: Any) -> Any:
        return [plain(item) for item in value] if isinstance(value, tuple) else value

    return {field.name: plain(getattr(described, field.name)) for field in fields(described)}
