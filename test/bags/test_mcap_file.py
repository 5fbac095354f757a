"""mcap files, whole and damaged."""

from __future__ import annotations

import random
import re
import resource
import time
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lz4.frame
import mcap.writer
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType

from hma_gripper_sim import InputError
from hma_gripper_sim.recordings.reading import read_messages, read_recording
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.recordings.signal_map import SignalMap

MAGIC = b"\x89MCAP0\r\n"
WRENCH = "/hma_gripper_sim/actuator_wrench"

Write = Callable[..., Path]

CHUNKED = {"compression": CompressionType.NONE, "chunk_size": 2000}
OURS: dict[str, Any] = {}
WAYS = {
    "chunks": CHUNKED,
    "zstd chunks": {"compression": CompressionType.ZSTD, "chunk_size": 2000},
    "lz4 chunks": {"compression": CompressionType.LZ4, "chunk_size": 2000},
    "our own": OURS,
    "no chunks": {"use_chunking": False, "enable_data_crcs": True},
}


@pytest.fixture
def write(by_mcap: Write, write_log: Write, make_ticks: Callable[[int], Any]) -> Write:
    """Write ten ticks with the mcap library, or with our own writer."""

    def write_ticks(**options: Any) -> Path:
        if options == OURS:
            directory = write_log(make_ticks(10))
            return next(directory.glob("*.mcap"))
        return by_mcap(make_ticks(10), **options)

    return write_ticks


def is_part_of(part: Recording, whole: Recording) -> bool:
    """Whether every signal of `part` is the beginning of that of `whole`."""
    return all(
        np.array_equal(series.value, whole[name].value[: series.value.size])
        and np.allclose(series.time, whole[name].time[: series.time.size], rtol=0, atol=1e-15)
        for name, series in part.signals.items()
    )


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS.keys())
def test_truncated_file_gives_what_is_left_and_says_so(
    write: Write, tmp_path: Path, options: dict[str, Any]
) -> None:
    """Wherever it is cut: never another number, and never without a word about the loss."""
    path = write(**options)
    content, whole = path.read_bytes(), read_recording(path)
    cut, errors, samples = tmp_path / "cut.mcap", [], set()
    for kept in range(0, len(content), 97):
        cut.write_bytes(content[:kept])
        try:
            recording = read_recording(cut)
        except InputError as error:
            errors.append(str(error))
            continue
        assert "cut.mcap is truncated: ends at byte" in recording.notes[0]
        assert is_part_of(recording, whole)
        samples.add(recording["travel"].value.size)
    assert "is empty" in errors.pop(0)
    assert all(f"{cut}: " in error and "is truncated: ends at byte" in error for error in errors)
    assert "\n" not in "".join(errors)
    assert len(samples) > 1
    assert max(samples) == 10


def test_truncated_chunk_says_which_time_is_lost(write: Write) -> None:
    path = write(**CHUNKED)
    content = path.read_bytes()
    path.write_bytes(content[: content.rindex(b"slide") + 20])
    recording = read_recording(path)
    (note,) = (note for note in recording.notes if "truncated" in note)
    expected = (
        r"plain.mcap is truncated: ends at byte \d+, lost are \d+ of \d+ bytes of the "
        r"last record, a chunk logged 1700000000\.173456 s to 1700000000\.213456 s; \d+ messages "
        r"of it that were asked for were recovered, which no checksum covers; last message that "
        r"was asked for: logged 1700000000.203456 s"
    )
    assert re.fullmatch(expected, note)


