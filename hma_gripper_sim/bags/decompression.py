"""Decompressing no more than is declared: a few bytes can stand for more than a memory holds.

Each function returns the whole content if that has at most `most` bytes, and otherwise so much of
it that it is longer than that. What breaks off gives what there is of it. Damaged data raises
whatever the library raises.
"""

from __future__ import annotations

import bz2
from typing import BinaryIO

import lz4.frame
import zstandard

from hma_gripper_sim.bags.message_batches import LARGEST
from hma_gripper_sim.errors import InputError

_PIECE = 2**20

_EXPANSION, _MOST_AT_FIRST = 1000, 2**25
"""How many times its packed size content may have, and bytes that any may have: more is a bomb."""


def most_content(packed: int) -> int:
    """Return how many bytes so many packed ones may stand for."""
    return max(_MOST_AT_FIRST, _EXPANSION * packed)


def lz4_content(data: bytes, most: int) -> bytes:
    """Decompress an LZ4 frame."""
    decompressor = lz4.frame.LZ4FrameDecompressor()
    return bytes(decompressor.decompress(data, max_length=most + 1))


def bz2_content(data: bytes, most: int) -> bytes:
    """Decompress a bzip2 stream."""
    return bz2.BZ2Decompressor().decompress(data, max_length=most + 1)


def zstd_content(data: bytes, most: int) -> bytes:
    """Decompress Zstandard frames."""
    content = bytearray()
    with zstandard.ZstdDecompressor().stream_reader(data, read_across_frames=True) as reader:
        while len(content) <= most and (piece := reader.read(min(_PIECE, most + 1 - len(content)))):
            content += piece
    return bytes(content)


def zstd_message(data: bytes) -> bytes:
    """Decompress one message; raise `InputError` if it is too large to be one."""
    most = min(LARGEST, most_content(len(data)))
    content = zstd_content(data, most)
    if len(content) > most:
        raise InputError(f"a message decompresses to more than {most} bytes")
    return content


class InflatedFile:
    """The content of a file that is compressed as a whole (Zstandard), from its beginning on.

    Parameters
    ----------
    stream
        The file.
    size
        Of the file [bytes].
    """

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._reader = zstandard.ZstdDecompressor().stream_reader(
            stream, read_across_frames=True, closefd=False
        )
        self._left = most_content(size)

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes; raise `InputError` if they are more than anyone would write."""
        piece = self._reader.read(size)
        self._left -= len(piece)
        if self._left < 0:
            raise InputError(f"decompresses to more than {_EXPANSION} times its size")
        return piece

    def seekable(self) -> bool:
        """Return that it is read from front to back only."""
        return False
