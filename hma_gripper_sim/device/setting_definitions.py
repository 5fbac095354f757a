"""What can be set on the node: names, ranges, defaults and descriptions."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.model.contours.shapes import shapes
from hma_gripper_sim.model.numbers import declared_numbers
from hma_gripper_sim.model.scene import CONTACTS, SAMPLED_NORMALS
from hma_gripper_sim.model.scene import SceneDescription as Scene
from hma_gripper_sim.motion.drive_limits import SLOWEST, DriveLimits
from hma_gripper_sim.units import choice, quantity, whole_number

Value = bool | float | int | str | list[float]


@dataclass(frozen=True, kw_only=True)
class Field:
    """One thing that can be set.

    Attributes
    ----------
    default
        Used where nothing is given; its type is the field's type.
    description
        What it is, in one sentence, with its unit.
    unit
        Unit of a float, in pint's notation.
    minimum, maximum, exclusive
        Range of a number, and whether the minimum itself is excluded.
    options
        The allowed texts; empty: any.
    read_only
        It cannot change while the node runs.
    """

    default: Value
    description: str
    unit: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf
    exclusive: bool = False
    options: tuple[str, ...] = ()
    read_only: bool = False

    def read(self, value: object, name: str) -> Value:
        """Return `value` in the field's type and SI units; raise `InputError` otherwise."""
        if isinstance(self.default, bool):
            if not isinstance(value, bool):
                raise InputError(f"expected true or false, got {value!r}", field=name)
            return value
        if isinstance(self.default, float):
            return self._number(value, name)
        if isinstance(self.default, int):
            number = whole_number(value, field=name, minimum=int(self.minimum))
            return int(quantity(number, "", field=name, maximum=self.maximum))
        if isinstance(self.default, list):
            if isinstance(value, str) or not isinstance(value, Iterable):
                raise InputError(f"expected a list of numbers, got {value!r}", field=name)
            return [self._number(item, f"{name}[{i}]") for i, item in enumerate(value)]
        if self.options:
            return choice(value, self.options, field=name)
        if not isinstance(value, str):
            raise InputError(f"expected a text, got {value!r}", field=name)
        return value

    def _number(self, value: object, name: str) -> float:
        return quantity(
            value,
            self.unit,
            field=name,
            minimum=self.minimum,
            maximum=self.maximum,
            exclusive=self.exclusive,
        )


def _declared(
    owner: Any,
    name: str,
    default: Value | None = None,
    *,
    minimum: float | None = None,
    maximum: float,
    read_only: bool = False,
) -> Field:
    """Return the setting of a declared number, whose range may be narrower on a node."""
    number = declared_numbers(owner)[name]
    return Field(
        default=getattr(owner, name) if default is None else default,
        description=number.meaning,
        unit=number.unit,
        minimum=number.minimum if minimum is None else minimum,
        maximum=maximum,
        exclusive=number.exclusive,
        read_only=read_only,
    )


_TIME = {
    "publish_rate": Field(
        default=100.0,
        unit="Hz",
        minimum=1.0,
        maximum=1000.0,
        description="Ticks per simulated second [Hz]. Every tick steps the simulation by "
        "exactly one period and publishes the state once.",
    ),
    "real_time_factor": Field(
        default=1.0,
        minimum=0.0,
        maximum=10_000.0,
        description="Simulated seconds per second of the node's clock; 0: as fast as possible.",
    ),
    "publish_clock": Field(
        default=False,
        read_only=True,
        description="Publish /clock every tick: the node is the clock of all others. Its stamps "
        "are then simulated time from 0 on; not together with use_sim_time.",
    ),
    "step_ticks": Field(
        default=1,
        minimum=1,
        maximum=1000,
        description="Ticks that one call of ~/step makes while paused.",
    ),
    "markers_rate": Field(
        default=10.0,
        unit="Hz",
        minimum=0.0,
        maximum=100.0,
        description="How often ~/markers are published while someone listens, per second of "
        "this machine [Hz]; 0: never.",
    ),
}

_DRIVE = {
    **{
        name: _declared(DriveLimits, name, default, minimum=minimum, maximum=maximum)
        for name, default, minimum, maximum in (
            ("max_velocity", 0.05, SLOWEST, 1.0),
            ("max_acceleration", 0.5, SLOWEST, 1000.0),
            ("travel_min", 0.0, -0.5, 0.0),
            ("travel_max", 0.03, 0.0, 0.5),
            ("command_timeout", 0.5, 0.0, 3600.0),
        )
    },
    "allow_nonzero_velocity_at_trajectory_end": Field(
        default=False,
        description="Take trajectories whose last point is not at rest, as streams of them have. "
        "When none follows, the drive brakes and returns to the last position.",
    ),
}

