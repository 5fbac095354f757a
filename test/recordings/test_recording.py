"""Signals between and beyond their samples."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hma_gripper_sim.recordings.recording import Series


def test_a_record_holds_a_lost_message_beyond_its_ends_and_no_more():
    series = Series(np.array([0.1, 0.2, 0.3, 0.4]), np.array([1.0, 2.0, 4.0, 8.0]))
    assert series.at(0.25) == pytest.approx(3.0)
    assert (series.at(0.0), series.at(0.5)) == (1.0, 8.0)
    assert math.isnan(series.at(-0.06))
    assert math.isnan(series.at(0.56))


def test_a_single_sample_holds_at_its_instant_only():
    series = Series(np.array([0.1]), np.array([1.0]))
    assert series.at(0.1) == 1.0
    assert math.isnan(series.at(0.2))
    assert math.isnan(Series(np.zeros(0), np.zeros(0)).at(0.0))
