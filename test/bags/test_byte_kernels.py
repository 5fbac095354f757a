"""Finding records and numbers in bytes."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim.bags.byte_kernels import copy_bytes, match_messages, scan_records


def scan(data: bytes, position: int = 0, room: int = 10) -> tuple[list[tuple[int, bytes]], int]:
    """What kind each record is, and its content; and where the last ends."""
    opcodes = np.zeros(room, dtype=np.uint8)
    starts, sizes = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int64)
    count, end = scan_records(np.frombuffer(data, dtype=np.uint8), position, opcodes, starts, sizes)
    found = [(int(opcodes[i]), data[starts[i] : starts[i] + sizes[i]]) for i in range(count)]
    return found, int(end)


def record(opcode: int, content: bytes) -> bytes:
    return bytes([opcode]) + len(content).to_bytes(8, "little") + content


def test_records_are_found_one_behind_another() -> None:
    data = record(5, b"abc") + record(255, b"") + record(1, bytes(300))
    assert scan(data) == ([(5, b"abc"), (255, b""), (1, bytes(300))], len(data))
    assert scan(data, position=12) == ([(255, b""), (1, bytes(300))], len(data))
    assert scan(data, room=1) == ([(5, b"abc")], 12)


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
    out = np.zeros((2, 6), dtype=np.uint8)
    copy_bytes(data, np.array([10, 50]), np.array([0, 7]), 3, out)
    assert out.tolist() == [[10, 11, 12, 17, 18, 19], [50, 51, 52, 57, 58, 59]]


def test_messages_match_in_the_spans_only() -> None:
    messages = [b"name=1;x", b"name=2;x", b"nama=1;x", b"name=1;y", b"name=1;xx", b"name=1;"]
    data = np.frombuffer(b"".join(messages), dtype=np.uint8)
    sizes = np.array([len(message) for message in messages])
    starts = np.cumsum(sizes) - sizes
    template = np.frombuffer(messages[0], dtype=np.uint8)
    matches = np.zeros(len(messages), dtype=np.bool_)
    match_messages(data, starts, sizes, template, np.array([[0, 5], [7, 8]]), matches)
    assert matches.tolist() == [True, True, False, False, False, False]