_OBJECT = {
    "contour": Field(
        default="box",
        description="Name of the object in place: one of contours.*, or 'outline' once one has "
        "come by ~/outline. Setting it is the same as calling ~/select_contour/NAME.",
    ),
    "outline.clearance": Field(
        default=0.005,
        unit="m",
        minimum=0.0,
        maximum=1.0,
        description="Travel from the start pose to the first touch of an object that comes by "
        "~/outline [m].",
    ),
    "outline.rounding": Field(
        default=0.0,
        unit="m",
        minimum=0.0,
        maximum=1.0,
        description="Radius of the corners of an object that comes by ~/outline [m].",
    ),
}

_GRIPPER = {
    "prefix": Field(
        default="",
        read_only=True,
        description="Stands before the names of all joints and frames, such as 'left_', so that "
        "two grippers, or an arm with names of its own, can be told apart.",
    ),
    "design": Field(
        default="",
        read_only=True,
        description="Path of a gripper design in YAML; empty: the gripper of the 2013 thesis.",
    ),
    "discretisation": Field(
        default="thesis",
        options=tuple(name for name, each in DISCRETISATIONS.items() if not each.joints_slide),
        read_only=True,
        description="How the gripper is divided into elements: 'thesis' (63 joints, as "
        "published) or 'midpoint' (second order, few elements).",
    ),
    "elements_top": Field(
        default=0,
        minimum=0,
        maximum=200,
        read_only=True,
        description="Elements per half of the top beam; 0: what the discretisation suggests.",
    ),
    "elements_beam": Field(
        default=0,
        minimum=0,
        maximum=1000,
        read_only=True,
        description="Elements per side beam; 0: what the discretisation suggests.",
    ),
    "tolerance": Field(
        default=1e-3,
        minimum=1e-8,
        maximum=0.1,
        read_only=True,
        description="Relative error the solver aims at.",
    ),
}

_CONTACT = {
    "friction": _declared(Scene, "friction", maximum=10.0),
    "contact": Field(
        default="continuous",
        options=CONTACTS,
        read_only=True,
        description="How a tip touches: with its true outline ('continuous') or with the "
        "contact points of the thesis ('sampled').",
    ),
    "sampled_normal": Field(
        default="auto",
        options=("auto", *SAMPLED_NORMALS),
        read_only=True,
        description="Direction of the contact force in the sampled model: along the normal of "
        "the 'tip' or of the 'object'; 'auto': as the thesis had it, by object.",
    ),
    "normal_stiffness": _declared(Scene, "normal_stiffness", maximum=1e9, read_only=True),
    "normal_damping": _declared(Scene, "normal_damping", maximum=1e6, read_only=True),
    "slip_velocity": _declared(Scene, "slip_velocity", maximum=1.0, read_only=True),
}

GROUPS: Mapping[str, Mapping[str, Field]] = MappingProxyType(
    {
        "Time": _TIME,
        "The drive": _DRIVE,
        "The object": _OBJECT,
        "The gripper": _GRIPPER,
        "The contact": _CONTACT,
    }
)
"""What can be set, by the group it belongs to."""

FIELDS: Mapping[str, Field] = MappingProxyType(
    {name: field for group in GROUPS.values() for name, field in group.items()}
)
"""The same without the groups."""


_SIZE = 1.0
"""The node's objects are no larger, and stand no further away [m]."""


def _shape_fields() -> dict[str, Field]:
    """Fields of all shapes; what two of them call the same has the ranges of both."""
    fields: dict[str, Field] = {}
    for shape in shapes().values():
        for name, number in declared_numbers(shape).items():
            default: Value = [0.0] if number.many else 0.0
            lowest = max(number.minimum, -_SIZE)
            if name in fields:
                lowest = min(lowest, fields[name].minimum)
            fields[name] = _declared(shape, name, default, minimum=lowest, maximum=_SIZE)
    return fields


CONTOUR_FIELDS: Mapping[str, Field] = MappingProxyType(
    {
        "type": Field(
            default="",
            options=tuple(shapes()),
            read_only=True,
            description="Shape of the object.",
        ),
        **_shape_fields(),
        "clearance": _declared(Scene, "clearance", maximum=_SIZE),
        "offset": _declared(Scene, "offset", minimum=-_SIZE, maximum=_SIZE),
    }
)

PLACEMENT_FIELDS = ("clearance", "offset")
"""Those of an object's fields that say where it stands."""


def field_of(name: str) -> Field:
    """Return the field behind a parameter name; raise `InputError` if there is none."""
    parts = name.split(".")
    if parts[0] != "contours":
        known: Mapping[str, Field] = FIELDS
        key = name
    elif len(parts) == 3 and parts[1].isidentifier():
        known, key = CONTOUR_FIELDS, parts[2]
    else:
        raise InputError("expected contours.NAME.FIELD, NAME of letters, digits and _", field=name)
    if key not in known:
        close = difflib.get_close_matches(key, known, n=1)
        hint = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(known)}"
        raise InputError(f"unknown parameter ({hint})", field=name)
    return known[key]
