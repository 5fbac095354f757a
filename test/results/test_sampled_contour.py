"""What fits between the points of a sampled contour, from plane geometry."""

from __future__ import annotations

import dataclasses
import math

import pytest

from hma_gripper_sim import Circle, GripperDesign, Polygon, RoundedBox
from hma_gripper_sim.results.sampled_contour import hidden_depth, largest_spacing, smallest_width

SPACING = 0.003  # m


def test_largest_spacing_of_the_thesis(design: GripperDesign) -> None:
    """Its points 5 and 12 (A.1), neighbours on the flank; the unsampled back is no gap."""
    wanted = 1e-3 * math.dist((14.44333354, -3.55666646), (16.60000922, -1.39999078))
    assert largest_spacing(design.tip) == pytest.approx(wanted, rel=1e-6)


def test_two_points_have_no_other_side(design: GripperDesign) -> None:
    tip = dataclasses.replace(
        design.tip, points=design.tip.points[:2], normal_angles=design.tip.normal_angles[:2]
    )
    assert largest_spacing(tip) == math.inf


@pytest.mark.parametrize(
    ("contour", "width"),
    [
        (Circle(0.004), 0.008),
        (RoundedBox(0.03, 0.002), 0.002),
        (RoundedBox(0.03, 0.002, 0.001), 0.002),
        (
            Polygon([(0.0, 0.0), (0.03, 0.03), (0.029, 0.031), (-0.001, 0.001)]),
            0.001 * math.sqrt(2),
        ),
        (Polygon([(0.0, 0.0), (0.02, 0.0), (0.01, math.sqrt(3) * 0.01)]), math.sqrt(3) * 0.01),
    ],
)
def test_smallest_width(contour: Circle | RoundedBox | Polygon, width: float) -> None:
    """Diameter, thickness (straight or slanting), height of an equilateral triangle."""
    assert smallest_width(contour) == pytest.approx(width, rel=1e-9)


@pytest.mark.parametrize(
    ("contour", "depth"),
    [
        (RoundedBox(0.02, 0.02), 0.5 * SPACING),  # a right angle is as wide as twice its depth
        (Circle(0.01), 0.01 - math.sqrt(0.01**2 - 0.0015**2)),
        (RoundedBox(0.02, 0.02, 0.005), 0.005 - math.sqrt(0.005**2 - 0.0015**2)),
        # Rounded by 1 mm: the sharp corner's depth less what the rounding cuts off.
        (RoundedBox(0.02, 0.02, 0.001), 0.5 * SPACING - 0.001 * (math.sqrt(2.0) - 1.0)),
        (
            Polygon([(0.0, 0.0), (0.02, 0.0), (0.01, math.sqrt(3) * 0.01)]),
            0.5 * SPACING * math.sqrt(3.0),
        ),
    ],
)
def test_hidden_depth(contour: Circle | RoundedBox | Polygon, depth: float) -> None:
    """How far a corner is in where it is as wide as the two points are apart."""
    assert hidden_depth(contour, SPACING) == pytest.approx(depth, rel=1e-9)