@pytest.mark.parametrize("options", WAYS.values(), ids=WAYS.keys())
def test_damaged_file_never_gives_another_number(
    write: Write, tmp_path: Path, options: dict[str, Any]
) -> None:
    """One byte is changed, anywhere: an error, or what the file held before."""
    path = write(**options)
    content, whole = path.read_bytes(), read_recording(path)
    damaged, errors = tmp_path / "damaged.mcap", []
    chance = random.Random(1)
    for position in range(0, len(content), 29):
        changed = bytearray(content)
        changed[position] ^= chance.randrange(1, 256)
        damaged.write_bytes(changed)
        try:
            recording = read_recording(damaged)
        except InputError as error:
            errors.append(str(error))
            continue
        if not any("its summary counts" in note for note in recording.notes):
            assert is_part_of(recording, whole), position
    assert all(f"{damaged}: " in error for error in errors)
    assert "\n" not in "".join(errors)
    assert len(errors) > 100


@pytest.mark.parametrize("opcode", [0x07, 0x09, 0x85])
def test_chunk_that_is_taken_for_something_else_is_missed(write: Write, opcode: int) -> None:
    path = write(**CHUNKED)
    content = path.read_bytes()
    with path.open("rb") as file:
        begin = make_reader(file).get_summary().chunk_indexes[1].chunk_start_offset
    path.write_bytes(content[:begin] + bytes([opcode]) + content[begin + 1 :])
    recording = read_recording(path)
    assert re.search(r"its summary counts 10 messages, \d were found", recording.notes[0])


def test_chunks_without_wanted_messages_are_left_alone(
    by_mcap: Write, make_ticks: Callable[[int], list[Any]]
) -> None:
    """One message in each chunk: the last, of the contour, which no signal needs, is damaged."""
    entries = make_ticks(10)
    path = by_mcap([*entries, entries[0]], chunk_size=1, compression=CompressionType.NONE)
    content = path.read_bytes()
    place = content.rindex(b"box\x00")
    path.write_bytes(content[:place] + b"f" + content[place + 1 :])
    assert read_recording(path)["travel"].value.size == 10
    with pytest.raises(InputError, match="crc validation"):
        list(read_messages(path, ["/hma_gripper_sim/contour"]))


def test_chunk_that_a_damaged_index_hides_is_missed(write: Write) -> None:
    path = write(chunk_size=1, compression=CompressionType.NONE)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    topics = {channel.topic: number for number, channel in summary.channels.items()}
    joints = topics["/joint_states"]
    place = [c for c in summary.chunk_indexes if joints in c.message_index_offsets][3]
    content = bytearray(path.read_bytes())
    at = place.message_index_offsets[joints] + 9
    assert content[at] == joints
    content[at] = topics["/hma_gripper_sim/contour"]
    path.write_bytes(content)
    recording = read_recording(path)
    assert recording["travel"].value.size == 9
    assert recording.notes[0] == (
        "plain.mcap is damaged: of /joint_states its summary counts 10 messages, 9 were found"
    )


def test_wrong_checksum_of_a_chunk_is_named(write: Write) -> None:
    path = write(**CHUNKED)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"slide", b"slime", 1))
    reason = r"chunk at byte \d+, logged 1700000000.123456 s to 1700000000.\d+ s: crc validation"
    with pytest.raises(InputError, match=reason):
        read_recording(path)


def test_wrong_checksum_of_the_data_section_is_named(write: Write) -> None:
    path = write(use_chunking=False, enable_data_crcs=True)
    path.write_bytes(path.read_bytes().replace(b"box\x00", b"fox\x00", 1))
    with pytest.raises(InputError, match=r"checksum of the data section .* does not match"):
        read_recording(path)


def test_wrong_checksum_of_the_summary_is_named(write: Write) -> None:
    path = write(chunk_size=2000)
    content = path.read_bytes()
    name = content.rindex(b"sensor_msgs/msg/JointState")
    path.write_bytes(content[:name] + b"S" + content[name + 1 :])
    with pytest.raises(InputError, match=r"checksum of the summary .* does not match"):
        read_recording(path)


@pytest.mark.parametrize("begin", [b"", b"\x89MCAP1\r\n", b"\x89", b"PK\x03\x04" * 8])
def test_file_that_begins_otherwise_is_named(tmp_path: Path, begin: bytes) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(begin)
    with pytest.raises(InputError, match=r"is empty|neither an mcap|is truncated: ends at byte 1"):
        read_recording(path)


