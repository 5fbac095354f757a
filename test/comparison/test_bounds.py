"""The errors that a comparison may have."""

from __future__ import annotations

import math

import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.comparison.bounds import Bound, Verdict, read_bound
from hma_gripper_sim.comparison.coverage import Coverage


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("phi=2%", Bound("phi_mean", 0.02, True)),
        ("phi_left = 0.5 deg", Bound("phi_left", math.radians(0.5), False)),
        ("actuator_force=0.02N", Bound("actuator_force", 0.02, False)),
        ("force=1.5 %", Bound("actuator_force", 0.015, True)),
        ("travel=0.1mm", Bound("travel", 1e-4, False)),
    ],
)
def test_bounds_are_read_with_their_unit(text: str, bound: Bound) -> None:
    got = read_bound(text)
    assert (got.name, got.relative) == (bound.name, bound.relative)
    assert got.limit == pytest.approx(bound.limit)


@pytest.mark.parametrize(
    "text",
    ["phi", "phi=", "phi=2", "phi=-1%", "force=2mm", "mass=2%", "=2%", "phi=nan%", "phi=2%%"],
)
def test_others_are_refused_by_name(text: str) -> None:
    with pytest.raises(InputError, match="--max-error"):
        read_bound(text)


def test_nan_keeps_no_bound() -> None:
    assert Verdict(Bound("travel", 1.0, False), 1.0).inside
    assert not Verdict(Bound("travel", 1.0, False), math.nan).inside


def test_bound_is_kept_only_where_enough_is_covered() -> None:
    bound = Bound("travel", 1.0, False)
    part = Coverage(share=0.5, largest_gap=0.0, span=10.0)
    assert not Verdict(bound, 0.0, part).inside
    assert Verdict(bound, 0.0, part, least=0.5).inside
    holed = Coverage(share=0.97, largest_gap=0.3, span=10.0)
    assert not Verdict(bound, 0.0, holed).inside
    assert Verdict(bound, 0.0, holed).cells()[3:] == ("97 %", "0.3 s", "NO: not covered")
