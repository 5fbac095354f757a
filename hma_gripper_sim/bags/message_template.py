"""A serialised message whose numbers change in place: it is serialised once, however often sent."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_STAMP = struct.Struct("=iI")
_STAMP_OFFSET = 4  # behind the four bytes that say how the rest is encoded


def placeholders(rows: int, columns: int) -> Array:
    """Numbers that no message holds by chance, different in each place; shape (rows, columns)."""
    return np.pi * np.arange(1.0, rows * columns + 1.0).reshape(rows, columns)


class MessageTemplate:
    """The bytes of a message that starts with a header or a time.

    Parameters
    ----------
    serialised
        The message in CDR.
    rows
        The `placeholders` in it, which stand for numbers to come.

    Attributes
    ----------
    numbers
        For each row its place in the bytes, to be written to.
    """

    def __init__(self, serialised: bytes, rows: Array) -> None:
        self._bytes = bytearray(serialised)
        self._offsets = [self._bytes.find(row.tobytes()) for row in rows]
        self.numbers = [
            np.frombuffer(self._bytes, dtype=np.float64, count=rows.shape[1], offset=offset)
            for offset in self._offsets
        ]

    def stamp(self, seconds: int, nanoseconds: int) -> None:
        """Set the time at its start."""
        _STAMP.pack_into(self._bytes, _STAMP_OFFSET, seconds, nanoseconds)

    @property
    def content(self) -> bytes:
        """The message with the present numbers."""
        return bytes(self._bytes)

    def repeated(self, stamps: NDArray[np.int64], *values: Array) -> Iterator[bytes]:
        """Yield a message for each stamp [ns], with a row of each of the values."""
        rows = np.tile(np.frombuffer(self._bytes, dtype=np.uint8), (len(stamps), 1))
        time = np.stack(np.divmod(stamps, 1_000_000_000), axis=1).astype("<u4")
        _put(rows, _STAMP_OFFSET, time)
        for offset, value in zip(self._offsets, values, strict=True):
            _put(rows, offset, np.ascontiguousarray(value, dtype="<f8"))
        content, size = rows.tobytes(), rows.shape[1]
        return (content[i : i + size] for i in range(0, len(content), size))


def _put(rows: NDArray[np.uint8], offset: int, values: NDArray[Any]) -> None:
    """Write a row of numbers into each row of bytes, from an offset on."""
    content = values.view(np.uint8).reshape(len(rows), -1)
    rows[:, offset : offset + content.shape[1]] = content
