"""Finding records and numbers in bytes."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.bags import byte_arrays
from hma_gripper_sim.bags.byte_arrays import bytes_at, find_records, matching


def scan(data: bytes, position: int = 0, most: int = 1000) -> tuple[list[tuple[int, bytes]], int]:
    """What kind each record is, and its content; and where the last ends."""
    opcodes, starts, sizes, end = find_records(np.frombuffer(data, np.uint8), position, most)
    found = [
        (opcode, data[start : start + size])
        for opcode, start, size in zip(opcodes.tolist(), starts, sizes, strict=True)
    ]
    return found, end


def record(opcode: int, content: bytes) -> bytes:
    return bytes([opcode]) + len(content).to_bytes(8, "little") + content


def test_records_are_found_one_behind_another() -> None:
    data = record(5, b"abc") + record(255, b"") + record(1, bytes(300))
    assert scan(data) == ([(5, b"abc"), (255, b""), (1, bytes(300))], len(data))
    assert scan(data, position=12) == ([(255, b""), (1, bytes(300))], len(data))


def repeating() -> list[bytes]:
    """Three records again and again, which another one, and other lengths, interrupt."""
    three = [record(5, b"abc"), record(5, b""), record(7, bytes(range(20)))]
    return [*three * 50, record(6, b"?"), *three * 40, *[record(5, bytes(i)) for i in range(40)]]


@pytest.mark.parametrize("most", [1, 40, 1000])
def test_records_that_repeat_are_found_like_others(most: int) -> None:
    records = repeating()
    data, found, end = b"".join(records), [], 0
    while True:
        some, end = scan(data, end, most)
        assert len(some) < most + 64
        if not some:
            break
        found += some
    assert [record(*one) for one in found] == records
    assert end == len(data)


@pytest.mark.parametrize("kept", [*range(1780, 1830), 3000, 4100])
def test_records_that_repeat_end_where_one_is_cut(kept: int) -> None:
    records = repeating()
    ends = np.cumsum([len(one) for one in records])
    whole = int(np.searchsorted(ends, kept, side="right"))
    found, end = scan(b"".join(records)[:kept])
    assert [record(*one) for one in found] == records[:whole]
    assert end == ends[whole - 1]


def test_record_that_is_cut_is_not_found() -> None:
    data = record(5, b"abc") + record(1, bytes(300))
    for kept in range(12, len(data)):
        assert scan(data[:kept]) == ([(5, b"abc")], 12)


@pytest.mark.parametrize("size", [2**63, 2**64 - 1, 2**64 - 9, 2**40, 4])
def test_absurd_lengths_end_the_search(size: int) -> None:
    """Also those that are negative as a signed number, or wrap around."""
    assert scan(b"\x05" + size.to_bytes(8, "little") + b"abc") == ([], 0)


def test_bytes_are_copied_from_each_offset_of_each_message() -> None:
    data = np.arange(100, dtype=np.uint8)
    out = bytes_at(data, np.array([10, 50]), np.array([0, 7]), 3)
    assert out.tolist() == [[10, 11, 12, 17, 18, 19], [50, 51, 52, 57, 58, 59]]


def test_messages_match_in_the_spans_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whether they are compared all at once, or one by one."""
    messages = [b"name=1;x", b"name=2;x", b"nama=1;x", b"name=1;y", b"name=1;xx", b"name=1;"]
    data = np.frombuffer(b"".join(messages), dtype=np.uint8)
    sizes = np.array([len(message) for message in messages])
    starts = np.cumsum(sizes) - sizes
    template = np.frombuffer(messages[0], dtype=np.uint8)
    for at_once in (2**22, 1):
        monkeypatch.setattr(byte_arrays, "_AT_ONCE", at_once)
        matches = matching(data, starts, sizes, template, np.array([[0, 5], [6, 6], [7, 8]]))
        assert matches.tolist() == [True, True, False, False, False, False]
    assert matching(data, starts[:0], sizes[:0], template, np.array([[0, 5]])).tolist() == []
