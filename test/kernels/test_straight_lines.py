"""Straight lines through measured points keep within their tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hma_gripper_sim.kernels.straight_lines import trend_corners

TOLERANCE = 0.1


def corners(time, value, tolerance=TOLERANCE):
    kept = np.empty(len(time), dtype=np.intp)
    return kept[: trend_corners(time, value, tolerance, kept)]


@settings(deadline=None)  # the kernel may have to be compiled first
@given(st.lists(st.floats(-3.0, 3.0), min_size=2, max_size=60))
def test_no_point_is_missed_by_more_than_the_tolerance(values: list[float]) -> None:
    time, value = np.arange(float(len(values))), np.array(values)
    kept = corners(time, value)
    assert kept[0] == 0
    assert kept[-1] == len(values) - 1
    error = np.abs(np.interp(time, time[kept], value[kept]) - value).max()
    assert error <= TOLERANCE * (1.0 + 1e-9)


def test_a_straight_line_needs_two_points_and_a_kink_a_third() -> None:
    time = np.linspace(0.0, 1.0, 101)
    assert corners(time, 3.0 * time).tolist() == [0, 100]
    kept = corners(time, 30.0 * np.abs(time - 0.5), 1e-6)
    assert kept.tolist() == [0, 50, 100]


def test_a_wider_tolerance_smooths_noise() -> None:
    time = np.linspace(0.0, 1.0, 1001)
    noisy = 5.0 * time + np.random.default_rng(1).uniform(-0.04, 0.04, len(time))
    assert len(corners(time, noisy, 0.1)) < 0.05 * len(corners(time, noisy, 1e-3))
    assert len(corners(time, noisy, 1e-3)) == pytest.approx(1001, rel=0.2)
