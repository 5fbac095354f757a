"""ROS 1 bags, whole and damaged."""

from __future__ import annotations

import bz2
import re
import resource
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.signal_map import SignalMap

PACKED = {"bz2": bz2.compress, "lz4": lz4.frame.compress}
KINDS = ["ROS 1", "ROS 1, bz2", "ROS 1, lz4"]
WRENCH = "/hma_gripper_sim/actuator_wrench"


@pytest.fixture
def write(
    tmp_path: Path, storages: dict[str, Any], make_ticks: Callable[[int], list[Any]]
) -> Callable[..., Path]:
    """Write forty ticks, in chunks of about four."""

    def write_ticks(kind: str) -> Path:
        return storages[kind](tmp_path, make_ticks(40))

    return write_ticks


@pytest.mark.parametrize("kind", KINDS)
def test_truncated_bag_gives_what_is_left_and_says_so(
    write: Callable[..., Path], tmp_path: Path, kind: str
) -> None:
    path = write(kind)
    content, whole = path.read_bytes(), read_recording(path)
    cut, errors, samples = tmp_path / "cut.bag", [], []
    for kept in range(0, len(content), 499):
        cut.write_bytes(content[:kept])
        try:
            recording = read_recording(cut)
        except InputError as error:
            errors.append(str(error))
            continue
        assert f"cut.bag is truncated: ends at byte {kept}" in recording.notes[0]
        for name, series in recording.signals.items():
            count = series.value.size
            assert np.array_equal(series.value, whole[name].value[:count])
        samples.append(recording["travel"].value.size)
    assert "is empty" in errors.pop(0)
    assert all(f"{cut}: " in error and "is truncated: ends at byte" in error for error in errors)
    assert "\n" not in "".join(errors)
    assert samples == sorted(samples)
    assert samples[-1] == 40
    if kind == "ROS 1":
        assert len(set(samples)) > 15


def test_what_is_recovered_of_a_chunk_is_counted(write: Callable[..., Path]) -> None:
    path = write("ROS 1")
    content = path.read_bytes()
    path.write_bytes(content[: content.rindex(b"slide") + 5])
    (note,) = (note for note in read_recording(path).notes if "truncated" in note)
    expected = (
        r"bag.bag is truncated: ends at byte \d+, lost are \d+ of \d+ bytes of the last record, "
        r"a chunk; 118 messages of it were recovered; last message that was asked for: "
        r"logged 1700000000.503456 s"
    )
    assert re.fullmatch(expected, note)


def test_bag_that_was_not_closed_is_read(write: Callable[..., Path]) -> None:
    """As rosbag leaves it when it is killed: without an index, nor a place of it."""
    path = write("ROS 1")
    content = path.read_bytes()
    place = content.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(content[place : place + 8], "little")
    path.write_bytes(content[:place] + bytes(8) + content[place + 8 : index])
    recording = read_recording(path)
    assert recording["travel"].value.size == 40
    assert f"bag.bag is truncated: ends at byte {index}" in recording.notes[0]


def with_length(data: bytes) -> bytes:
    return len(data).to_bytes(4, "little") + data


def opened(content: bytes) -> bytes:
    """The bag before its last chunk was closed: 0 bytes by its header, the messages behind it."""
    place = content.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(content[place : place + 8], "little")
    header = content.rindex(b"op=\x05", 0, index)
    begin = content.rindex(b"size=", 0, index) + len(b"size=")
    assert begin > header
    length = begin + 4
    size = int.from_bytes(content[length : length + 4], "little")
    body = content[length + 4 : length + 4 + size]
    left = content[:begin] + bytes(8) + body
    return left[:place] + bytes(8) + left[place + 8 :]


@pytest.mark.parametrize("kind", KINDS)
def test_chunk_that_was_never_closed_is_read(write: Callable[..., Path], kind: str) -> None:
    """As rosbag leaves it when it is killed, in place of which it makes `.bag.active` files."""
    path = write(kind)
    content = opened(path.read_bytes())
    path.write_bytes(content[:-30] if kind == "ROS 1" else content)
    recording = read_recording(path)
    assert recording["travel"].value.tolist() == [0.001 * i for i in range(40)]
    assert "bag.bag is truncated: ends at byte" in recording.notes[0]


