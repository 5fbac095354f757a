"""Signals and poses read back from logs, and logs that cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.recordings.reading import read_messages, read_poses, read_recording
from hma_gripper_sim.recordings.recording import Series

START, PERIOD = 1_700_000_000_123_456_789, 10_000_000  # ns
JOINT_STATES, WRENCH = "/joint_states", "/hma_gripper_sim/actuator_wrench"


Write = Callable[..., Path]


def on(entries: list[Any], topic: str) -> list[Any]:
    """The messages on a topic, which may be changed before they are written."""
    return [message for t, _, message in entries if t.name == topic]


def test_signals_come_back_exactly(five_ticks: Path) -> None:
    """Joints are found by name: φ left is the second entry of its message."""
    recording = read_recording(five_ticks)
    assert recording.start == START
    tick = np.arange(5)
    for name, value in {
        "travel": 0.001 * tick,
        "actuator_force": 0.5 - 0.125 * tick,
        "phi_left": 1.6 + 0.01 * tick,
        "phi_right": np.full(5, 1.5),
        "bending_moment": np.maximum(0.2, 0.3 * tick),  # not the slide's 9 N
    }.items():
        np.testing.assert_array_equal(recording[name].value, value)
        np.testing.assert_allclose(recording[name].time, 0.01 * tick, rtol=0, atol=1e-15)


def test_bare_mcap_file_is_read(five_ticks: Path) -> None:
    recording = read_recording(five_ticks / "up.mcap")
    assert recording["travel"].value[-1] == 0.004


def test_order_of_a_topic_is_kept_and_others_are_left_out(five_ticks: Path) -> None:
    messages = list(read_messages(five_ticks, [WRENCH]))
    assert [message.topic for message in messages] == [WRENCH] * 5
    assert [message.stamp for message in messages] == [START + i * PERIOD for i in range(5)]


def test_messages_without_a_header_have_the_time_they_were_logged(five_ticks: Path) -> None:
    (message,) = read_messages(five_ticks, ["/hma_gripper_sim/contour"])
    assert (message.stamp, message.content.data) == (START, "box")


def test_poses_are_in_the_order_asked_for(five_ticks: Path) -> None:
    """The first at or after each stamp."""
    stamps = [START + 3 * PERIOD - 1, START]
    poses = read_poses(five_ticks, stamps, ("b", "slide"))
    np.testing.assert_array_equal(poses, [[0.0, 0.0], [-0.1 * 3, 0.003]])


def test_pose_that_was_not_recorded_is_refused(five_ticks: Path) -> None:
    with pytest.raises(InputError, match="ends before"):
        read_poses(five_ticks, [START + 4 * PERIOD + 1], ("slide",))
    with pytest.raises(InputError, match="joint 'c' is missing"):
        read_poses(five_ticks, [START], ("slide", "c"))


def refused(path: Path, reason: str, topic: str | None) -> None:
    with pytest.raises(InputError, match=reason) as caught:
        read_recording(path)
    assert str(path) in str(caught.value.source)
    assert caught.value.field == topic
    assert "\n" not in str(caught.value)


def test_sample_that_is_not_finite_is_left_out(entries: list[Any], write_log: Write) -> None:
    on(entries, WRENCH)[3].wrench.force.z = np.nan
    recording = read_recording(write_log(entries))
    assert recording["actuator_force"].value.tolist() == [0.5, 0.375, 0.25, 0.0]
    assert recording["travel"].value.size == 5
    (note,) = (note for note in recording.notes if "finite" in note)
    assert note == (
        f"{WRENCH}: actuator_force: 1 of 5 samples left out because they are not finite, "
        "the first (nan) at stamp 1700000000.153456 s"
    )


def test_time_that_runs_back_is_named(entries: list[Any], write_log: Write) -> None:
    on(entries, WRENCH)[3].header.stamp.sec -= 2
    refused(write_log(entries), "time runs back by 1.99 s at stamp 1699999998.153456 s", WRENCH)


def test_topics_of_different_clocks_are_named(entries: list[Any], write_log: Write) -> None:
    """Simulated time on one of them."""
    for message in on(entries, WRENCH):
        message.header.stamp.sec -= 1_700_000_000
    refused(write_log(entries), "travel begins 53.9 years after actuator_force", None)


def test_time_that_stands_still_is_not_an_error(entries: list[Any], write_log: Write) -> None:
    """A paused node repeats its stamp."""
    first, second = on(entries, WRENCH)[:2]
    second.header.stamp = first.header.stamp
    assert read_recording(write_log(entries))["actuator_force"].time[1] == 0.0


def test_missing_topic_is_named(entries: list[Any], write_log: Write) -> None:
    path = write_log([entry for entry in entries if entry[0].name != WRENCH])
    refused(path, "no messages", WRENCH)
    with pytest.raises(InputError, match="no such topic") as caught:
        list(read_messages(path, ["/absent"]))
    assert (caught.value.source, caught.value.field) == (str(path), "/absent")


def test_missing_joint_is_named(entries: list[Any], write_log: Write) -> None:
    for message in on(entries, JOINT_STATES):
        message.name[0] = "sledge"
    reason = r"travel: no message is about joint 'slide' \(there are: a, b, sledge\)"
    refused(write_log(entries), reason, JOINT_STATES)


def test_messages_about_other_joints_are_counted(entries: list[Any], write_log: Write) -> None:
    """An arm that shares the topic."""
    on(entries, JOINT_STATES)[2].name[0] = "sledge"
    recording = read_recording(write_log(entries))
    assert recording["travel"].value.tolist() == [0.0, 0.001, 0.003, 0.004]
    assert any("1 of 5 messages passed over for travel" in note for note in recording.notes)


def test_missing_efforts_are_named(entries: list[Any], write_log: Write) -> None:
    on(entries, JOINT_STATES)[2].effort = np.array([])
    refused(write_log(entries), "0 entries of 'effort'", JOINT_STATES)


def test_damaged_message_is_named(entries: list[Any], by_mcap: Write) -> None:
    """A string that claims to be longer than its message, and no checksum that tells."""
    file = by_mcap(entries, use_chunking=False)
    content = file.read_bytes()
    name = b"\x06\x00\x00\x00slide"
    assert content.count(name) == 5
    file.write_bytes(content.replace(name, b"\xff\xff\xff\x7fslide"))
    refused(file, "logged at 1700000000.123456 s cannot be deserialised", JOINT_STATES)


def test_unreadable_paths_are_named(tmp_path: Path) -> None:
    text = tmp_path / "log.mcap"
    text.write_text("not a log", encoding="utf-8")
    for path in (tmp_path / "absent", tmp_path, text):
        refused(path, "cannot be read", None)
    text.unlink()
    refused(tmp_path, "not a rosbag2 directory", None)


def test_series_has_no_value_outside_its_record() -> None:
    series = Series(np.array([1.0, 2.0, 4.0]), np.array([10.0, 20.0, 0.0]))
    assert series.at(3.0) == 10.0
    assert np.isnan(series.at(0.9))
    assert np.isnan(series.at(4.1))
    assert series.between(2.0, 3.9).value.tolist() == [20.0]
