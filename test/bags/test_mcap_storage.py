"""mcap files that we write, as the mcap library sees them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from rosbags.rosbag2 import Reader

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.device.topics import LOGGED_TOPICS
from hma_gripper_sim.recordings.reading import read_recording

Ticks = Callable[[int], list[Any]]


@pytest.fixture(params=[False, True], ids=["plain", "compressed"])
def log(
    request: pytest.FixtureRequest,
    tmp_path: Path,
    make_ticks: Ticks,
    serialise: Callable[[Any], bytes],
    monkeypatch: pytest.MonkeyPatch,
) -> Path:
    """Forty ticks in many chunks."""
    monkeypatch.setattr("hma_gripper_sim.bags.mcap_storage._CHUNK", 4000)
    path = tmp_path / "log"
    with LogWriter(path, LOGGED_TOPICS, compressed=request.param) as writer:
        for topic, stamp, message in make_ticks(40):
            writer.write(topic.name, stamp, serialise(message))
    return path / "log.mcap"


def test_every_message_is_found_with_and_without_the_index(log: Path) -> None:
    with log.open("rb") as file:
        indexed = list(make_reader(file, validate_crcs=True).iter_messages(log_time_order=False))
        file.seek(0)
        plain = list(NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False))
    assert indexed == plain
    assert len(indexed) == 3 * 40 + 1


def test_summary_is_right(log: Path) -> None:
    with log.open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
    statistics = summary.statistics
    assert statistics.message_count == 3 * 40 + 1
    assert sorted(statistics.channel_message_counts.values()) == [1, 40, 40, 40]
    assert statistics.chunk_count == len(summary.chunk_indexes) > 3
    assert statistics.message_start_time == summary.chunk_indexes[0].message_start_time
    assert statistics.message_end_time - statistics.message_start_time == 39 * 10_000_000
    assert {channel.topic for channel in summary.channels.values()} == {
        topic.name for topic in LOGGED_TOPICS
    }
    assert [index.name for index in summary.metadata_indexes] == ["rosbag2"]


def test_every_chunk_has_a_checksum(log: Path) -> None:
    with log.open("rb") as file:
        records = StreamReader(file, emit_chunks=True, validate_crcs=True).records
        assert all(record.uncompressed_crc for record in records if isinstance(record, Chunk))


def test_index_of_messages_is_what_rosbags_goes_by(log: Path) -> None:
    with Reader(log) as reader:
        stamps = [stamp for _, stamp, _ in reader.messages()]
    assert len(stamps) == 3 * 40 + 1
    assert stamps == sorted(stamps)


def test_what_was_flushed_can_be_read_while_the_log_is_open(
    tmp_path: Path, make_ticks: Ticks, serialise: Callable[[Any], bytes]
) -> None:
    """So a log of a program that was killed can be read as well."""
    path = tmp_path / "log"
    with LogWriter(path, LOGGED_TOPICS) as writer:
        entries = make_ticks(10)
        for topic, stamp, message in entries[:-6]:
            writer.write(topic.name, stamp, serialise(message))
        writer.flush()
        for topic, stamp, message in entries[-6:]:
            writer.write(topic.name, stamp, serialise(message))
        recording = read_recording(path)
        writer.flush()
        writer.flush()
        assert read_recording(path)["travel"].value.size == 10
    assert recording["travel"].value.size == 8
    assert "log.mcap is truncated: ends at byte" in recording.notes[0]
    assert "truncated" not in "".join(read_recording(path).notes)


def test_log_without_messages_is_a_log(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "log", LOGGED_TOPICS):
        pass
    with Reader(tmp_path / "log") as reader:
        assert reader.message_count == 0
    with (tmp_path / "log" / "log.mcap").open("rb") as file:
        assert not list(make_reader(file, validate_crcs=True).iter_messages())
