"""Validated physical quantities: every number from outside passes through here."""

from __future__ import annotations

import math
import re
from functools import cache
from numbers import Real
from typing import TYPE_CHECKING, Any

from hma_gripper_sim.errors import InputError

if TYPE_CHECKING:
    from pint import UnitRegistry


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NUMBER_AND_UNIT = re.compile(rf"\s*({_NUMBER})\s*(|[^\W\d_].*|[°%].*)")


@cache
def _units() -> UnitRegistry[float]:
    from pint import UnitRegistry  # slow to import, and needed only where a file names units

    return UnitRegistry(cache_folder=None)


def quantity(
    value: object,
    unit: str,
    *,
    field: str | None = None,
    source: str | None = None,
    minimum: float = -math.inf,
    maximum: float = math.inf,
    exclusive: bool = False,
) -> float:
    """Return `value` as a finite float in `unit`.

    Parameters
    ----------
    value
        A number, taken to be in `unit` already, or a text with a unit such as ``"28 mm"``.
    unit
        The SI unit wanted, in pint's notation (``""`` for a pure number).
    minimum, maximum
        The allowed range, in `unit`.
    exclusive
        Whether the minimum itself is excluded.

    Raises
    ------
    InputError
        Not a number, not finite, of another dimension, or out of range.
    """

    def refuse(reason: str) -> InputError:
        return InputError(reason, field=field, source=source)

    if type(value) is float and minimum < value < maximum:  # finite: no bound is
        return value
    wanted = f"a number in {unit}" if unit else "a pure number"
    if isinstance(value, str):
        number = _magnitude(value, unit, wanted, refuse)
    elif not isinstance(value, bool) and isinstance(value, Real):
        number = _as_float(value)
    else:
        raise refuse(f"expected {wanted}, got {value!r}")
    shown = f"{number:g} {unit}".strip()
    if not math.isfinite(number):
        raise refuse(f"must be finite, got {shown}")
    if number < minimum or (exclusive and number == minimum):
        bound = "greater than" if exclusive else "at least"
        raise refuse(f"must be {bound} {minimum:g} {unit}".rstrip() + f", got {shown}")
    if number > maximum:
        raise refuse(f"must be at most {maximum:g} {unit}".rstrip() + f", got {shown}")
    return number


def typed_quantity(text: str, unit: str, **options: Any) -> float:
    """Return a quantity that was typed on the command line; a bare number is in `unit`.

    `options` are those of `quantity`, which also says what is raised.
    """
    try:
        value: float | str = float(text)
    except ValueError:
        value = text
    return quantity(value, unit, **options)


def _as_float(value: Real) -> float:
    try:
        return float(value)
    except OverflowError:  # an int beyond the range of floats
        return math.inf


def _magnitude(text: str, unit: str, wanted: str, refuse: Any) -> float:
    import pint

    match = _NUMBER_AND_UNIT.fullmatch(text)
    if match is None:
        raise refuse(f"expected {wanted}, got {text!r}")
    try:
        parsed: Any = _units().Quantity(float(match[1]), match[2])
        return float(parsed.to(unit or "dimensionless").magnitude)
    except pint.DimensionalityError as error:
        raise refuse(f"expected {wanted}, got {text!r} ({error.units1})") from None
    except Exception:  # pint's parser raises many types for malformed text
        raise refuse(f"expected {wanted}, got {text!r}") from None


def whole_number(
    value: object, *, field: str | None = None, source: str | None = None, minimum: int = 1
) -> int:
    """Return `value` as an int of at least `minimum`; raise `InputError` otherwise."""
    number = math.nan
    if not isinstance(value, bool) and isinstance(value, Real):
        number = _as_float(value)
    if not number.is_integer():
        raise InputError(f"expected a whole number, got {value!r}", field=field, source=source)
    if number < minimum:
        raise InputError(f"must be at least {minimum}, got {value}", field=field, source=source)
    return int(number)


def choice(
    value: object, options: tuple[str, ...], *, field: str | None = None, source: str | None = None
) -> str:
    """Return `value` if it is one of `options`; raise `InputError` otherwise."""
    if not isinstance(value, str) or value not in options:
        listed = ", ".join(repr(option) for option in options)
        raise InputError(f"must be one of {listed}, got {value!r}", field=field, source=source)
    return value
