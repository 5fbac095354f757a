"""Signals that no gripper gives: each cause is named, and a good log is left alone."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from hma_gripper_sim import GripperDesign, RoundedBox, Scene, simulate
from hma_gripper_sim.recordings.plausibility import doubts, has_known_zero
from hma_gripper_sim.recordings.recording import Recording, Series
from hma_gripper_sim.recordings.signal_map import SignalMap

TIME = np.arange(0.0, 18.0, 0.01)
TRAVEL = np.interp(TIME, [1.0, 8.0, 10.0, 17.0], [0.0, 0.028, 0.028, 0.0])
PRESSED = np.maximum(0.0, TRAVEL - 0.005)
FORCE = -0.0444 + 20.0 * PRESSED
PHI = np.radians(97.0) + 6.0 * PRESSED
SIGNAL_MAP = SignalMap.from_mapping(
    {
        "travel": {"topic": "/a", "field": "a", "tare": "0.5 s"},
        "actuator_force": {"topic": "/b", "field": "b", "tare": "0.5 s"},
        "phi_left": {"topic": "/c", "field": "c"},
    }
)
MAP = SIGNAL_MAP.signals


def said(begin: float = 0.0, **changed: np.ndarray) -> list[str]:
    courses = {"travel": TRAVEL, "actuator_force": FORCE, "phi_left": PHI, **changed}
    kept = begin <= TIME
    signals = {name: Series(TIME[kept], value[kept]) for name, value in courses.items()}
    return list(doubts(signals, MAP))


def test_good_log_is_left_alone() -> None:
    assert said() == []
    assert said(actuator_force=FORCE + np.random.default_rng(1).normal(0, 0.02, FORCE.size)) == []


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        (
            {"phi_left": np.degrees(PHI)},
            "phi_left: reaches 6011°, which no angle .*'unit: deg'",
        ),
        ({"phi_left": np.radians(PHI)}, "phi_left: never exceeds 1.8°: is it in radians"),
        ({"travel": 1000.0 * TRAVEL}, "travel: ranges over 28 m: .*'unit: mm'"),
        (
            {"actuator_force": -FORCE},
            "falls by 0.404 N on the way down and .*scale: -1",
        ),
    ],
)
def test_wrong_units_and_signs_are_named(changed: dict[str, Any], reason: str) -> None:
    (doubt,) = said(**changed)
    assert re.search(reason, doubt), doubt


@pytest.mark.parametrize("delay", [0.3, -0.4])
@pytest.mark.parametrize("scatter", [0.0, 0.02])
def test_force_of_another_clock_is_named_with_how_far_it_is_off(
    delay: float, scatter: float
) -> None:
    """Of a gripper whose force and φ bend at the touch; 4 mm/s.

    The force then grows by 0.08 N/s: of some 100 samples with the scatter the bend's place has a
    standard error of about 2 / √100 times 0.02 N over that, 0.05 s.
    """
    force = np.interp(TIME - delay, TIME, FORCE)
    force += np.random.default_rng(1).normal(0.0, scatter, TIME.size)
    (doubt,) = said(actuator_force=force)
    found = re.fullmatch(
        r"actuator_force: begins to change (\S+) s, or (\S+) mm of the way, (before|after) φ, .*"
        r"'delay' in the signal map.*",
        doubt,
    )
    assert found is not None, doubt
    assert float(found[1]) == pytest.approx(abs(delay), abs=0.02 + 2.5 * scatter)
    assert float(found[2]) == pytest.approx(4.0 * float(found[1]), abs=0.1)
    assert found[3] == ("after" if delay > 0.0 else "before")


def test_small_delay_is_left_to_the_model() -> None:
    """0.05 s at 4 mm/s are 0.2 mm: the courses of force and φ may differ by as much."""
    assert said(actuator_force=np.interp(TIME - 0.05, TIME, FORCE)) == []


@pytest.mark.parametrize(("velocity", "friction"), [(0.02, 0.0), (0.002, 0.6)])
def test_clocks_of_a_simulated_gripper_are_not_in_doubt(velocity: float, friction: float) -> None:
    """The two of 48 scenes in which the onsets of force and φ are furthest apart, either way."""
    scene = Scene(
        GripperDesign.thesis_2013(),
        RoundedBox(0.03, 0.02, 0.002),
        friction=friction,
        clearance=0.004,
        discretisation="gauss",
        elements_top=1,
        elements_beam=4,
    )
    trace = simulate(scene, velocity, 0.024 / velocity)
    names = ("travel", "actuator_force", "phi_left", "phi_right")
    signals = {name: Series(trace.time, getattr(trace, name)) for name in names}
    assert list(doubts(signals, ())) == []


def test_tare_in_motion_and_under_load_is_named() -> None:
    """The log begins when the gripper has touched, and still goes down."""
    first, second, third = said(begin=3.2)
    assert first == (
        "travel: its tare was taken in motion: the travel changed by 2 mm in these 0.5 s"
    )
    assert second.startswith("actuator_force: its tare was taken in motion")
    assert third == (
        "actuator_force: its tare was taken 9.8 mm below the top of the stroke: was the gripper "
        "under load?"
    )


@pytest.mark.parametrize(
    ("begin", "known"),
    [(0.0, True), (0.7, True), (1.2, False), (3.2, False), (7.6, False), (8.5, True), (12, False)],
)
def test_zero_of_a_travel_that_never_rested_is_unknown(begin: float, known: bool) -> None:
    """It goes down from 1 s to 8 s, and up from 10 s on; the tare takes half a second."""
    kept = begin <= TIME
    noise = np.random.default_rng(2).normal(0.0, 1e-4, TIME.size)
    for travel in (TRAVEL, TRAVEL + noise):
        log = Recording("a log", {"travel": Series(TIME[kept], travel[kept])}, 0)
        assert has_known_zero(log, SIGNAL_MAP) == known
        assert has_known_zero(log, None)
