"""What a calibration may leave free."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.gripper import GripperDesign, Material
from hma_gripper_sim.model.numbers import declared_numbers
from hma_gripper_sim.units import typed_quantity


@dataclass(frozen=True)
class Parameter:
    """A number of a scene, its gripper or its material.

    Attributes
    ----------
    name
        Of the field.
    unit
        SI.
    owner
        ``scene``, ``design`` or ``material``: whose field it is; ``log``: it is none of these, but
        says how what was measured came into the log (see `Trial.simulate`).
    factor
        The default bounds are the start value divided and multiplied by this, or
    margin
        the start value minus and plus this [SI].
    minimum, maximum
        What makes sense at all [SI].
    """

    name: str
    unit: str
    owner: str
    factor: float | None = None
    margin: float = 0.0
    minimum: float = -math.inf
    maximum: float = math.inf

    def of(self, scene: Scene) -> float:
        """Return its value in a scene [SI]."""
        if self.owner == "log":
            return 0.0
        owner = {
            "scene": scene,
            "design": scene.design,
            "material": scene.design.material,
        }[self.owner]
        return cast(float, getattr(owner, self.name))

    def put(self, scene: Scene, value: float) -> Scene:
        """Return the scene with another value [SI]."""
        if self.owner == "log":
            return scene
        change = {self.name: value}
        if self.owner == "scene":
            return replace(scene, **change)  # type: ignore[arg-type]
        design = scene.design
        if self.owner == "material":
            material = replace(design.material, **change)
            return replace(scene, design=replace(design, material=material))
        return replace(scene, design=replace(design, **change))  # type: ignore[arg-type]


_OWNERS = {"scene": Scene, "design": GripperDesign, "material": Material}


def _declared(owner: str, name: str, **bounds: float) -> Parameter:
    """Return a declared number as a parameter; its own range holds unless bounds say otherwise."""
    number = declared_numbers(_OWNERS[owner])[name]
    ranges = {"minimum": number.minimum, "maximum": number.maximum}
    return Parameter(name, number.unit, owner, **{**ranges, **bounds})


PARAMETERS: Mapping[str, Parameter] = {
    parameter.name: parameter
    for parameter in (
        _declared("scene", "friction", margin=3.0, maximum=3.0),
        _declared("scene", "clearance", margin=5e-3),
        _declared("scene", "offset", margin=5e-3),
        _declared("scene", "normal_stiffness", factor=100.0),
        _declared("scene", "normal_damping", factor=100.0),
        _declared("material", "youngs_modulus", factor=5.0),
        _declared("material", "density", factor=5.0),
        _declared("design", "width", factor=2.0),
        _declared("design", "height", factor=5.0),
        _declared("design", "top_length", factor=1.5),
        _declared("design", "beam_length", factor=1.5),
        _declared("design", "beam_angle", margin=math.radians(20.0)),
        _declared("design", "joint_damping", factor=100.0),
        Parameter("force_delay", "s", "log", margin=1.0),
        Parameter("angle_delay", "s", "log", margin=1.0),
        Parameter("force_bias", "N", "log", margin=1.0),
        Parameter("angle_bias", "rad", "log", margin=math.radians(20.0)),
    )
}
"""By name."""

ALIASES: Mapping[str, str] = {"E": "youngs_modulus", "rho": "density", "mu": "friction"}
"""Symbols that stand for a name."""


@dataclass(frozen=True)
class FreeParameter:
    """A parameter that is to be found.

    Attributes
    ----------
    parameter
        Which one.
    start, lower, upper
        Where the search begins, and between what [SI].
    """

    parameter: Parameter
    start: float
    lower: float
    upper: float

    @property
    def scale(self) -> float:
        """Of the search [SI]: what counts as a change of one."""
        return abs(self.start) or 0.1 * (self.upper - self.lower)

    def value(self, x: float) -> float:
        """Return what a number of the search stands for [SI]; 1 is the start."""
        return self.start + self.scale * (x - 1.0)

    def x(self, value: float) -> float:
        """Return the number of the search that stands for a value [SI]."""
        return 1.0 + (value - self.start) / self.scale


def free_parameters(
    names: str, scene: Scene, bounds: Sequence[str] = ()
) -> tuple[FreeParameter, ...]:
    """Read what is to be found, such as ``friction,E``.

    Parameters
    ----------
    names
        Separated by commas.
    scene
        Holds the start values.
    bounds
        Texts such as ``E=5 MPa..12 MPa`` that override the default bounds.

    Raises
    ------
    InputError
        A name is unknown or repeated, or a start value is not between its bounds.
    """
    given = dict(_bound(text) for text in bounds)
    free: dict[str, FreeParameter] = {}
    for name in names.split(","):
        parameter = _parameter(name, "--free")
        if parameter.name in free:
            raise InputError(f"{parameter.name} is named twice", field="--free")
        start = parameter.of(scene)
        if parameter.name in given:
            lower, upper = given.pop(parameter.name)
        else:
            lower, upper = _default(parameter, start)
        if not lower <= start <= upper:
            raise InputError(
                f"the start, {start:g} {parameter.unit}, is not between {lower:g} and {upper:g}",
                field=f"--bound {parameter.name}",
            )
        free[parameter.name] = FreeParameter(parameter, start, lower, upper)
    if given:
        raise InputError("is not free", field=f"--bound {next(iter(given))}")
    return tuple(free.values())


def _parameter(name: str, field: str) -> Parameter:
    name = name.strip()
    name = ALIASES.get(name, name)
    if name not in PARAMETERS:
        known = ", ".join((*ALIASES, *PARAMETERS))
        raise InputError(f"unknown parameter {name!r} (known: {known})", field=field)
    return PARAMETERS[name]


def _default(parameter: Parameter, start: float) -> tuple[float, float]:
    if parameter.factor is None:
        lower, upper = start - parameter.margin, start + parameter.margin
    elif start > 0.0:
        lower, upper = start / parameter.factor, start * parameter.factor
    else:
        raise InputError(
            f"starts at {start:g}: give its bounds and a start within them", field=parameter.name
        )
    return max(lower, parameter.minimum), min(upper, parameter.maximum)


def _bound(text: str) -> tuple[str, tuple[float, float]]:
    name, equals, ends = text.partition("=")
    low, dots, high = ends.partition("..")
    if not (equals and dots):
        raise InputError(f"expected NAME=LOW..HIGH, got {text!r}", field="--bound")
    parameter = _parameter(name, "--bound")
    field = f"--bound {parameter.name}"
    lower, upper = (
        typed_quantity(
            end,
            parameter.unit,
            field=field,
            minimum=parameter.minimum,
            maximum=parameter.maximum,
        )
        for end in (low, high)
    )
    if lower >= upper:
        raise InputError("the first end must be the lower one", field=field)
    return parameter.name, (lower, upper)
