"""Trajectories: the polynomials between way points, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from hma_gripper_sim import InputError
from hma_gripper_sim.motion.trajectory import Trajectory, WayPoint


def points(*rows):
    """Way points of (time, position, velocity, acceleration), the last two optional."""
    names = ("time", "position", "velocity", "acceleration")
    return [WayPoint(**dict(zip(names, row, strict=False))) for row in rows]


def hermite(duration, start, end):
    """The polynomial with these values and derivatives at 0 and `duration`."""
    degree = 2 * len(start) - 1
    powers = [Polynomial.basis(i) for i in range(degree + 1)]
    matrix = [[p.deriv(k)(t) for p in powers] for t in (0.0, duration) for k in range(len(start))]
    return Polynomial(np.linalg.solve(matrix, [*start, *end]))


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((0.001,), (0.004,)),
        ((0.001, 0.02), (0.004, -0.01)),
        ((0.001, 0.02, 0.5), (0.004, -0.01, -0.3)),
    ],
    ids=["linear", "cubic", "quintic"],
)
def test_what_both_points_give_decides_the_polynomial(start, end):
    trajectory = Trajectory(points((0.0, *start), (0.5, *end), (0.9, 0.005, 0.0)))
    spline = trajectory.spline(0.0, 0.0, 0.0)
    expected = hermite(0.5, start, end)
    for t in (0.0, 0.1, 0.3, 0.49):
        assert spline.at(t) == pytest.approx((expected(t), expected.deriv()(t)), abs=1e-12)


def test_what_only_one_of_two_points_gives_is_not_used():
    given = Trajectory(points((0.0, 0.0, 0.3), (1.0, 0.01)))
    assert given.spline(0.0, 0.0, 0.0).at(0.25) == pytest.approx((0.0025, 0.01), abs=1e-15)


def test_it_starts_from_where_the_joint_is_and_ends_in_a_standstill():
    trajectory = Trajectory(points((1.0, 0.01, 0.0)))
    spline = trajectory.spline(0.0, 0.002, 0.004)
    expected = hermite(1.0, (0.002, 0.004), (0.01, 0.0))
    assert spline.at(0.4) == pytest.approx((expected(0.4), expected.deriv()(0.4)), abs=1e-12)
    assert spline.at(1.0) == spline.at(50.0) == (0.01, 0.0)


def test_it_may_have_begun_in_the_past():
    trajectory = Trajectory(points((0.0, 0.0, 0.0), (1.0, 0.01, 0.0)))
    expected = hermite(1.0, (0.0, 0.0), (0.01, 0.0))
    spline = trajectory.spline(0.6, 0.5, 0.5)  # where the joint is does not matter then
    assert spline.at(0.7) == pytest.approx((expected(0.7), expected.deriv()(0.7)), abs=1e-12)


def test_velocities_alone_are_integrated_from_where_the_joint_is():
    rows = [(0.1, None, 0.02), (0.5, None, 0.02), (0.7, None, 0.0)]
    spline = Trajectory(points(*rows)).spline(0.0, 0.003, 0.0)
    # Velocity is linear between the points: trapezoids.
    for t, travelled in ((0.1, 0.001), (0.5, 0.009), (0.6, 0.0105), (0.7, 0.011)):
        assert spline.at(t)[0] == pytest.approx(0.003 + travelled, abs=1e-12)
    assert spline.at(0.3)[1] == pytest.approx(0.02, abs=1e-12)
    late = Trajectory(points(*rows)).spline(0.3, 0.003, 0.0)
    assert late.at(0.3) == pytest.approx((0.003, 0.02), abs=1e-12)
    assert late.at(0.9) == pytest.approx((0.003 + 0.006, 0.0), abs=1e-12)


def test_a_moving_end_is_for_those_who_allow_it():
    rows = points((0.0, 0.0, 0.0), (1.0, 0.01, 0.01))
    with pytest.raises(InputError, match="allow_nonzero_velocity_at_trajectory_end"):
        Trajectory(rows)
    spline = Trajectory(rows, moving_end=True).spline(0.0, 0.0, 0.0)
    assert spline.at(0.999999)[1] == pytest.approx(0.01, abs=1e-6)
    assert spline.at(1.0) == (0.01, 0.0)


@pytest.mark.parametrize(
    ("rows", "field", "reason"),
    [
        ([], "points", "no way points"),
        ([(0.0, math.nan)], "points[0].position", "finite"),
        ([(0.0, math.inf)], "points[0].position", "finite"),
        ([(math.nan, 0.0)], "points[0].time", "finite"),
        ([(-0.1, 0.0)], "points[0].time", "at least 0"),
        ([(0.0, 1e300)], "points[0].position", "at most"),
        ([(0.0, 0.0, 0.0, math.nan)], "points[0].acceleration", "finite"),
        ([(0.0, 0.0), (0.0, 0.1)], "points[1].time", "later"),
        ([(0.2, 0.0), (0.1, 0.1)], "points[1].time", "later"),
        ([(0.0, 0.0), (1e-300, 0.1)], "points[1].time", "later"),
        ([(0.0,)], "points[0].position", "or a velocity"),
        ([(0.0, 0.0), (1.0, None, 0.0)], "points[1].position", "all points or for none"),
        ([(0.0, 0.0, 0.0), (1.0, 0.01, 0.01)], "points[1].velocity", "0 at the last"),
    ],
)
def test_what_cannot_be_followed_is_refused_by_point_and_field(rows, field, reason):
    with pytest.raises(InputError) as caught:
        Trajectory(points(*rows))
    assert caught.value.field == field
    assert reason in caught.value.reason
