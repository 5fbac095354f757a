"""Logs in every way that they are stored, written by others."""

from __future__ import annotations

import os
import resource
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import mcap.writer
import numpy as np
import pytest
import zstandard

from hma_gripper_sim import InputError
from hma_gripper_sim.recordings.reading import read_messages, read_recording
from hma_gripper_sim.recordings.signal_map import SignalMap

Storages = dict[str, Callable[[Path, list[Any]], Path]]

LOGGED_PHI = {
    "topic": "/hma_gripper_sim/phi",
    "field": "position",
    "joint": "phi_left",
    "time": "log",
}

START, PERIOD = 1_700_000_000_123_456_789, 10_000_000  # ns


def test_every_storage_gives_the_same_numbers(stored_log: Path, five_ticks: Path) -> None:
    expected, recording = read_recording(five_ticks), read_recording(stored_log)
    assert recording.start == START
    assert recording.signals.keys() == expected.signals.keys()
    for name, series in expected.signals.items():
        np.testing.assert_array_equal(recording[name].time, series.time)
        np.testing.assert_array_equal(recording[name].value, series.value)
    (note,) = recording.notes
    assert "velocity_command is absent" in note


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


def test_truncated_database_is_named(
    tmp_path: Path, storages: Storages, make_ticks: Callable[[int], list[Any]]
) -> None:
    """SQLite refuses it: nothing is recovered, and nothing is made up."""
    path = storages["db3"](tmp_path, make_ticks(40))
    content = path.read_bytes()
    assert len(content) > 10 * 997
    for kept in range(0, len(content), 997):
        path.write_bytes(content[:kept])
        with pytest.raises(InputError, match=r"cannot be read: [^\n]+$") as caught:
            read_recording(path)
        assert caught.value.source == str(path)


