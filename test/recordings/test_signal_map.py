"""Signal maps from files, and what is wrong with others."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml

from hma_gripper_sim import InputError, config_directory
from hma_gripper_sim.recordings.signal_map import SIGNAL_UNITS, Signal, SignalMap
from hma_gripper_sim.recordings.signal_sources import Field, Frame, LargestMagnitude


def one(**entry: Any) -> Signal:
    (signal,) = SignalMap.from_mapping({"travel": {"topic": "/a", "field": "b", **entry}}).signals
    return signal


def test_map_of_the_node_names_every_signal() -> None:
    signals = SignalMap.sim_node().signals
    assert {signal.name for signal in signals} == set(SIGNAL_UNITS)
    assert [signal.name for signal in signals if signal.optional] == ["velocity_command"]
    assert all((signal.scale, signal.offset, signal.tare) == (1.0, 0.0, 0.0) for signal in signals)


@pytest.mark.parametrize("path", sorted((config_directory() / "signal_maps").glob("*.yaml")))
def test_shipped_maps_can_be_read(path: Path) -> None:
    assert SignalMap.from_yaml(path).signals


def test_example_of_an_arm_means_what_its_comments_say() -> None:
    path = config_directory() / "signal_maps" / "robot_arm.yaml"
    signals = {signal.name: signal for signal in SignalMap.from_yaml(path).signals}
    assert signals["travel"].source == Field(
        "transform.translation.z", frame=Frame("base_link", "tool0")
    )
    assert (signals["travel"].scale, signals["travel"].tare) == (-1.0, 0.5)
    assert signals["actuator_force"].offset == -0.0444
    assert signals["phi_left"].scale == pytest.approx(math.radians(1.0))
    assert signals["velocity_command"].clock == "log"


@pytest.mark.parametrize(
    ("entry", "scale"),
    [
        ({"unit": "mm"}, 1e-3),
        ({"unit": "mm", "scale": -2}, -2e-3),
        ({"scale": -1}, -1.0),
        ({"unit": "inch"}, 0.0254),
    ],
)
def test_units_and_signs_make_a_factor(entry: dict[str, Any], scale: float) -> None:
    assert one(**entry).scale == pytest.approx(scale)


def test_sources_are_told_apart_by_what_selects() -> None:
    assert one().source == Field("b")
    assert one(joint="j").source == Field("b", joint="j")
    assert one(frame={"parent": "p", "child": "c"}).source == Field("b", frame=Frame("p", "c"))
    assert one(largest_but="slide").source == LargestMagnitude("b", without="slide")
    assert one(largest_of=["j", "k"]).source == LargestMagnitude("b", among=("j", "k"))
    assert one(publisher=3).publisher == "3"


@pytest.mark.parametrize(
    ("entries", "field", "reason"),
    [
        ({}, None, "names no signal"),
        ({"force": {}}, "force", "unknown field"),
        ({"travel": "/a"}, "travel", "expected a mapping"),
        ({"travel": []}, "travel", "expected a mapping"),
        ({"travel": [{"topic": "/a"}]}, "travel.field", "is missing"),
        ({"travel": {"topic": "/a"}}, "travel.field", "is missing"),
        ({"travel": {"field": "b"}}, "travel.topic", "is missing"),
        ({"travel": {"topic": 3, "field": "b"}}, "travel.topic", "expected a text"),
        ({"travel": {"topic": "/a", "feld": "b"}}, "travel.feld", "unknown field"),
    ],
)
def test_bad_maps_are_named(
    tmp_path: Path, entries: dict[str, Any], field: str | None, reason: str
) -> None:
    path = tmp_path / "map.yaml"
    path.write_text(yaml.safe_dump(entries), encoding="utf-8")
    with pytest.raises(InputError, match=reason) as caught:
        SignalMap.from_yaml(path)
    assert (caught.value.source, caught.value.field) == (str(path), field)


@pytest.mark.parametrize(
    ("key", "value", "field", "reason"),
    [
        ("unit", "N", "unit", "expected a number in m"),
        ("unit", 3, "unit", "expected a text"),
        ("unit", "25.4 mm", "unit", "expected a number in m"),
        ("scale", "-1 m", "scale", "expected a pure number"),
        ("scale", math.nan, "scale", "must be finite"),
        ("offset", "1 s", "offset", "expected a number in m"),
        ("tare", -1, "tare", "at least 0"),
        ("time", "receive", "time", "'header', 'log'"),
        ("optional", "yes please", "optional", "true or false"),
        ("joint", "", "joint", "expected a text"),
        ("largest_of", "j", "largest_of", "expected a list"),
        ("largest_of", [3], "largest_of", "expected a list"),
        ("frame", "tool", "frame", "'parent' and 'child'"),
        ("frame", {"child": "tool"}, "frame.parent", "is missing"),
        ("frame", {"parent": "a", "child": "b", "c": 1}, "frame.c", "unknown field"),
    ],
)
def test_bad_entries_are_named(key: str, value: Any, field: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason) as caught:
        one(**{key: value})
    assert caught.value.field == f"travel.{field}"


def test_two_selectors_are_refused() -> None:
    with pytest.raises(InputError, match="cannot stand beside 'joint'") as caught:
        one(joint="a", largest_but="b")
    assert caught.value.field == "travel.largest_but"
    with pytest.raises(InputError) as caught:
        SignalMap.from_mapping({"travel": {}}, field="log.signals")
    assert caught.value.field == "log.signals.travel.topic"
