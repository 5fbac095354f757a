"""Records and numbers in the bytes of a log: what is done once per message."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

PREFIX = 9
"""Bytes in front of an mcap record's content: what it is, and how long."""


@kernel
def _uint64(data: Bytes, position: int) -> int:
    """Return the number of eight bytes; negative if it is beyond 2**63."""
    number = np.int64(0)
    for i in range(8):
        number |= np.int64(data[position + i]) << np.int64(8 * i)
    return number  # type: ignore[return-value]


@kernel
def scan_records(
    data: Bytes, position: int, opcodes: Bytes, starts: Ints, sizes: Ints
) -> tuple[int, int]:
    """Find the records of an mcap file that lie one behind another, as many as there is room for.

    Parameters
    ----------
    data
        Bytes of the file, or of a chunk.
    position
        Where the first record begins in `data`.
    opcodes, starts, sizes
        Of each record: what it is, and where its content begins and how many bytes that has,
        shape (room,); set here.

    Returns
    -------
    Number of records that are in `data` as a whole, and the position behind the last of them.
    """
    count = 0
    while count < opcodes.size and position + PREFIX <= data.size:
        size = _uint64(data, position + 1)
        if size < 0 or size > data.size - position - PREFIX:
            break
        opcodes[count] = data[position]
        starts[count] = position + PREFIX
        sizes[count] = size
        position += PREFIX + size
        count += 1
    return count, position


@kernel
def copy_bytes(data: Bytes, starts: Ints, offsets: Ints, width: int, out: Bytes) -> None:
    """Copy `width` bytes at each of the offsets of each message.

    Parameters
    ----------
    data
        Bytes that hold the messages.
    starts
        Where each message begins, shape (n,).
    offsets
        From there, shape (k,).
    out
        Shape (n, k * width); set here.
    """
    for i in range(starts.size):
        for j in range(offsets.size):
            source = starts[i] + offsets[j]
            target = j * width
            for k in range(width):
                out[i, target + k] = data[source + k]


@kernel
def match_messages(
    data: Bytes, starts: Ints, sizes: Ints, template: Bytes, spans: Ints, matches: Bools
) -> None:
    """Find the messages whose bytes are those of a template wherever they say what lies where.

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
    matches
        Shape (n,); set here.
    """
    for i in range(starts.size):
        matches[i] = sizes[i] == template.size
        if not matches[i]:
            continue
        difference = np.uint8(0)
        for s in range(spans.shape[0]):
            for k in range(spans[s, 0], spans[s, 1]):  # without a way out: done many at a time
                difference |= data[starts[i] + k] ^ template[k]
        matches[i] = difference == 0