def test_database_of_a_recorder_that_was_killed_is_read_with_its_journal(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """rosbag2's resilient profile: what was committed last is in the -wal file only."""
    path = storages["db3"](tmp_path, entries[:-3])
    killed = tmp_path / "killed.db3"
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA journal_mode=WAL")
    connection.execute("CREATE TABLE more AS SELECT * FROM messages")
    connection.execute(
        "INSERT INTO messages SELECT id + 100, topic_id, timestamp + 1000000000, data FROM more"
    )
    connection.commit()
    shutil.copy(path, killed)
    shutil.copy(f"{path}-wal", f"{killed}-wal")
    connection.close()
    content = killed.read_bytes()
    recording = read_recording(killed, SignalMap.from_mapping({"phi_left": LOGGED_PHI}))
    assert recording["phi_left"].value.size == 8
    assert "killed.db3 was not closed: read with its killed.db3-wal" in recording.notes
    assert killed.read_bytes() == content


def test_truncated_file_that_was_compressed_gives_what_is_left(
    tmp_path: Path, storages: Storages, make_ticks: Callable[[int], list[Any]]
) -> None:
    path = storages["rosbag2 mcap, zstd file"](tmp_path, make_ticks(3000))
    file = path / "bag.mcap.zstd"
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    recording = read_recording(path)
    assert 0 < recording["travel"].value.size < 3000
    assert "bag.mcap.zstd is truncated: ends at byte" in recording.notes[0]


@pytest.mark.parametrize("kind", ["rosbag2 mcap, zstd messages", "rosbag2 sqlite3, zstd messages"])
def test_messages_that_cannot_be_decompressed_are_named(
    kind: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages[kind](tmp_path, entries)
    (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
    file.write_bytes(file.read_bytes().replace(b"(\xb5/\xfd", b"(\xb5/\xfe"))
    with pytest.raises(InputError, match=r"cannot be read: .*(frame|zstd|magic)"):
        read_recording(path)


def test_directory_without_metadata_is_read(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """The recorder was killed: rosbag2 writes it last. log_10 comes behind log_9."""
    path = storages["rosbag2 mcap, split"](tmp_path, entries)
    (path / "metadata.yaml").unlink()
    (path / "bag_0.mcap").rename(path / "bag_9.mcap")
    (path / "bag_1.mcap").rename(path / "bag_10.mcap")
    recording = read_recording(path)
    assert recording["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]
    assert "has no metadata.yaml: the recording was not finished" in recording.notes


def test_files_that_metadata_does_not_list_are_named(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages["rosbag2 mcap"](tmp_path, entries)
    (path / "other.mcap").write_bytes(b"")
    assert "other.mcap is not listed in metadata.yaml: not read" in read_recording(path).notes


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("rosbag2_bagfile_information", "something", "rosbag2_bagfile_information: is missing"),
        ("relative_file_paths:", "files_of_it:", "relative_file_paths: expected a list of names"),
        ("- bag.mcap", "- lost.mcap", r"lost.mcap: cannot be read: No such file or directory"),
        ("- bag.mcap", "- {a: 1}", "relative_file_paths: expected a list of names"),
        ("compression_mode: ''", "compression_mode: zip", "compression_mode: must be one of"),
        ("compression_mode: ''", "compression_mode: FILE", "compression_format: must be one of"),
        ("version: 9", "version: [", "not valid YAML"),
    ],
)
def test_bad_metadata_is_named(
    old: str, new: str, reason: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages["rosbag2 mcap"](tmp_path, entries)
    metadata = path / "metadata.yaml"
    assert old in metadata.read_text()
    metadata.write_text(metadata.read_text().replace(old, new))
    with pytest.raises(InputError, match=reason) as caught:
        read_recording(path)
    assert str(path) in str(caught.value.source)


@pytest.mark.parametrize("plugin", ["mcap", "sqlite3"])
def test_topic_that_rosbag2_recorded_from_two_publishers_is_refused(
    plugin: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """Its profiles of quality of service say so. The joints of joint states tell theirs apart."""
    path = storages[f"rosbag2 {plugin}, two publishers"](tmp_path, entries)
    reason = "actuator_force: 2 publishers, which the recorder did not tell apart"
    with pytest.raises(InputError, match=reason) as caught:
        read_recording(path)
    assert caught.value.field == "/hma_gripper_sim/actuator_wrench"
    joints = SignalMap.from_mapping({"phi_left": LOGGED_PHI})
    assert read_recording(path, joints)["phi_left"].value.size == 5


@pytest.mark.parametrize("content", [b"", bytes(4096)], ids=["empty", "NUL"])
@pytest.mark.parametrize("kind", ["rosbag2 mcap, split", "rosbag2 sqlite3, split"])
def test_what_a_crash_leaves_blank_is_noted(
    kind: str, content: bytes, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """The metadata, and the file that was begun last."""
    path = storages[kind](tmp_path, entries)
    (path / "metadata.yaml").write_bytes(content)
    suffix = ".mcap" if "mcap" in kind else ".db3"
    (path / f"bag_2{suffix}").write_bytes(content)
    recording = read_recording(path)
    assert recording["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]
    assert f"bag_2{suffix} is empty: the recording was not finished" in recording.notes
    assert "its metadata.yaml is empty: the recording was not finished" in recording.notes
    for file in path.glob(f"*{suffix}"):
        file.write_bytes(content)
    with pytest.raises(InputError, match="all of its files are empty"):
        read_recording(path)


@pytest.mark.parametrize("kind", ["rosbag2 mcap, zstd messages", "rosbag2 sqlite3, zstd messages"])
def test_messages_that_are_compressed_show_it_themselves(
    kind: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """Without metadata that say so: after a crash, or of a file on its own."""
    path = storages[kind](tmp_path, entries)
    (path / "metadata.yaml").unlink()
    (file,) = path.iterdir()
    for log in (path, file):
        assert read_recording(log)["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]


def test_database_of_the_first_rosbag2_is_read(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """Types without ``/msg/``, no qualities of service, no definitions."""
    path = storages["db3"](tmp_path, entries)
    with closing(sqlite3.connect(path)) as database:
        database.execute("UPDATE topics SET type = replace(type, '/msg/', '/')")
        database.execute("UPDATE topics SET name = substr(name, 2)")
        for column in ("offered_qos_profiles", "type_description_hash"):
            database.execute(f"ALTER TABLE topics DROP COLUMN {column}")
        for table in ("schema", "metadata", "message_definitions"):
            database.execute(f"DROP TABLE {table}")
        database.commit()
    assert read_recording(path)["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]


@pytest.mark.parametrize("qos", ["- {", "3", "- a\n- b: [", pytest.param("[" * 5000, id="open")])
def test_qualities_of_service_that_are_no_yaml_do_not_matter(
    qos: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages["db3"](tmp_path, entries)
    with closing(sqlite3.connect(path)) as database:
        database.execute("UPDATE topics SET offered_qos_profiles = ?", [qos])
        database.commit()
    assert read_recording(path)["travel"].value.size == 5


def test_database_with_something_else_in_it_is_named(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages["db3"](tmp_path, entries)
    with closing(sqlite3.connect(path)) as database:
        database.execute("UPDATE messages SET data = 1000000000")
        database.commit()
    with pytest.raises(InputError, match="a message is no bytes with a time"):
        read_recording(path)
    other = tmp_path / "other.db3"
    with closing(sqlite3.connect(other)) as database:
        database.execute("CREATE TABLE songs (name)")
        database.commit()
    with pytest.raises(InputError, match="without the tables that rosbag2 writes"):
        read_recording(other)


@pytest.mark.parametrize(("number", "count"), [(99, "1 message"), (None, "3 messages")])
def test_messages_of_no_topic_in_a_database_are_noted(
    number: int | None,
    count: str,
    entries: list[Any],
    tmp_path: Path,
    storages: Storages,
) -> None:
    """A damaged number of a topic is all that tells that a message of it is missing."""
    path = storages["db3"](tmp_path, entries)
    declared = ("topic_id INTEGER NOT NULL", "topic_id INTEGER")
    for before, after in (declared, declared[::-1]):
        with closing(sqlite3.connect(path)) as database:
            if after == "topic_id INTEGER NOT NULL":  # that NULL can be written, but not declared
                database.execute(
                    "UPDATE messages SET topic_id = ? WHERE id IN (SELECT messages.id "
                    "FROM messages JOIN topics ON topics.id = topic_id "
                    "WHERE name = '/joint_states' ORDER BY messages.id LIMIT ?)",
                    [number, int(count[0])],
                )
            database.execute("PRAGMA writable_schema = ON")
            database.execute("UPDATE sqlite_master SET sql = replace(sql, ?, ?)", [before, after])
            database.commit()
    recording = read_recording(path)
    assert recording["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004][int(count[0]) :]
    assert recording["actuator_force"].value.size == 5
    note = f"bag.db3: {count} left out, of no topic that it names: the file is damaged"
    assert note in recording.notes


@pytest.mark.parametrize("storage", ["rosbag2 sqlite3, split", "rosbag2 mcap, split"])
def test_messages_that_only_the_metadata_count_are_noted(
    storage: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """As where the name of a topic is damaged: nothing is missing of what the file names."""
    path = storages[storage](tmp_path, entries)
    metadata = path / "metadata.yaml"
    text = metadata.read_text()
    assert text.count("message_count: 5") > 2
    metadata.write_text(text.replace("message_count: 5", "message_count: 6"))
    notes = read_recording(path).notes
    assert (
        "/joint_states: metadata.yaml counts 6 messages, and 5 are there: the log is damaged"
        in notes
    )


def test_database_whose_name_has_a_meaning_in_addresses_is_read(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages["db3"](tmp_path, entries)
    named = path.rename(tmp_path / "50%20 #1?.db3")
    assert read_recording(named)["travel"].value.size == 5


def test_what_is_no_file_is_named(tmp_path: Path) -> None:
    """Opening a FIFO would wait for somebody who writes to it."""
    fifo = tmp_path / "log.mcap"
    os.mkfifo(fifo)
    for read in (read_recording, SignalMap.from_yaml):
        with pytest.raises(InputError, match="cannot be read: it is no regular file"):
            read(fifo)


def test_pointer_to_a_log_elsewhere_is_named(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 9\n")
    with pytest.raises(InputError, match="Git LFS pointer, not the log: 'git lfs pull'"):
        read_recording(path)


def test_file_that_was_renamed_is_pointed_out(
    entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    path = storages["rosbag2 sqlite3"](tmp_path, entries)
    (path / "bag.db3").rename(path / "first.db3")
    reason = r"bag.db3: cannot be read: No such file or directory; beside it there is first.db3"
    with pytest.raises(InputError, match=reason):
        read_recording(path)


@pytest.mark.parametrize("kind", ["rosbag2 mcap, zstd messages", "rosbag2 mcap, zstd file"])
def test_content_that_expands_without_bound_is_refused(
    kind: str, entries: list[Any], tmp_path: Path, storages: Storages
) -> None:
    """A few kilobytes that stand for half a gigabyte."""
    path = storages[kind](tmp_path, entries)
    (file,) = (file for file in path.iterdir() if file.name != "metadata.yaml")
    compressor = zstandard.ZstdCompressor().compressobj()  # piece by piece: memory is looked at
    pieces = [b"\x89MCAP0\r\n", *[bytes(2**20)] * 2**9]
    packed = b"".join([compressor.compress(piece) for piece in pieces]) + compressor.flush()
    if "file" in kind:
        file.write_bytes(packed)
    else:
        with file.open("wb") as stream:
            writer = mcap.writer.Writer(stream)
            writer.start("ros2")
            schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
            channel = writer.register_channel("/joint_states", "cdr", schema)
            writer.add_message(channel, START, packed, START)
            writer.finish()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match=r"decompresses to more than|unknown kind 0"):
        read_recording(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000  # kB
