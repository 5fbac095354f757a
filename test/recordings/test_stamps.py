"""Stamps that run back, jump, or were never set."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.recordings.stamps import (
    MAX_GAP,
    MAX_SETBACK,
    are_set,
    in_order,
    refuse_other_clocks,
)

START, SECOND = 1_700_000_000 * 10**9, 10**9  # ns
YEAR = round(365.25 * 86_400) * SECOND


def stamps(*seconds: float) -> np.ndarray:
    return np.array([START + round(second * SECOND) for second in seconds])


def test_time_that_never_runs_back_is_kept() -> None:
    """Also if it stands still, as in a log of a paused node, or rests for an hour."""
    kept, left_out = in_order(stamps(0.0, 0.1, 0.1, 0.2, 3600.0), "header")
    assert kept.all()
    assert left_out is None


def test_samples_that_are_out_of_order_are_left_out_and_counted() -> None:
    kept, left_out = in_order(stamps(0.0, 0.2, 0.1, 0.3, 0.25, 0.29, 0.4), "header")
    assert kept.tolist() == [True, True, False, True, False, False, True]
    assert left_out == (
        "3 of 7 samples left out because their time runs back, by at most 0.1 s, "
        "the first at stamp 1700000000.100000 s"
    )


def test_bounds_are_inclusive() -> None:
    edge = np.array([START, START + MAX_SETBACK, START, START + MAX_SETBACK + MAX_GAP])
    assert in_order(edge, "header")[0].tolist() == [True, True, False, True]


@pytest.mark.parametrize(
    ("shift", "reason"),
    [
        (-2 * SECOND, "time runs back by 1.9 s at stamp 1699999998.200000 s"),
        (-3 * YEAR, "time runs back by 3.0 years"),
        (3 * YEAR, "time jumps ahead by 3.0 years at stamp 1700000000.100000 s"),
        (2 * 86_400 * SECOND, "time jumps ahead by 2.0 days"),
    ],
)
def test_other_times_are_refused(shift: int, reason: str) -> None:
    times = stamps(0.0, 0.1, 0.2, 0.3)
    times[2:] += shift
    with pytest.raises(InputError, match=f"{reason}.*; 'time: log' in a signal map"):
        in_order(times, "header")
    with pytest.raises(InputError, match=reason) as caught:
        in_order(times, "log")
    assert "signal map" not in str(caught.value)


def test_single_sample_from_the_future_is_refused() -> None:
    times = stamps(0.0, 0.1, 0.2)
    times[1] += 2 * YEAR
    with pytest.raises(InputError, match=r"runs back by 2.0 years at stamp 1700000000.200000 s"):
        in_order(times, "header")


def test_stamps_that_were_never_set_are_refused() -> None:
    zeros = np.zeros(5, dtype=np.int64)
    with pytest.raises(InputError, match="its stamps are not set; 'time: log'"):
        are_set(zeros, stamps(0, 1, 2, 3, 4), "header")
    assert are_set(zeros, stamps(0, 1, 2, 3, 4), "log")[0].all()
    assert are_set(zeros, zeros, "header")[0].all()  # all of it at the beginning of simulated time


def test_stamps_before_the_clock_came_are_left_out() -> None:
    """Two messages with 0, then the time of a simulation that runs since 42 s."""
    times = np.array([0, 0, 42, 43, 44]) * SECOND
    kept, left_out = are_set(times, stamps(0, 1, 2, 3, 4), "header")
    assert kept.tolist() == [False, False, True, True, True]
    assert left_out == "2 of 5 samples left out because their stamp is not set (0)"


def test_stamp_that_is_lost_in_between_is_left_out() -> None:
    times = np.array([42, 43, 0, 44]) * SECOND
    assert are_set(times, stamps(0, 1, 2, 3), "header")[0].tolist() == [True, True, False, True]


@pytest.mark.parametrize(
    ("times", "logged"),
    [
        ([0.0, 0.1, 0.2, 0.3], [0.0, 0.1, 0.2, 0.3]),  # simulated time from 0 on
        ([0.0, 0.0, 0.1, 0.2], [0.0, 50.0, 99.0, 99.1]),  # paused at 0
        ([0.0, 5.0, 10.0, 15.0], [0.0, 0.1, 0.2, 0.3]),  # ten times as fast
        ([0.0, 42.0], [7.0, 49.0]),  # sent twice
    ],
)
def test_time_that_begins_at_0_is_kept(times: list[float], logged: list[float]) -> None:
    kept, left_out = are_set((np.array(times) * SECOND).astype(np.int64), stamps(*logged), "header")
    assert kept.all()
    assert left_out is None


def test_signals_of_different_clocks_are_refused() -> None:
    """One in simulated time, the other in the time of day."""
    refuse_other_clocks({})
    refuse_other_clocks({"travel": START, "phi_left": START + MAX_GAP})
    reason = r"travel begins 53.9 years after phi_left: their stamps are of different clocks"
    with pytest.raises(InputError, match=reason):
        refuse_other_clocks({"travel": START, "phi_left": 17 * SECOND})
