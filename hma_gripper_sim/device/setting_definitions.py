"""What can be set on the node: names, ranges, defaults and descriptions."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.motion.drive_limits import SLOWEST
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
    "max_velocity": Field(
        default=0.05,
        unit="m/s",
        minimum=SLOWEST,
        maximum=1.0,
        description="Largest prismatic speed [m/s]; commands beyond it are clamped.",
    ),
    "max_acceleration": Field(
        default=0.5,
        unit="m/s^2",
        minimum=SLOWEST,
        maximum=1000.0,
        description="Largest prismatic acceleration [m/s^2], for every ramp and for braking "
        "at the travel limits.",
    ),
    "travel_min": Field(
        default=0.0,
        unit="m",
        minimum=-0.5,
        maximum=0.0,
        description="Lower travel limit, away from the object [m]; the start pose is 0.",
    ),
    "travel_max": Field(
        default=0.03,
        unit="m",
        minimum=0.0,
        maximum=0.5,
        description="Upper travel limit, towards the object [m].",
    ),
    "command_timeout": Field(
        default=0.5,
        unit="s",
        minimum=0.0,
        maximum=3600.0,
        description="Simulated time after which a velocity command that is not renewed "
        "expires, and the drive ramps to rest [s]; 0: never.",
    ),
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
        options=("thesis", "midpoint"),
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
    "friction": Field(
        default=0.6,
        minimum=0.0,
        maximum=10.0,
        description="Coulomb friction coefficient between tip and object.",
    ),
    "contact": Field(
        default="continuous",
        options=("continuous", "sampled"),
        read_only=True,
        description="How a tip touches: with its true outline ('continuous') or with the "
        "contact points of the thesis ('sampled').",
    ),
    "sampled_normal": Field(
        default="auto",
        options=("auto", "tip", "object"),
        read_only=True,
        description="Direction of the contact force in the sampled model: along the normal of "
        "the 'tip' or of the 'object'; 'auto': as the thesis had it, by object.",
    ),
    "normal_stiffness": Field(
        default=1e4,
        unit="N/m",
        minimum=0.0,
        exclusive=True,
        maximum=1e9,
        read_only=True,
        description="Stiffness of the contact along its normal [N/m].",
    ),
    "normal_damping": Field(
        default=1.0,
        unit="N*s/m",
        minimum=0.0,
        maximum=1e6,
        read_only=True,
        description="Damping of the contact along its normal [N s/m].",
    ),
    "slip_velocity": Field(
        default=0.0,
        unit="m/s",
        minimum=0.0,
        maximum=1.0,
        read_only=True,
        description="Sliding speed at which friction is fully developed [m/s]; 0: true "
        "sticking, a held object does not creep.",
    ),
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


def _length(description: str, default: float = 0.0) -> Field:
    return Field(default=default, unit="m", minimum=0.0, maximum=1.0, description=description)


def _coordinate(description: str, default: float | list[float] = 0.0) -> Field:
    return Field(default=default, unit="m", minimum=-1.0, maximum=1.0, description=description)


CONTOUR_FIELDS: Mapping[str, Field] = MappingProxyType(
    {
        "type": Field(
            default="",
            options=("box", "circle", "polygon"),
            read_only=True,
            description="Shape of the object.",
        ),
        "width": _length("Width of a box [m]."),
        "height": _length("Height of a box [m]."),
        "corner_radius": _length("Corner radius of a box [m]."),
        "radius": _length("Radius of a circle [m]."),
        "points": _coordinate("Corners of a convex polygon: x1, z1, x2, z2, ... [m].", [0.0]),
        "rounding": _length("Radius of the corners of a polygon [m]."),
        "clearance": _length(
            "Travel from the start pose to the first touch of the stress-free gripper [m].", 0.005
        ),
        "offset": _coordinate("Distance of the object from the gripper's axis, to the right [m]."),
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
