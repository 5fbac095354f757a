"""Signals and poses read back from logs, and logs that cannot be read."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim import InputError
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import CMD_VELOCITY, CONTOUR
from hma_gripper_sim.recordings.reading import read_messages, read_poses, read_recording
from hma_gripper_sim.recordings.recording import Series
from hma_gripper_sim.recordings.signal_map import SignalMap

T = get_typestore(Stores.ROS2_JAZZY).types

START, PERIOD = 1_700_000_000_123_456_789, 10_000_000  # ns
JOINT_TYPE = "sensor_msgs/msg/JointState"
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


def test_messages_without_efforts_are_passed_over(entries: list[Any], write_log: Write) -> None:
    """A driver's first message, or one of joint_state_publisher."""
    on(entries, JOINT_STATES)[2].effort = np.array([])
    recording = read_recording(write_log(entries))
    np.testing.assert_array_equal(
        recording["bending_moment"].value, np.maximum(0.2, 0.3 * np.array([0, 1, 3, 4]))
    )
    assert recording["travel"].value.size == 5
    assert recording.notes[-1] == (
        f"{JOINT_STATES}: 1 of 5 messages passed over for bending_moment: a message has 0 entries "
        "of 'effort', not 2"
    )


def test_efforts_that_no_message_has_are_absent_if_they_may_be(
    entries: list[Any], write_log: Write
) -> None:
    for message in on(entries, JOINT_STATES):
        message.effort = np.array([])
    path = write_log(entries)
    refused(path, "bending_moment: a message has 0 entries of 'effort', not 2, nor", JOINT_STATES)
    signals = {"topic": JOINT_STATES, "field": "effort", "largest_but": "slide", "optional": True}
    recording = read_recording(path, SignalMap.from_mapping({"bending_moment": signals}))
    assert not recording.signals
    assert "bending_moment is absent: a message has 0 entries of 'effort'" in recording.notes[0]


def test_optional_field_that_no_message_can_have_is_refused(five_ticks: Path) -> None:
    """A slip of the pen is none the less one."""
    signals = {"topic": JOINT_STATES, "field": "efort", "joint": "slide", "optional": True}
    with pytest.raises(InputError, match="no number 'efort'"):
        read_recording(five_ticks, SignalMap.from_mapping({"actuator_force": signals}))


def test_messages_whose_arrays_are_too_short_are_passed_over(
    entries: list[Any], write_log: Write
) -> None:
    """Names without positions; and fewer positions than names, whosever they are."""
    messages = on(entries, JOINT_STATES)
    messages[0].position = np.array([])
    messages[3].position = messages[3].position[:2]
    recording = read_recording(write_log(entries))
    assert recording["travel"].value.tolist() == [0.001, 0.002, 0.004]
    assert any("2 of 5 messages passed over for travel" in note for note in recording.notes)


