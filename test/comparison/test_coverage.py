"""How much of a measured signal is covered."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.comparison.coverage import ENOUGH, coverage, known_at
from hma_gripper_sim.recordings.recording import Series


def series(*times: float) -> Series:
    return Series(np.array(times), np.zeros(len(times)))


def every(period: float, start: float, end: float) -> np.ndarray:
    return np.arange(round(start / period), round(end / period) + 1) * period


MEASURED = series(*every(0.01, 0.0, 14.0))


@pytest.mark.parametrize(
    ("times", "share", "gap", "enough"),
    [
        (every(0.01, 0.0, 14.0), 1.0, 0.0, True),
        (every(0.1, -3.0, 20.0), 1.0, 0.0, True),
        (every(0.01, 0.0, 0.25), 0.25 / 14.0, 0.0, False),
        (every(0.01, 0.4, 13.8), 13.4 / 14.0, 0.0, True),
        (np.r_[every(0.01, 0.0, 2.0), every(0.01, 12.0, 14.0)], 4.0 / 14.0, 10.0, False),
        (np.r_[every(0.01, 0.0, 5.0), every(0.01, 5.3, 14.0)], 13.7 / 14.0, 0.3, False),
        (np.r_[every(0.01, 0.0, 5.0), every(0.01, 5.1, 14.0)], 13.9 / 14.0, 0.1, True),
        (np.array([1.0]), 0.0, 0.0, False),
        (every(0.01, 20.0, 30.0), 0.0, 0.0, False),
    ],
)
def test_share_and_largest_gap(times: np.ndarray, share: float, gap: float, enough: bool) -> None:
    found = coverage(series(*times), MEASURED)
    assert found.share == pytest.approx(share, abs=1e-9)
    assert found.largest_gap == pytest.approx(gap, abs=1e-9)
    assert found.is_enough(ENOUGH) is enough


def test_what_was_not_measured_need_not_be_covered() -> None:
    measured = series(*every(0.01, 0.0, 2.0), *every(0.01, 12.0, 14.0))
    found = coverage(measured, measured)
    assert (found.share, found.largest_gap) == (1.0, 0.0)
    assert found.span == pytest.approx(4.0)


def test_signal_is_known_at_its_samples_and_between_near_ones() -> None:
    times = np.array([-0.1, 0.0, 0.5, 2.0, 2.5, 9.0, 9.5, 11.0])
    known = known_at(series(0.0, 1.0, 2.0, 9.0, 10.0), times)
    assert known.tolist() == [False, True, True, True, False, True, True, False]


def test_single_sample_is_covered_or_not() -> None:
    assert coverage(MEASURED, series(3.0)).is_enough(ENOUGH)
    assert coverage(series(3.0), series(3.0)).is_enough(ENOUGH)
    assert not coverage(MEASURED, series(15.0)).is_enough(ENOUGH)