def test_other_profile_is_noted(write: Write) -> None:
    path = write(use_chunking=False, enable_crcs=False)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"\x04\x00\x00\x00ros2", b"\x04\x00\x00\x00px42", 1))
    recording = read_recording(path)
    assert any("profile is 'px42', not 'ros2'" in note for note in recording.notes)
    assert recording["travel"].value.size == 10


def test_messages_of_ros_1_in_an_mcap_file_are_read(
    tmp_path: Path, make_ticks: Callable[[int], list[Any]], as_ros1: Callable[[Any], Any]
) -> None:
    """As the mcap command line tool makes them of bags."""
    path = tmp_path / "ros1.mcap"
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file)
        writer.start(profile="ros1")
        channels = {}
        for topic, stamp, message in make_ticks(5):
            definition, data = as_ros1(message)
            if topic not in channels:
                schema = writer.register_schema(topic.msgtype, "ros1msg", definition.encode())
                channels[topic] = writer.register_channel(topic.name, "ros1", schema)
            writer.add_message(channels[topic], stamp, data, stamp)
        writer.finish()
    recording = read_recording(path)
    assert recording["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]
    assert recording.notes[0] == "its mcap profile is 'ros1', not 'ros2'"


def test_two_channels_of_one_topic_are_refused(
    tmp_path: Path, make_ticks: Callable[[int], list[Any]], serialise: Callable[[Any], bytes]
) -> None:
    path = tmp_path / "two.mcap"
    wrenches = [entry for entry in make_ticks(6) if entry[0].name == WRENCH]
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file)
        writer.start(profile="ros2")
        # without a definition: the type is one that everybody knows
        schema = writer.register_schema(wrenches[0][0].msgtype, "", b"")
        channels = [writer.register_channel(WRENCH, "cdr", schema) for _ in range(2)]
        for index, (_, stamp, message) in enumerate(wrenches):
            writer.add_message(channels[index % 2], stamp, serialise(message), stamp)
        writer.finish()
    entry = {"topic": WRENCH, "field": "wrench.force.z"}
    with pytest.raises(InputError, match=r"2 publishers \('1', '2'\); 'publisher: NAME'"):
        read_recording(path, SignalMap.from_mapping({"actuator_force": entry}))
    chosen = SignalMap.from_mapping({"actuator_force": {**entry, "publisher": 2}})
    assert read_recording(path, chosen)["actuator_force"].value.tolist() == [0.375, 0.125, -0.125]
    both = SignalMap.from_mapping({"actuator_force": {**entry, "publisher": "any"}})
    assert read_recording(path, both)["actuator_force"].value.size == 6


def test_bytes_behind_the_end_do_not_matter(write: Write) -> None:
    path = write()
    path.write_bytes(path.read_bytes() + bytes(100))
    recording = read_recording(path)
    assert recording["travel"].value.size == 10
    assert not any("truncated" in note for note in recording.notes)


