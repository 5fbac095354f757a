"""Validation of what comes from outside: numbers, units, choices."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.units import choice, quantity, typed_quantity, whole_number


@pytest.mark.parametrize(
    ("value", "unit", "wanted"),
    [
        (0.028, "m", 0.028),
        (3, "m", 3.0),
        (np.float32(0.5), "m", 0.5),
        (np.int64(7), "", 7.0),
        (Fraction(1, 4), "m", 0.25),
        ("28 mm", "m", 0.028),
        ("28mm", "m", 0.028),
        ("2.8 cm", "m", 0.028),
        ("1 inch", "m", 0.0254),
        ("8.9 MPa", "Pa", 8.9e6),
        ("8.9 N/mm^2", "Pa", 8.9e6),
        ("980 g/l", "kg/m^3", 980.0),
        ("4 mm/s", "m/s", 0.004),
        ("90 degree", "rad", math.pi / 2.0),
        ("0.6", "", 0.6),
        ("60 percent", "", 0.6),
        ("-3 mm", "m", -0.003),
        ("1e-3 m", "m", 1e-3),
    ],
)
def test_accepted(value: object, unit: str, wanted: float) -> None:
    """A bare number is in the SI unit already; a text is converted from the unit it names."""
    result = quantity(value, unit)
    assert type(result) is float
    assert result == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (math.nan, "finite"),
        (math.inf, "finite"),
        (-math.inf, "finite"),
        (np.float64("nan"), "finite"),
        ("nan m", ""),
        ("inf m", ""),
        ("1e400 m", ""),
        pytest.param(10**400, "", id="10**400"),
        ("28 kg", "expected a number in m"),
        ("28 mm^2", "expected a number in m"),
        ("28", "expected a number in m"),
        ("28 lightyearz", "expected a number in m"),
        ("", "expected a number in m"),
        ("  ", "expected a number in m"),
        ("28 mm 3", "expected a number in m"),
        ("__import__('os')", "expected a number in m"),
        ("(1, 2) m", "expected a number in m"),
        ("[1] m", "expected a number in m"),
        ("\x00", "expected a number in m"),
        ("mm", "expected a number in m"),
        ("2*3 mm", "expected a number in m"),
        ("1 +", "expected a number in m"),
        ("20 degC", "expected a number in m"),
        (None, "expected a number in m"),
        (True, "expected a number in m"),
        (np.bool_(True), "expected a number in m"),
        (1j, "expected a number in m"),
        ([0.028], "expected a number in m"),
        ({"value": 1}, "expected a number in m"),
        (b"28 mm", "expected a number in m"),
        (np.array([0.1]), "expected a number in m"),
        (np.array(0.1), "expected a number in m"),
        (object(), "expected a number in m"),
        (-0.001, "at least 0 m"),
        ("-1 mm", "at least 0 m"),
        (2.5, "at most 2 m"),
        ("2.5 km", "at most 2 m"),
    ],
)
def test_refused(value: object, reason: str) -> None:
    """Anything but a finite number of the right dimension in range: one InputError."""
    with pytest.raises(InputError) as refusal:
        quantity(value, "m", field="width", source="file.yaml", minimum=0.0, maximum=2.0)
    assert str(refusal.value).startswith("file.yaml: width: ")
    assert reason in refusal.value.reason
    assert "\n" not in str(refusal.value)
    assert refusal.value.field == "width"


def test_exclusive_minimum() -> None:
    """`exclusive` refuses the bound itself and nothing above it."""
    assert quantity(0.0, "m", minimum=0.0) == 0.0
    assert quantity(1e-300, "m", minimum=0.0, exclusive=True) == 1e-300
    with pytest.raises(InputError, match="must be greater than 0 m, got 0 m"):
        quantity(0.0, "m", minimum=0.0, exclusive=True)


def test_pure_number_takes_no_length() -> None:
    """A friction of ``0.6 m`` is a mistake."""
    with pytest.raises(InputError, match=r"expected a pure number, got '0\.6 m'"):
        quantity("0.6 m", "")


@pytest.mark.parametrize("value", [1, 5, 5.0, np.int32(5), np.float64(5.0)])
def test_whole_number_accepted(value: object) -> None:
    """Whole numbers of any type come back as int."""
    result = whole_number(value)
    assert type(result) is int
    assert result == value


@pytest.mark.parametrize(
    "value",
    [
        *(0, -1, 2.5, math.nan, math.inf, -math.inf, "5", True, None, [5], 5j),
        pytest.param(10**400, id="10**400"),
    ],
)
def test_whole_number_refused(value: object) -> None:
    """No fractions, no truth values, no texts, nothing below the minimum, nothing absurd."""
    with pytest.raises(InputError) as refusal:
        whole_number(value, field="elements", source="Scene")
    assert refusal.value.field == "elements"


@pytest.mark.parametrize("value", ["c", "A", "", None, 3, ["a"], {}])
def test_choice_refused(value: object) -> None:
    """The reason lists what could be chosen."""
    with pytest.raises(InputError, match="must be one of 'a', 'b', got"):
        choice(value, ("a", "b"), field="kind")
    assert choice("b", ("a", "b")) == "b"


def test_input_error_is_seen_from_the_enclosing_section() -> None:
    """`within` prefixes the field and keeps the innermost source unless told another."""
    error = InputError("must be finite", field="width", source="RoundedBox")
    outer = error.within(field_prefix="contours.box").within(source="a.yaml")
    assert str(outer) == "a.yaml: contours.box.width: must be finite"
    assert isinstance(outer, ValueError)
    assert str(InputError("no")) == "no"


def test_what_is_typed_may_be_a_bare_number() -> None:
    assert typed_quantity("2e-5", "m") == 2e-5
    assert typed_quantity("20 um", "m") == pytest.approx(2e-5)
    for text in ("20 s", "far", "nan", "-1"):
        with pytest.raises(InputError, match="--gap"):
            typed_quantity(text, "m", field="--gap", minimum=0.0)
