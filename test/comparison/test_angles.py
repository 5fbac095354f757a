"""Rows of Table 5.3."""

from __future__ import annotations

import math

import pytest

from hma_gripper_sim.comparison.angles import ANGLE_HEADINGS, AngleComparison


def row(simulated: float, left: float, right: float, uncertainty: float = 0.5) -> AngleComparison:
    angles = map(math.radians, (simulated, left, right, uncertainty))
    return AngleComparison("Box", 7.0, *angles)


@pytest.mark.parametrize(
    ("simulated", "left", "right", "average", "percent"),
    [(107.4, 112.1, 106.9, 109.5, 1.9), (107.0, 110.3, 106.8, 108.55, 1.5)],
)
def test_the_thesis_own_rows(
    simulated: float, left: float, right: float, average: float, percent: float
) -> None:
    """Table 5.3 prints 1.9 % and 1.5 %, computed from a mean that was rounded to 0.1°."""
    compared = row(simulated, left, right)
    assert math.degrees(compared.average) == pytest.approx(average)
    assert 100.0 * compared.relative_error == pytest.approx(percent, abs=0.1)
    assert len(compared.cells()) == len(ANGLE_HEADINGS)


@pytest.mark.parametrize(
    ("simulated", "verdict"),
    [
        (109.5, "inside"),
        (106.95, "inside"),
        (106.85, "within reading"),
        (106.45, "within reading"),
        (106.35, "outside"),
        (112.55, "within reading"),
        (112.65, "outside"),
    ],
)
def test_inside_is_between_left_and_right(simulated: float, verdict: str) -> None:
    """Left 112.1°, right 106.9°, each read to 0.5°."""
    compared = row(simulated, 112.1, 106.9)
    assert math.degrees(compared.spread) == pytest.approx(2.6)
    assert compared.verdict == verdict
