"""How far two logs differ: every number by its definition."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.comparison.log_comparison import compare_recordings
from hma_gripper_sim.comparison.phases import Phases
from hma_gripper_sim.comparison.signal_errors import signal_errors
from hma_gripper_sim.recordings.recording import Recording, Series

TIME = np.arange(0.0, 10.0, 0.01)


def recording(**signals: Series) -> Recording:
    return Recording("log", signals, 0)


def errors_of(simulated: Recording, measured: Recording, *arguments):
    return {s.name: s for s in signal_errors(simulated, measured, *arguments)}


def test_errors_by_their_definitions() -> None:
    """Measured 2 sin t; simulated 0.1 more, and 0.5 more at one sample."""
    truth = 2.0 * np.sin(TIME)
    off = np.full(len(TIME), 0.1)
    off[300] = -0.5
    found = errors_of(
        recording(actuator_force=Series(TIME, truth + off)),
        recording(actuator_force=Series(TIME, truth)),
        None,
    )["actuator_force"].overall
    assert found.count == len(TIME)
    assert found.rmse == pytest.approx(np.sqrt((999 * 0.01 + 0.25) / 1000))
    assert found.maximum == pytest.approx(0.5)
    assert found.time == pytest.approx(3.0)
    assert found.bias == pytest.approx((999 * 0.1 - 0.5) / 1000)
    assert found.relative == pytest.approx(found.rmse / np.abs(truth).max())
    assert found.spread is None


def test_phases_are_told_apart() -> None:
    label = np.where(TIME < 4.0, 0, 1).astype(np.int8)
    found = errors_of(
        recording(travel=Series(TIME, np.where(TIME < 4.0, 1e-3, 3e-3))),
        recording(travel=Series(TIME, np.zeros(len(TIME)))),
        Phases(TIME, label, 0.005),
    )["travel"]
    assert list(found.phases) == ["approach", "enveloping"]
    assert found.phases["approach"].rmse == pytest.approx(1e-3)
    assert found.phases["enveloping"].bias == pytest.approx(3e-3)
    assert found.overall.relative is None  # nothing but zero was measured


def test_a_real_gripper_is_spread_and_errors_within_that_are_marked() -> None:
    """Left 112.1° and right 106.9° (Table 5.3, box); simulated 107.1° on both sides."""
    left, right, both = (np.radians(np.full(len(TIME), a)) for a in (112.1, 106.9, 107.1))
    found = errors_of(
        recording(phi_left=Series(TIME, both), phi_right=Series(TIME, both)),
        recording(phi_left=Series(TIME, left), phi_right=Series(TIME, right)),
        None,
        [7.0],
    )
    assert np.degrees(found["phi_left"].overall.spread) == pytest.approx(5.2)
    assert np.degrees(found["phi_mean"].overall.spread) == pytest.approx(2.6)
    assert all(signal.overall.within_spread for signal in found.values())
    (instant,) = found["phi_mean"].instants
    assert instant.relative == pytest.approx(abs(107.1 - 109.5) / 109.5)
    assert instant.within_spread
    off = errors_of(
        recording(phi_left=Series(TIME, both - 0.01), phi_right=Series(TIME, both - 0.01)),
        recording(phi_left=Series(TIME, left), phi_right=Series(TIME, right)),
        None,
    )
    assert not off["phi_mean"].overall.within_spread
    assert off["phi_right"].overall.within_spread


@pytest.mark.parametrize("swapped", [False, True])
def test_logs_of_different_rates_are_compared_at_the_samples_of_the_slower(swapped: bool) -> None:
    slow = np.arange(0.0, 10.0, 0.5)
    pair = [recording(travel=Series(t, 0.01 * t)) for t in (slow, TIME)]
    if swapped:
        pair.reverse()
    found = errors_of(*pair, None)["travel"]
    assert found.time == pytest.approx(slow)
    assert found.overall.maximum < 1e-15


def test_nothing_is_made_up_in_a_gap() -> None:
    """The measurement lacks 2 s in which the simulation went elsewhere and came back."""
    bump = np.where((TIME > 4.0) & (TIME < 6.0), 1.0, 0.0)
    kept = bump == 0.0
    found = errors_of(
        recording(actuator_force=Series(TIME, 1.0 + bump)),
        recording(actuator_force=Series(TIME[kept], np.ones(kept.sum()))),
        None,
    )["actuator_force"]
    assert found.overall.maximum == 0.0
    sparse = np.arange(0.0, 10.0, 0.1)
    found = errors_of(
        recording(actuator_force=Series(sparse, 2.0 * np.ones(len(sparse)))),
        recording(actuator_force=Series(TIME[kept], np.ones(kept.sum()))),
        None,
    )["actuator_force"]
    assert found.skipped == 19


def test_only_common_times_and_signals_are_compared() -> None:
    found = errors_of(
        recording(travel=Series(TIME, TIME), phi_left=Series(TIME, TIME)),
        recording(travel=Series(TIME + 8.0, TIME + 8.0), phi_right=Series(TIME, TIME)),
        None,
    )
    assert list(found) == ["travel"]
    assert found["travel"].time[0] == pytest.approx(8.0)
    assert found["travel"].overall.maximum < 1e-12


def test_a_single_sample_can_be_compared() -> None:
    one = recording(travel=Series(np.zeros(1), np.array([0.001])))
    (signal,) = compare_recordings(one, one, title="one").signals
    assert (signal.overall.count, signal.overall.maximum) == (1, 0.0)
