"""Declarations of numbers: unit, range and meaning of a dataclass' field, each in one place.

Validation, reading from files, the node's parameters and their documentation, and calibration all
go by the declaration.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from types import MappingProxyType
from typing import Any

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.units import quantity, whole_number
from hma_gripper_sim.yaml_reading import refuse_unknown


@dataclass(frozen=True, kw_only=True)
class Number:
    """What is declared of a field.

    Attributes
    ----------
    unit
        SI, in pint's notation; empty for a pure number.
    meaning
        What it is, in one sentence.
    minimum, maximum, exclusive
        Range, and whether the minimum itself is excluded.
    whole
        It is a count.
    many
        It is an array, whose shape its owner checks.
    optional
        It may be left open: None.
    """

    unit: str
    meaning: str
    minimum: float
    maximum: float
    exclusive: bool
    whole: bool
    many: bool
    optional: bool

    def check(self, value: object, field: str, source: str | None = None) -> float:
        """Return a value as a number within the range; raise `InputError` otherwise."""
        if self.whole:
            return whole_number(value, field=field, source=source, minimum=int(self.minimum))
        return quantity(
            value,
            self.unit,
            field=field,
            source=source,
            minimum=self.minimum,
            maximum=self.maximum,
            exclusive=self.exclusive,
        )

    def convert(self, value: Any, field: str) -> Any:
        """Return what a file says in SI units, lists as tuples; counts are left to `check`."""
        if isinstance(value, list | tuple):
            return tuple(self.convert(item, f"{field}[{i}]") for i, item in enumerate(value))
        return value if self.whole else quantity(value, self.unit, field=field)


def number(
    unit: str,
    meaning: str = "",
    *,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    exclusive: bool = False,
    whole: bool = False,
    many: bool = False,
    optional: bool = False,
) -> Mapping[str, Number]:
    """Declare a number, as the metadata of a dataclass' field; see `Number`."""
    declared = Number(
        unit=unit,
        meaning=meaning,
        minimum=minimum,
        maximum=maximum,
        exclusive=exclusive,
        whole=whole,
        many=many,
        optional=optional,
    )
    return {"number": declared}


def positive(unit: str, meaning: str = "") -> Mapping[str, Number]:
    """Declare a number greater than 0."""
    return number(unit, meaning, minimum=0.0, exclusive=True)


@cache
def declared_numbers(owner: Any) -> Mapping[str, Number]:
    """Return the declared numbers of a dataclass by the names of their fields."""
    return MappingProxyType(
        {field.name: field.metadata["number"] for field in fields(owner) if field.metadata}
    )


def check_numbers(described: Any) -> None:
    """Validate the declared numbers of a frozen record that is being made, and convert them.

    Raises
    ------
    InputError
        One is not a number, not finite, of another unit, or out of range.
    """
    owner: Any = type(described)
    for name, declared in declared_numbers(owner).items():
        value = getattr(described, name)
        if not (declared.many or (declared.optional and value is None)):
            object.__setattr__(described, name, declared.check(value, name, owner.__name__))


def read_numbers(
    owner: Any, mapping: Mapping[str, Any], beside: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return the declared numbers of a file's section in SI units; texts may carry units.

    Parameters
    ----------
    owner
        The dataclass that they are for; its other fields have to be there, too.
    beside
        What else the section may hold.

    Raises
    ------
    InputError
        A field is unknown, missing, or of another unit.
    """
    wanted = [field for field in fields(owner) if field.init]
    refuse_unknown(mapping, (*beside, *(field.name for field in wanted)))
    for field in wanted:
        if field.name not in mapping and field.default is MISSING:
            raise InputError("is missing", field=field.name)
    return {
        name: declared.convert(mapping[name], name)
        for name, declared in declared_numbers(owner).items()
        if name in mapping
    }