def test_bag_that_was_indexed_after_it_had_been_cut_off_is_read(write: Callable[..., Path]) -> None:
    """What the recorder was writing lies in front of the index: part of a message."""
    path = write("ROS 1")
    content = path.read_bytes()
    place = content.index(b"index_pos=") + len(b"index_pos=")
    index = int.from_bytes(content[place : place + 8], "little")
    for rest in (b"\x20\x00\x00\x00\x07\x00\x00\x00op=", content[4200:5000]):
        moved = content[:place] + (index + len(rest)).to_bytes(8, "little")
        path.write_bytes(moved + content[place + 8 : index] + rest + content[index:])
        recording = read_recording(path)
        assert recording["travel"].value.size == 40
        assert f"has {len(rest)} bytes in front of its index that are no" in recording.notes[0]


def test_damage_that_the_index_tells_to_have_cost_messages_is_refused(
    write: Callable[..., Path],
) -> None:
    path = write("ROS 1")
    content = path.read_bytes()
    path.write_bytes(content.replace(b"op=\x05", b"op=\x09"))
    with pytest.raises(InputError, match=r"record at byte \d+: is of unknown kind 9: damaged"):
        read_recording(path)


@pytest.mark.parametrize("compression", ["bz2", "lz4"])
def test_chunk_that_expands_beyond_its_size_is_refused(
    write: Callable[..., Path], compression: str
) -> None:
    """A few bytes that stand for a gigabyte: no more than is declared is unpacked."""
    path = write("ROS 1")
    content = opened(path.read_bytes())
    packed = PACKED[compression](bytes(2**26))
    size = b"size=" + (1000).to_bytes(4, "little")
    fields = (b"op=\x05", b"compression=" + compression.encode(), size)
    header = b"".join(map(with_length, fields))
    path.write_bytes(content[:4109] + with_length(header) + with_length(packed))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match="a chunk has not the 1000 bytes that it claims to have"):
        read_recording(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (b"compression=none", b"compression=zips", "unknown compression 'zips'"),
        (b"chunk_count=\x01", b"chunk_count=\x02", "is truncated"),
        (b"size=", b"sise=", r"byte \d+: Could not read uint32 field 'size'.: damaged"),
        (b"\x04\x00\x00\x00op=\x05", b"\x04\x00\x00\x7fop=\x05", "Declared field size is too la"),
        (b"op=\x05", b"op=\x09", r"record at byte \d+: is of unknown kind 9: damaged"),
        (b"op=\x02", b"op=\x09", "a chunk has something else in it than messages: damaged"),
        (b"conn=\x01", b"conn=\x09", "a chunk has something else in it than messages: damaged"),
    ],
)
def test_damaged_records_are_named(
    write: Callable[..., Path], old: bytes, new: bytes, reason: str
) -> None:
    path = write("ROS 1")
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))
    if "truncated" in reason:
        assert "is truncated" in read_recording(path).notes[0]
    else:
        with pytest.raises(InputError, match=reason) as caught:
            read_recording(path)
        assert caught.value.source == str(path)


def test_caller_tells_publishers_apart(
    tmp_path: Path, make_ticks: Callable[[int], list[Any]], by_two_callers: Callable[..., Path]
) -> None:
    path = by_two_callers(make_ticks(5))
    entry = {"topic": WRENCH, "field": "wrench.force.z"}
    with pytest.raises(InputError, match=r"2 publishers \('/a', '/b'\)"):
        read_recording(path, SignalMap.from_mapping({"actuator_force": entry}))
    chosen = SignalMap.from_mapping({"actuator_force": {**entry, "publisher": "/b"}})
    assert read_recording(path, chosen)["actuator_force"].value.tolist() == [0.375, 0.125]


def test_messages_that_the_index_counts_and_nobody_finds_are_noted(
    write: Callable[..., Path],
) -> None:
    """The last record gives for each connection the number of its messages."""
    path = write("ROS 1")
    content = path.read_bytes()
    connection, count = content[-8:-4], content[-4:]
    assert (connection[1:], count) == (bytes(3), (40).to_bytes(4, "little"))
    path.write_bytes(content[:-4] + (42).to_bytes(4, "little"))
    (note,) = (note for note in read_recording(path).notes if "damaged" in note)
    assert note.startswith("bag.bag is damaged: its index counts 123 messages, 121 were found")