def test_channels_that_are_not_ros_are_named(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file)
        writer.start()
        schema = writer.register_schema("Joints", "jsonschema", b"{}")
        channel = writer.register_channel("/joint_states", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()
    with pytest.raises(InputError, match="travel: unknown type 'Joints': its encoding 'json'"):
        read_recording(path)


def test_unknown_types_are_skipped_and_named(tmp_path: Path, write: Write) -> None:
    """A channel without a definition, whose type nobody knows."""
    path = write(use_chunking=False, enable_crcs=False)
    content = path.read_bytes()
    end = content.index(b"\x0f\x04" + bytes(7))  # the end of the data
    with (tmp_path / "other.mcap").open("wb") as file:
        writer = mcap.writer.Writer(file, use_chunking=False)
        writer.start()
        for _ in range(9):
            schema = writer.register_schema("my_msgs/msg/Grip", "ros2msg", b"")
        for _ in range(9):
            channel = writer.register_channel("/grip", "cdr", schema)
        writer.add_message(channel, 1, b"\x00\x01\x00\x00", 1)
        writer.finish()
    other = (tmp_path / "other.mcap").read_bytes()
    begin = other.index(b"\x03", len(MAGIC) + 9 + other[9])
    added = other[begin : other.index(b"\x0f\x04" + bytes(7))]
    path.write_bytes(content[:end] + added + content[end:])
    recording = read_recording(path)
    assert recording["travel"].value.size == 10
    assert (
        "/grip: skipped, unknown type 'my_msgs/msg/Grip': the log does not define it"
        in recording.notes
    )


def chunk(content: bytes, *, size: int, compression: bytes = b"") -> bytes:
    """A chunk record."""
    number = int.to_bytes
    body = number(0, 16, "little") + number(size, 8, "little")
    body += number(zlib.crc32(content), 4, "little") + number(len(compression), 4, "little")
    body += compression + number(len(content), 8, "little") + content
    return b"\x06" + number(len(body), 8, "little") + body


@pytest.mark.parametrize(
    ("record", "reason"),
    [
        (chunk(b"", size=0, compression=b"zip"), "unknown compression 'zip'"),
        (chunk(b"", size=2**62), "claims to have 4611686018427387904 bytes"),
        (chunk(b"abc", size=3), "has 3 bytes, of which 0 are records, and claims to have 3"),
        (chunk(b"abc", size=5, compression=b"zstd"), "zstd|frame|decompress"),
        (chunk(b"abc", size=5, compression=b"lz4"), "crc validation failed"),
        (b"\x06\x02" + bytes(9), "chunk at byte 37 cannot be read"),
        (b"\x44\x02" + bytes(9), "record of unknown kind 68 at byte 37: damaged"),
        (b"\x05\x02" + bytes(9), "a message record is too short"),
        (b"\x04\xff\xff\xff\xff\xff" + bytes(90), r"claims to have \d+ bytes: damaged"),
    ],
)
def test_damaged_records_are_named(tmp_path: Path, record: bytes, reason: str) -> None:
    path = tmp_path / "log.mcap"
    header = b"\x01\x08" + bytes(7) + bytes(8)
    path.write_bytes(MAGIC + header + b"\x09\x03" + bytes(10) + record)
    with pytest.raises(InputError, match=reason) as caught:
        read_recording(path)
    assert caught.value.source == str(path)


def test_file_is_read_a_piece_at_a_time(
    write: Write, monkeypatch: pytest.MonkeyPatch, make_ticks: Callable[[int], Sequence[Any]]
) -> None:
    """Records that are cut by the end of a piece, or are longer than one."""
    monkeypatch.setattr("hma_gripper_sim.bags.mcap_file._PIECE", 100)
    for options in WAYS.values():
        assert read_recording(write(**options))["travel"].value.size == 10


@pytest.mark.parametrize("cut", [0, 1])
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_chunk_that_expands_beyond_its_size_is_refused(
    tmp_path: Path, compression: str, cut: int
) -> None:
    """Whatever its content claims; also if the file breaks off in it."""
    big = bytes(2**28)
    frame = lz4.frame.compress(big)
    if compression == "zstd":
        frame = zstandard.ZstdCompressor().compress(big)
    content = chunk(frame, size=1000, compression=compression.encode())
    path = tmp_path / "log.mcap"
    path.write_bytes(MAGIC + content[: len(content) - cut])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match=r"more bytes than the 1000 it claims|unknown kind 0"):
        read_recording(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


def test_chunk_that_claims_to_expand_beyond_reason_is_refused(tmp_path: Path) -> None:
    """Some kilobytes that stand for 128 MiB of zeros, and say so."""
    size = 2**27
    content = chunk(
        zstandard.ZstdCompressor().compress(bytes(size)), size=size, compression=b"zstd"
    )
    path = tmp_path / "log.mcap"
    path.write_bytes(MAGIC + content)
    with pytest.raises(InputError, match=f"claims to have {size} bytes"):
        read_recording(path)


SEPARATOR = "=" * 80 + "\n"
BOMBS = {
    "100,000 fields": "string[] name\n" + "\n".join(f"float64 f{i}" for i in range(100_000)),
    "10,000 fields": "string[] name\n" + "\n".join(f"int8 f{i}" for i in range(10_000)),
    "10^12 empty structures": "string[] name\na/B[1000000] position\n"
    f"{SEPARATOR}MSG: a/B\na/C[1000000] c\n{SEPARATOR}MSG: a/C\nstd_msgs/Empty e\n"
    f"{SEPARATOR}MSG: std_msgs/Empty\n",
    "2^40 fields": "string[] name\na/B0 position\n"
    + "".join(f"{SEPARATOR}MSG: a/B{i}\na/B{i + 1} c\na/B{i + 1} d\n" for i in range(40))
    + f"{SEPARATOR}MSG: a/B40\nint8 x\n",
    "10^6 texts": "string[] name\nstring[1000000] position\n",
    "itself": f"string[] name\na/B position\n{SEPARATOR}MSG: a/B\na/B b\n",
}


@pytest.mark.parametrize("definition", BOMBS.values(), ids=BOMBS.keys())
def test_type_that_is_too_large_to_be_one_is_refused(tmp_path: Path, definition: str) -> None:
    path = tmp_path / "log.mcap"
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file)
        writer.start("ros2")
        name = "sensor_msgs/msg/JointState"
        schema = writer.register_schema(name, "ros2msg", definition.encode())
        channel = writer.register_channel("/joint_states", "cdr", schema)
        writer.add_message(channel, 1, b"\x00\x01\x00\x00" + bytes(40), 1)
        writer.finish()
    began = time.monotonic()
    with pytest.raises(InputError, match=r"unknown type 'sensor_msgs/msg/JointState': its def"):
        read_recording(path)
    with pytest.raises(InputError, match="unknown type"):
        list(read_messages(path, ["/joint_states"]))
    assert time.monotonic() - began < 2.0


