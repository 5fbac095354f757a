"""Signals that no gripper gives: each cause is named, and a good log is left alone."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from hma_gripper_sim.recordings.plausibility import doubts
from hma_gripper_sim.recordings.recording import Series
from hma_gripper_sim.recordings.signal_map import SignalMap

TIME = np.arange(0.0, 18.0, 0.01)
TRAVEL = np.interp(TIME, [1.0, 8.0, 10.0, 17.0], [0.0, 0.028, 0.028, 0.0])
PRESSED = np.maximum(0.0, TRAVEL - 0.005)
FORCE = -0.0444 + 20.0 * PRESSED
PHI = np.radians(97.0) + 6.0 * PRESSED
MAP = SignalMap.from_mapping(
    {
        "travel": {"topic": "/a", "field": "a", "tare": "0.5 s"},
        "actuator_force": {"topic": "/b", "field": "b", "tare": "0.5 s"},
        "phi_left": {"topic": "/c", "field": "c"},
    }
).signals


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
