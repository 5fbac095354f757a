"""Matching the time of two logs."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.comparison.alignment import align_recordings, best_offset, estimated_delay
from hma_gripper_sim.recordings.recording import Recording, Series

START = 1_700_000_000_000_000_000


def stroke(time: np.ndarray) -> np.ndarray:
    """Down by 12 mm in 3 s from 1 s on, a second of rest, and up again [m]."""
    return np.interp(time, [1.0, 4.0, 5.0, 8.0], [0.0, 0.012, 0.012, 0.0])


def recording(start: int, time: np.ndarray, travel: np.ndarray) -> Recording:
    return Recording("log", {"travel": Series(time, travel)}, start)


def test_logs_of_one_clock_are_matched_by_their_stamps() -> None:
    """Also where the travels would match better otherwise: the difference is a result."""
    time = np.arange(0.0, 9.0, 0.01)
    measured = recording(START, time, stroke(time))
    simulated = recording(START + 500_000_000, time, stroke(time + 0.7))
    moved, alignment = align_recordings(simulated, measured)
    assert alignment.method == "stamps"
    assert moved["travel"].time == pytest.approx(time + 0.5)
    assert moved.start == measured.start
    # 0.2 s at 4 mm/s, over the two thirds of the time that it moves.
    assert alignment.travel_rmse == pytest.approx(0.0008 * np.sqrt(2 / 3), rel=0.1)


@pytest.mark.parametrize("delay", [-3.21, 0.0, 0.123, 17.3])
@pytest.mark.parametrize("period", [0.001, 0.037])
def test_others_are_matched_by_their_travel(delay: float, period: float) -> None:
    rng = np.random.default_rng(7)
    ours = np.arange(0.0, 9.0, 0.01)
    theirs = np.arange(-1.0, 10.0, period)
    noise = rng.normal(0.0, 2e-5, len(theirs))
    simulated = recording(0, ours + delay, stroke(ours))
    measured = recording(START, theirs, stroke(theirs) + noise)
    moved, alignment = align_recordings(simulated, measured)
    assert alignment.method == "travel"
    # Noise σ on n samples of which two thirds move at v: σ / (v √(2n/3)); five times that.
    spread = 2e-5 / (0.004 * np.sqrt(len(theirs) * 6 / 11))
    assert alignment.offset == pytest.approx(delay, abs=5 * spread + 1e-4)
    assert moved["travel"].time[0] == pytest.approx(0.0, abs=5 * spread + 1e-4)
    assert "shifted" in alignment.description


def test_a_short_log_within_a_long_one_is_found() -> None:
    long = np.arange(0.0, 300.0, 0.01)
    many = np.interp(long % 20.0, [5.0, 8.0, 9.0, 12.0], [0.0, 0.012, 0.012, 0.0])
    many[(long > 200.0) & (long < 220.0)] *= 0.5  # the odd one out
    short = np.arange(0.0, 20.0, 0.01)
    odd = 0.5 * np.interp(short, [5.0, 8.0, 9.0, 12.0], [0.0, 0.012, 0.012, 0.0])
    assert best_offset(Series(short, odd), Series(long, many)) == pytest.approx(-200.0, abs=1e-3)


def test_what_cannot_be_matched_is_refused() -> None:
    time = np.arange(0.0, 9.0, 0.01)
    moving = recording(START, time, stroke(time))
    still = recording(0, time, np.zeros(len(time)))
    with pytest.raises(InputError, match="simulated travel never changes"):
        align_recordings(still, moving)
    with pytest.raises(InputError, match="do not overlap"):
        align_recordings(still, moving, "stamps")
    blind = Recording("blind", {"phi_left": Series(time, time)}, 0)
    with pytest.raises(InputError, match="blind: travel: no such signal"):
        align_recordings(blind, moving)


@pytest.mark.parametrize("delay", [0.5, 0.1, 0.05, -0.3])
def test_signal_that_is_late_is_told(delay: float) -> None:
    time = np.arange(0.0, 14.0, 0.01)
    force = np.maximum(0.0, np.sin(0.5 * time)) ** 3
    late = Series(time + delay, force + np.random.default_rng(1).normal(0.0, 0.01, time.size))
    found = estimated_delay(Series(time, force), late)
    assert found is not None
    assert found[0] == pytest.approx(delay, abs=5e-3)
    assert found[1] < 0.8
    assert estimated_delay(Series(time, force), Series(time, force)) == (0.0, 1.0)
    assert estimated_delay(Series(time[:200], force[:200]), late) is None
