"""The records that mcap files are made of (https://mcap.dev/spec), many at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import Any, TypeVar

import numpy as np
from mcap.data_stream import ReadDataStream

from hma_gripper_sim.bags.byte_arrays import PREFIX, bytes_at, find_records
from hma_gripper_sim.bags.message_batches import Bytes, Ints
from hma_gripper_sim.errors import InputError, first_line

_AT_ONCE = 2**16
"""Records that are found at a time."""

_Record = TypeVar("_Record")


@dataclass(frozen=True, eq=False)
class Records:
    """Records that are complete.

    Parameters
    ----------
    data
        Bytes that hold them, among others.
    opcodes
        What each is, shape (n,).
    starts, sizes
        Where the content of each begins in `data`, and how many bytes it has, shape (n,).
    """

    data: Bytes
    opcodes: Bytes
    starts: Ints
    sizes: Ints

    def content(self, index: int) -> ReadDataStream:
        """Return one record's content."""
        start = int(self.starts[index])
        return ReadDataStream(BytesIO(self.data[start : start + int(self.sizes[index])].tobytes()))


def scan(data: Bytes) -> Iterator[tuple[Records, int]]:
    """Yield the complete records in `data`, many at a time, and where they end."""
    end = 0
    while True:
        opcodes, starts, sizes, end = find_records(data, end, _AT_ONCE)
        if not starts.size:
            return
        yield Records(data, opcodes, starts, sizes), end


def size_behind(data: bytes) -> int:
    """Return how many bytes follow the prefix of the record that `data` begins with."""
    return int.from_bytes(data[1:PREFIX], "little")


def column(data: Bytes, starts: Ints, offset: int, kind: str) -> Any:
    """Return the number at `offset` of each record, shape (n,)."""
    width = int(kind[-1])
    return bytes_at(data, starts, np.array([offset]), width).view(kind)[:, 0]


def parse(read: Callable[[Any], _Record], content: ReadDataStream, what: str) -> _Record:
    """Return a record that the mcap library reads; raise `InputError` if it cannot."""
    try:
        return read(content)
    except Exception as error:  # a damaged record makes its parser raise almost anything
        raise InputError(f"{what} cannot be read: {first_line(error)}") from None
