"""Records and numbers in the bytes of a log: what is done with every message, many at a time.

Not compiled: to load a compiler takes longer than to read most logs, and twice their memory.
"""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

PREFIX = 9
"""Bytes in front of an mcap record's content: what it is, and how long."""

_read_prefix = struct.Struct("<BQ").unpack_from

_SOME = 32
"""Records that are found one by one before it is tried whether they repeat."""

_AT_ONCE = 2**20
"""Bytes that are copied to compare them."""


def find_records(data: Bytes, position: int, most: int) -> tuple[Bytes, Ints, Ints, int]:
    """Find the records of an mcap file that lie one behind another.

    They are found one by one. But the topics of a log often come in one order again and again, each
    with messages of one length: where this is so, it is checked for many records at a time.

    Parameters
    ----------
    data
        Bytes of the file, or of a chunk.
    position
        Where the first record begins in `data`.
    most
        Records that are found, and a few.

    Returns
    -------
    What each record is, where its content begins, and how many bytes that has, shape (n,), of those
    that are in `data` as a whole; and the position behind the last of them.
    """
    opcodes, starts, sizes = [], [], []
    found, is_more = 0, True
    while is_more and found < most:
        some = _one_by_one(data, position)
        is_more = len(some) == _SOME
        again = _repeated(data, some, (most - found) // _SOME) if is_more else some[:0]
        for part in (some, again):
            opcodes.append(part[:, 0].astype(np.uint8))
            starts.append(part[:, 1])
            sizes.append(part[:, 2])
            found += len(part)
            if len(part):
                position = int(part[-1, 1] + part[-1, 2])
    return np.concatenate(opcodes), np.concatenate(starts), np.concatenate(sizes), position


def _one_by_one(data: Bytes, position: int) -> Ints:
    """Return what each record is, where its content begins, and its size, shape (n, 3)."""
    found: list[tuple[int, int, int]] = []
    buffer = data.data
    while position + PREFIX <= data.size and len(found) < _SOME:
        opcode, size = _read_prefix(buffer, position)
        position += PREFIX
        if size > data.size - position:
            break
        found.append((opcode, position, size))
        position += size
    return np.array(found, np.int64).reshape(-1, 3)


def _repeated(data: Bytes, found: Ints, most: int) -> Ints:
    """Return the records behind those that are found as far as they repeat the last of these."""
    kinds = found[:, [0, 2]].tolist()
    for count in range(1, _SOME // 2 + 1):
        if kinds[-count:] == kinds[-2 * count : -count]:
            break
    else:
        return found[:0]
    last = found[-count:]
    begin, end = int(last[0, 1]) - PREFIX, int(last[-1, 1] + last[-1, 2])
    times = np.arange(1, min(most, (data.size - end) // (end - begin)) + 1)
    offsets = last[:, 1] - PREFIX - begin
    prefixes = bytes_at(data, begin + (end - begin) * times, offsets, PREFIX)
    differs = (prefixes != bytes_at(data, np.array([begin]), offsets, PREFIX)).any(axis=1)
    times = times[: int(np.argmax(differs))] if differs.any() else times
    again = np.repeat(last[None], times.size, axis=0)
    again[:, :, 1] += (end - begin) * times[:, None]
    return again.reshape(-1, 3)


def bytes_at(data: Bytes, starts: Ints, offsets: Ints, width: int) -> Bytes:
    """Return `width` bytes at each of the offsets of each message, shape (n, k * width).

    Parameters
    ----------
    data
        Bytes that hold the messages.
    starts
        Where each message begins, shape (n,).
    offsets
        From there, shape (k,).
    """
    places = starts[:, None] + offsets
    found: Bytes = _windows(data, width)[places].reshape(starts.size, offsets.size * width)
    return found


def _windows(data: Bytes, width: int) -> Bytes:
    """Return the `width` bytes from each on, as a view; numpy's own takes longer than its use."""
    return np.ndarray((max(0, data.size - width + 1), width), np.uint8, data, strides=(1, 1))


def matching(data: Bytes, starts: Ints, sizes: Ints, template: Bytes, spans: Ints) -> Bools:
    """Return which messages have a template's bytes wherever they say what lies where, shape (n,).

    Parameters
    ----------
    data
        Bytes that hold the messages.
    starts, sizes
        Where each message begins, and how many bytes it has, shape (n,).
    template
        One message.
    spans
        First byte, and the one behind the last, of what must be equal, shape (s, 2).
    """
    matches: Bools = sizes == template.size
    alike = np.flatnonzero(matches)
    if not alike.size:
        return matches
    fixed = np.zeros(template.size, dtype=np.bool_)
    for begin, end in spans.tolist():
        fixed[begin:end] = True
    whole = _windows(data, template.size)
    count = max(1, _AT_ONCE // template.size)
    for some in (alike[i : i + count] for i in range(0, alike.size, count)):
        matches[some] = ~((whole[starts[some]] != template) & fixed).any(axis=1)
    return matches
