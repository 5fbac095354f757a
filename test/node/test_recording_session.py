"""``hma_gripper record`` as users run it, beside the real node."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from patience import patience
from rosbags.rosbag2 import Reader

from hma_gripper_sim import InputError
from hma_gripper_sim.recordings.reading import read_messages, read_recording

PATIENCE = patience(60.0)  # s


def record(*arguments: str | Path) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "hma_gripper_sim.cli.main", "record", *map(str, arguments)]
    return subprocess.Popen(
        command, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True
    )


def wait_until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def commanded(client: Any, *paths: Path) -> bool:
    """Send a command, and look whether one is in all of these logs, which are still written."""
    client.command(0.004)
    try:
        recordings = [read_recording(path) for path in paths]
    except InputError:
        return False  # nothing has been flushed yet
    return all("velocity_command" in recording.signals for recording in recordings)


def test_recordings_of_a_running_node(
    start_node: Callable[..., Any], connect: Callable[..., Any], tmp_path: Path
) -> None:
    """Three at once: one ends by itself, one by Ctrl-C, and one is killed."""
    process = start_node(publish_rate="200.0")
    client = connect(process)
    timed, stopped, killed = (tmp_path / name for name in ("timed", "stopped", "killed"))
    recorders = {
        timed: record(timed, "--duration", "1.5 s"),
        stopped: record(stopped),
        killed: record(killed),
    }
    try:
        wait_until(lambda: all((path / f"{path.name}.mcap").exists() for path in recorders))
        wait_until(lambda: commanded(client, stopped, killed))
        recorders[killed].kill()
        recorders[stopped].send_signal(signal.SIGINT)
        for path in (timed, stopped):
            out, err = recorders[path].communicate(timeout=PATIENCE)
            assert (recorders[path].returncode, err) == (0, "")
            ending = "the duration is over" if path == timed else "SIGINT"
            summary = rf"recorded {path}: \d\.\d\d\d s, (\d+) ticks, \d+ messages \({ending}\)"
            match = re.search(summary, out)
            assert match
            assert int(match[1]) == read_recording(path)["travel"].value.size
    finally:
        for recorder in recorders.values():
            recorder.kill()
            recorder.communicate()
    assert read_recording(timed)["travel"].time[-1] == pytest.approx(1.5, abs=0.01)
    stamps = {}
    for path in recorders:
        recording = read_recording(path)
        for name in ("actuator_force", "phi_left", "phi_right", "bending_moment"):
            times = recording[name].time, recording["travel"].time
            whole = min(map(len, times)) if path == killed else None  # its last tick may be cut
            np.testing.assert_array_equal(times[0][:whole], times[1][:whole])
        stamps[path] = recording.start + np.round(1e9 * recording["travel"].time).astype(int)
        if path != timed:  # may be over by then
            assert set(recording["velocity_command"].value.tolist()) == {0.004}
        assert any("truncated" in note for note in recording.notes) == (path == killed)
    for path in (timed, killed):  # what was recorded at the same time is the same: nothing is lost
        both = max(stamps[path][0], stamps[stopped][0]), min(stamps[path][-1], stamps[stopped][-1])
        ours, theirs = (s[(s >= both[0]) & (s <= both[1])] for s in (stamps[path], stamps[stopped]))
        np.testing.assert_array_equal(ours, theirs)
    assert not (killed / "metadata.yaml").exists()
    (contour,) = read_messages(stopped, ["/hma_gripper_sim/contour"])
    assert contour.content.data == "box"
    with Reader(stopped) as reader:
        assert "/hma_gripper_sim/joint_commands" in reader.topics
    metadata = yaml.safe_load((stopped / "metadata.yaml").read_text())
    topics = metadata["rosbag2_bagfile_information"]["topics_with_message_count"]
    assert all(topic["topic_metadata"]["offered_qos_profiles"] for topic in topics)


def test_node_that_is_not_there_is_named(domain: None, tmp_path: Path) -> None:
    recorder = record(tmp_path / "log", "--node", "/left/gripper", "--timeout", "0.2 s")
    _, err = recorder.communicate(timeout=PATIENCE)
    assert recorder.returncode == 1
    assert err == (
        "error: nothing comes from /left/gripper: within 0.2 s it has not published its state "
        "(is it running, and with the same ROS_DOMAIN_ID?)\n"
    )
    assert list(tmp_path.iterdir()) == []
