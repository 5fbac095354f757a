"""What is said of a log before anyone has a signal map for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from hma_gripper_sim.recordings.inspection import (
    inspect_log,
    inspection_table,
    quoted,
    starter_map,
)
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.signal_map import SignalMap

START, PERIOD = 1_700_000_000_123_456_789, 10_000_000  # ns


def test_topics_joints_frames_fields_and_rates(stored_log: Path) -> None:
    """Of every storage."""
    found = inspect_log(stored_log)
    assert found.span == (START, START + 4 * PERIOD)
    by_topic: dict[str, Any] = {}
    for sender in found.senders:
        by_topic.setdefault(sender.connection.topic, []).append(sender)
    assert set(by_topic) == {
        "/joint_states",
        "/hma_gripper_sim/actuator_wrench",
        "/hma_gripper_sim/phi",
        "/hma_gripper_sim/contour",
    }
    assert sum(sender.count for sender in by_topic["/joint_states"]) == 5
    joints = by_topic["/joint_states"][0]
    assert list(joints.joints) == ["slide", "a", "b"]
    assert list(joints.fields) == ["position[]", "velocity[]", "effort[]"]
    assert joints.is_stamped
    (wrench, *_) = by_topic["/hma_gripper_sim/actuator_wrench"]
    assert list(wrench.frames) == ["gripper_mount"]
    assert wrench.connection.msgtype == "geometry_msgs/msg/WrenchStamped"
    if len(by_topic["/joint_states"]) == 1:
        assert abs(joints.rate - 100.0) < 1e-6
    assert inspection_table(found).row_count == len(found.senders)


def test_starter_map_reads_the_log_it_was_made_of(five_ticks: Path) -> None:
    expected = read_recording(five_ticks)
    starter = SignalMap.from_mapping(yaml.safe_load(starter_map(inspect_log(five_ticks))))
    recording = read_recording(five_ticks, starter)
    for name in ("travel", "actuator_force", "phi_left", "phi_right"):
        assert recording[name].value.tolist() == expected[name].value.tolist()


def test_starter_map_names_the_publisher_where_there_are_two(
    entries: list[Any], by_two_callers: Callable[..., Path]
) -> None:
    starter = starter_map(inspect_log(by_two_callers(entries)))
    assert "actuator_force: {topic: /hma_gripper_sim/actuator_wrench, publisher: /a, " in starter
    assert "publisher: /b" in starter
    assert "# travel: found nothing that it could be" in starter


def test_damage_and_silence_are_said(entries: list[Any], write_log: Callable[..., Path]) -> None:
    path = write_log([entry for entry in entries if "phi" not in entry[0].name])
    file = next(path.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-10])
    notes = inspect_log(path).notes
    assert any("is truncated" in note for note in notes)
    assert "/hma_gripper_sim/phi: no messages" in notes


@pytest.mark.parametrize("name", ["/plain", "/two\nlines", "/red\x1b[31m", "it's", "-dash", "ü: x"])
def test_names_stand_in_a_map_as_one_printable_line(name: str) -> None:
    """Whatever a topic is called, the map gives it back, without control codes."""
    line = f"{{topic: {quoted(name)}}}"
    assert line.isprintable()
    assert yaml.safe_load(line) == {"topic": name}