def test_type_of_ros_1_in_an_mcap_file_is_read(
    tmp_path: Path, make_ticks: Callable[[int], list[Any]], as_ros1: Callable[[Any], Any]
) -> None:
    """As `mcap convert` writes it, and ROS 2 where a recorder leaves out the ``msg``."""
    entries = [entry for entry in make_ticks(3) if entry[0].name == WRENCH]
    definition, data = as_ros1(entries[0][2])
    path = tmp_path / "ros1.mcap"
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file)
        writer.start("ros1")
        name = "geometry_msgs/WrenchStamped"
        schema = writer.register_schema(name, "ros1msg", definition.encode())
        channel = writer.register_channel(WRENCH, "ros1", schema)
        writer.add_message(channel, 1, data, 1)
        writer.finish()
    entry = {"topic": WRENCH, "field": "wrench.force.z"}
    recording = read_recording(path, SignalMap.from_mapping({"actuator_force": entry}))
    assert recording["actuator_force"].value.tolist() == [0.5]


def test_type_without_msg_in_its_name_is_read(
    tmp_path: Path, by_mcap: Write, make_ticks: Callable[[int], list[Any]]
) -> None:
    path = by_mcap(make_ticks(5), use_chunking=False, enable_crcs=False)
    content = path.read_bytes()
    old, new = b"sensor_msgs/msg/JointState", b"sensor_msgs/JointState"
    begin = content.index(old)
    record = begin - 4 - 2 - 9
    size = int.from_bytes(content[record + 1 : record + 9], "little") - 4
    path.write_bytes(
        content[: record + 1]
        + size.to_bytes(8, "little")
        + content[record + 9 : begin - 4]
        + len(new).to_bytes(4, "little")
        + new
        + content[begin + len(old) :]
    )
    assert read_recording(path)["travel"].value.tolist() == [0.0, 0.001, 0.002, 0.003, 0.004]
