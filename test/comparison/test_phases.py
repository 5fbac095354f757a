"""Approach, enveloping, hold and lift."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.comparison.phases import HOLD, LIFT, PHASES, find_phases
from hma_gripper_sim.recordings.recording import Series

TIME = np.arange(0.0, 20.0, 0.01)


def stroke(time: np.ndarray) -> np.ndarray:
    """Rest for 1 s, 20 mm down in 5 s, 3 s of rest, up in 5 s, rest."""
    return np.interp(time, [1.0, 6.0, 9.0, 14.0], [0.0, 0.020, 0.020, 0.0])


def force(travel: np.ndarray) -> np.ndarray:
    """Free until 8 mm, then 1 N in 8 mm."""
    return -0.05 + np.clip(travel - 0.008, 0.0, 0.008) / 0.008


def durations(phases) -> dict[str, float]:
    total = {name: 0.0 for name in PHASES}
    for phase, start, end in phases.spans():
        if phase >= 0:
            total[PHASES[phase]] += end - start
    return total


@pytest.mark.parametrize("noise", [0.0, 0.005, 0.03])
def test_each_phase_is_found(noise: float) -> None:
    """Touch at 5 % of the force, 0.4 mm after 8 mm; or at five times the force's scatter."""
    rng = np.random.default_rng(3)
    travel = stroke(TIME)
    noisy = force(travel) + rng.normal(0.0, noise, len(TIME))
    phases = find_phases(
        Series(TIME, travel + rng.normal(0.0, 5e-6, len(TIME))), Series(TIME, noisy)
    )
    threshold = max(0.05, 5.0 * noise)
    assert phases.touch == pytest.approx(0.008 * (1.0 + threshold), abs=4e-4 + 0.008 * noise)
    found = durations(phases)
    assert found["approach"] == pytest.approx(250.0 * phases.touch, abs=0.15)
    assert found["enveloping"] == pytest.approx(250.0 * (0.020 - phases.touch), abs=0.15)
    assert found["hold"] == pytest.approx(3.0, abs=0.15)
    assert found["lift"] == pytest.approx(5.0, abs=0.15)
    assert phases.at(np.array([7.5, 11.0])).tolist() == [HOLD, LIFT]


def test_every_stroke_of_a_long_log_is_told_apart() -> None:
    time = np.arange(0.0, 60.0, 0.01)
    travel = stroke(time % 20.0)
    phases = find_phases(Series(time, travel), Series(time, force(travel)))
    assert durations(phases)["hold"] == pytest.approx(9.0, abs=0.3)


def test_without_force_there_is_no_touch() -> None:
    phases = find_phases(Series(TIME, stroke(TIME)), None)
    assert phases.touch is None
    assert durations(phases)["approach"] == pytest.approx(5.0, abs=0.15)
    assert durations(phases)["enveloping"] == durations(phases)["hold"] == 0.0
    assert "no force" in phases.definition
