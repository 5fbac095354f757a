"""What is said of a log before anyone has a signal map for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hma_gripper_sim.recordings.inspection import inspect_log, inspection_table

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


def test_damage_and_silence_are_said(entries: list[Any], write_log: Callable[..., Path]) -> None:
    path = write_log([entry for entry in entries if "phi" not in entry[0].name])
    file = next(path.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:-10])
    notes = inspect_log(path).notes
    assert any("is truncated" in note for note in notes)
    assert "/hma_gripper_sim/phi: no messages" in notes
