"""Everything that can be set on the node: names, ranges, defaults, and their validation.

Whether a value comes from a YAML file, the command line, a launch file or a parameter service:
it ends up in one flat mapping of parameter names to values, and `Settings.parse` is the only way
from there into the simulation.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from hma_gripper_sim.contour import contour_from_mapping
from hma_gripper_sim.design import GripperDesign
from hma_gripper_sim.drive import DriveLimits
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.quantities import choice, quantity, whole_number
from hma_gripper_sim.scene import Scene

Value = float | int | str | list[float]


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


FIELDS: Mapping[str, Field] = MappingProxyType(
    {
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
        "command_timeout": Field(
            default=0.5,
            unit="s",
            minimum=0.0,
            maximum=3600.0,
            description="Simulated time after which a velocity command that is not renewed "
            "expires, and the drive ramps to rest [s]; 0: never.",
        ),
        "max_velocity": Field(
            default=0.05,
            unit="m/s",
            minimum=0.0,
            exclusive=True,
            maximum=1.0,
            description="Largest prismatic speed [m/s]; commands beyond it are clamped.",
        ),
        "max_acceleration": Field(
            default=0.5,
            unit="m/s^2",
            minimum=0.0,
            exclusive=True,
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
        "contour": Field(
            default="box",
            description="Name of the object in place, one of contours.*. Setting it is the same "
            "as calling ~/select_contour/NAME.",
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
        "friction": Field(
            default=0.6,
            minimum=0.0,
            maximum=10.0,
            description="Coulomb friction coefficient between tip and object.",
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
        "tolerance": Field(
            default=1e-3,
            minimum=1e-8,
            maximum=0.1,
            read_only=True,
            description="Relative error the solver aims at.",
        ),
    }
)


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

_PLACEMENT = ("clearance", "offset")

DEFAULT_CONTOURS: Mapping[str, Value] = MappingProxyType(
    {
        "contours.box.type": "box",
        "contours.box.width": 0.028,
        "contours.box.height": 0.028,
        "contours.box.corner_radius": 0.002,
        "contours.box.clearance": 0.004,
        "contours.cylinder.type": "circle",
        "contours.cylinder.radius": 0.015,
        "contours.cylinder.clearance": 0.005,
    }
)
"""The objects of the thesis: the catalogue where no `contours.*` is given."""

_SCENE_FIELDS = (
    "friction",
    "contact",
    "discretisation",
    "normal_stiffness",
    "normal_damping",
    "slip_velocity",
)


@dataclass(frozen=True)
class Settings:
    """A complete and consistent set of settings.

    Attributes
    ----------
    values
        Every setting by parameter name, in SI units.
    scenes
        The catalogue: what the gripper presses on, by object name.
    limits
        What the drive may do.
    period_ns
        Duration of a tick in simulated time [ns].
    """

    values: Mapping[str, Value]
    scenes: Mapping[str, Scene]
    limits: DriveLimits
    period_ns: int

    @classmethod
    def parse(cls, given: Mapping[str, object]) -> Settings:
        """Validate what is given, and fill in the defaults.

        Parameters
        ----------
        given
            Values by parameter name: `FIELDS` and ``contours.NAME.FIELD`` with
            `CONTOUR_FIELDS`. Where no contour is given, `DEFAULT_CONTOURS` are taken.

        Raises
        ------
        InputError
            Naming the parameter: unknown, not finite, out of range, or inconsistent.
        """
        if not any(name.startswith("contours.") for name in given):
            given = {**DEFAULT_CONTOURS, **given}
        values: dict[str, Value] = {name: field.default for name, field in FIELDS.items()}
        values |= {name: field_of(name).read(value, name) for name, value in given.items()}
        settings = cls(MappingProxyType(values), _scenes(values), _limits(values), _period(values))
        settings._check_contour()
        return settings

    def changed(self, changes: Mapping[str, object]) -> Settings:
        """Return these settings with some values changed; raise `InputError` as `parse` does.

        Scenes that the changes do not touch stay the same objects.
        """
        read = {name: field_of(name).read(value, name) for name, value in changes.items()}
        values = {**self.values, **read}
        same_scenes = all(
            name == "contour" or not (name in _SCENE_FIELDS or name.startswith("contours."))
            for name in changes
        )
        settings = replace(
            self,
            values=MappingProxyType(values),
            scenes=self.scenes if same_scenes else _scenes(values),
            limits=_limits(values),
            period_ns=_period(values),
        )
        settings._check_contour()
        return settings

    @property
    def contour(self) -> str:
        """Name of the object in place."""
        return str(self.values["contour"])

    @property
    def period(self) -> float:
        """Duration of a tick [s]."""
        return self.period_ns / 1e9

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per second; 0: as fast as possible."""
        return float(self.values["real_time_factor"])  # type: ignore[arg-type]

    @property
    def tolerance(self) -> float:
        """Relative error the solver aims at."""
        return float(self.values["tolerance"])  # type: ignore[arg-type]

    def _check_contour(self) -> None:
        if self.contour not in self.scenes:
            known = ", ".join(sorted(self.scenes))
            raise InputError(f"unknown contour {self.contour!r} (known: {known})", field="contour")


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


def _limits(values: Mapping[str, Any]) -> DriveLimits:
    return DriveLimits(
        max_velocity=values["max_velocity"],
        max_acceleration=values["max_acceleration"],
        travel_min=values["travel_min"],
        travel_max=values["travel_max"],
        command_timeout=values["command_timeout"],
    )


def _period(values: Mapping[str, Any]) -> int:
    """Duration of a tick in whole nanoseconds, the resolution of ROS time stamps."""
    return round(1e9 / float(values["publish_rate"]))


def _scenes(values: Mapping[str, Any]) -> dict[str, Scene]:
    """Build the scene of every contour of the catalogue."""
    path = values["design"]
    design = GripperDesign.from_yaml(path) if path else GripperDesign.thesis_2013()
    common = {field: values[field] for field in _SCENE_FIELDS}
    common |= {field: values[field] or None for field in ("elements_top", "elements_beam")}
    normal = values["sampled_normal"]
    common["sampled_normal"] = None if normal == "auto" else normal
    scenes = {}
    for name, shape in _contours(values).items():
        prefix = f"contours.{name}"
        placement = {field: shape.pop(field) for field in _PLACEMENT if field in shape}
        contour = contour_from_mapping(shape, field=prefix)
        try:
            scenes[name] = Scene(design, contour, **common, **placement)
        except InputError as error:
            field = f"{prefix}.{error.field}" if error.field in _PLACEMENT else error.field
            raise InputError(error.reason, field=field) from None
    return scenes


def _contours(values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Group ``contours.NAME.FIELD`` by name, and the points of polygons in pairs."""
    contours: dict[str, dict[str, Any]] = {}
    for full_name, value in values.items():
        if full_name.startswith("contours."):
            _, name, field = full_name.split(".")
            if field == "points":
                if len(value) % 2:
                    raise InputError("expected x and z in turn: an even count", field=full_name)
                value = [value[i : i + 2] for i in range(0, len(value), 2)]
            contours.setdefault(name, {})[field] = value
    return contours
