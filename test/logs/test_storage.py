"""Logs in every way that they are stored, written by others."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hma_gripper_sim.logs.reader import read_messages, read_recording

START, PERIOD = 1_700_000_000_123_456_789, 10_000_000  # ns


def test_every_storage_gives_the_same_numbers(stored_log: Path, five_ticks: Path) -> None:
    expected, recording = read_recording(five_ticks), read_recording(stored_log)
    assert recording.start == START
    assert recording.signals.keys() == expected.signals.keys()
    for name, series in expected.signals.items():
        np.testing.assert_array_equal(recording[name].time, series.time)
        np.testing.assert_array_equal(recording[name].value, series.value)
    (note,) = recording.notes
    assert note.startswith("velocity_command: not there")


def test_every_storage_gives_the_same_messages(stored_log: Path) -> None:
    topics = ["/joint_states", "/hma_gripper_sim/contour"]
    messages = list(read_messages(stored_log, topics))
    assert [message.topic for message in messages] == [topics[1], *[topics[0]] * 5]
    assert [message.stamp for message in messages] == [
        START,
        *(START + i * PERIOD for i in range(5)),
    ]
    assert messages[0].content.data == "box"
    assert messages[-1].content.position[0] == 0.004