def test_joint_of_two_publishers_is_refused(
    make_ticks: Callable[[int], list[Any]], write_log: Write
) -> None:
    """joint_state_publisher's zeros between the node's values, on one topic."""
    entries = make_ticks(40)
    for topic, stamp, message in list(entries):
        if topic.name == JOINT_STATES:
            zeros = deepcopy(message)
            zeros.position[:] = 0.0
            entries.append((topic, stamp + PERIOD // 5, zeros))
    entries.sort(key=lambda entry: entry[1])
    path = write_log(entries)
    refused(path, "travel: its value jumps to and fro 7[0-9] times in 80 samples", JOINT_STATES)
    signals = {"topic": JOINT_STATES, "field": "position", "joint": "slide", "publisher": "any"}
    both = read_recording(path, SignalMap.from_mapping({"travel": signals}))["travel"]
    assert both.value[10:14].tolist() == [0.005, 0.0, 0.006, 0.0]


def test_joint_that_is_named_among_others_by_turns_is_refused(
    entries: list[Any], write_log: Write
) -> None:
    """Of another publisher whose values are nearly the same."""
    for message in on(entries, JOINT_STATES)[::2]:
        message.name[2] = "c"
    reason = r"publishers take turns in naming joint 'slide', among the joints \(a, c, slide\) and"
    refused(write_log(entries), reason, JOINT_STATES)


def test_samples_before_the_clock_came_are_left_out(entries: list[Any], write_log: Write) -> None:
    """Stamped 0, before the first message on /clock."""
    for _, _, message in entries[:4]:
        if hasattr(message, "header"):
            message.header.stamp.sec = message.header.stamp.nanosec = 0
    recording = read_recording(write_log(entries))
    assert recording.start == START + PERIOD
    assert recording["travel"].value.tolist() == [0.001, 0.002, 0.003, 0.004]
    left_out = f"{JOINT_STATES}: travel: 1 of 5 samples left out because their stamp is not set (0)"
    assert left_out in recording.notes


def test_messages_are_taken_in_the_order_they_were_logged(
    entries: list[Any], by_mcap: Write
) -> None:
    """Whatever order they lie in: of merged files, or of several writers."""
    expected = read_recording(by_mcap(entries))
    recording = read_recording(by_mcap(entries[7:] + entries[:7]))
    assert recording.start == expected.start
    for name, series in expected.signals.items():
        np.testing.assert_array_equal(recording[name].value, series.value)
        np.testing.assert_array_equal(recording[name].time, series.time)
    assert any("lie in another order in the log than" in note for note in recording.notes)


def test_poses_are_found_whatever_order_they_lie_in(entries: list[Any], by_mcap: Write) -> None:
    path = by_mcap(entries[7:] + entries[:7])
    poses = read_poses(path, [START, START + 3 * PERIOD], ("slide",))
    np.testing.assert_array_equal(poses, [[0.0], [0.003]])


def test_command_that_was_sent_once_at_time_0_is_read(entries: list[Any], by_mcap: Write) -> None:
    """In simulated time; it has no stamp, and 0 is when it was logged."""
    at_0 = [
        (topic, stamp - START, message) for topic, stamp, message in entries if topic is not CONTOUR
    ]
    for _, stamp, message in at_0:
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 10**9)
    command = T["std_msgs/msg/Float64"](0.004)
    path = by_mcap([(CMD_VELOCITY, 0, command), *at_0])
    recording = read_recording(path)
    assert recording["velocity_command"].value.tolist() == [0.004]
    assert recording["travel"].value.size == 5


def test_topics_without_a_slash_are_found(entries: list[Any], by_mcap: Write) -> None:
    """As many writers store them; in the map it may be left out as well."""
    bare = {topic: Topic(topic.name.lstrip("/"), topic.msgtype) for topic, _, _ in entries}
    path = by_mcap([(bare[topic], stamp, message) for topic, stamp, message in entries])
    assert read_recording(path)["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]
    signals = {"topic": "joint_states", "field": "position", "joint": "slide"}
    recording = read_recording(path, SignalMap.from_mapping({"travel": signals}))
    assert recording["travel"].value.size == 5


def test_entry_of_a_nested_array_is_read(by_mcap: Write) -> None:
    """JointTrajectory; one message has no points, which is no error of the map."""
    kind, point = (
        T["trajectory_msgs/msg/JointTrajectory"],
        "trajectory_msgs/msg/JointTrajectoryPoint",
    )
    header = T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](1, 0), "")
    none = np.empty(0)
    duration = T["builtin_interfaces/msg/Duration"](0, 0)
    messages = [
        kind(
            header,
            ["lift"],
            [T[point](none, np.array([0.1 * i]), none, none, duration)] if i else [],
        )
        for i in range(4)
    ]
    topic = Topic("/trajectory", "trajectory_msgs/msg/JointTrajectory")
    path = by_mcap([(topic, START + i, message) for i, message in enumerate(messages)])
    signals = {"topic": "/trajectory", "field": "points[0].velocities[0]", "time": "log"}
    recording = read_recording(path, SignalMap.from_mapping({"velocity_command": signals}))
    assert recording["velocity_command"].value.tolist() == [0.1, 0.2, 0.1 * 3]
    assert "1 of 4 messages passed over for velocity_command" in recording.notes[0]


def test_names_in_a_log_cannot_steer_a_terminal(entries: list[Any], by_mcap: Write) -> None:
    """Escape codes and line breaks of a topic's and a joint's name are shown as such."""
    evil = Topic("/evil\x1b[2J\nerror: ok", JOINT_TYPE)
    (message, *_) = on(entries, JOINT_STATES)
    message.name[0] = "slide\x1b]0;owned\x07"
    path = by_mcap([(evil, START, message), *entries])
    signals = {"topic": "/absent", "field": "data", "optional": True}
    other = {"topic": JOINT_STATES, "field": "position", "joint": "slide"}
    recording = read_recording(
        path, SignalMap.from_mapping({"actuator_force": signals, "travel": other})
    )
    assert any(r"/evil\x1b[2J\nerror: ok" in note for note in recording.notes)
    assert all(note.isprintable() for note in recording.notes)
    with pytest.raises(InputError) as caught:
        read_recording(path, SignalMap.from_mapping({"travel": {**other, "joint": "x"}}))
    assert str(caught.value).isprintable()
    assert r"slide\x1b]0;owned\x07" in str(caught.value)


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
    assert np.isnan(series.at(-1.3))
    assert np.isnan(series.at(6.3))
    assert series.between(2.0, 3.9).value.tolist() == [20.0]
