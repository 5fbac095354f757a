"""Reading ROS 1 bag files from front to back, whole or not (wiki.ros.org/Bags/Format/2.0).

The reader of `rosbags` needs the index at the end, which a bag that was not closed lacks, and
keeps all of it in memory. Its parser of records is used here.
"""

from __future__ import annotations

import bz2
from collections.abc import Callable, Collection, Iterator
from io import BytesIO
from typing import Any, BinaryIO

import lz4.frame
import numpy as np
from rosbags.rosbag1.reader import (
    Header,
    ReaderError,
    RecordType,
    normalize,
    normalize_msgtype,
    read_bytes,
    read_uint32,
)

from hma_gripper_sim.bags.message_batches import ROS1, Batch, Connection, Findings, shown
from hma_gripper_sim.errors import InputError, first_line

MAGIC = b"#ROSBAG V2.0\n"

_LARGEST = 2**30
"""A record with more bytes is damaged."""

_DECOMPRESSORS: dict[str, Callable[[], Any]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": lz4.frame.LZ4FrameDecompressor,
}


class BagFile:
    """One ROS 1 bag file.

    Parameters
    ----------
    name
        Of the file.
    stream
        Its bytes, from the first on; need not be seekable.
    findings
        Takes what is found out.
    topics
        Those whose messages are wanted.
    """

    def __init__(
        self, name: str, stream: BinaryIO, findings: Findings, topics: Collection[str]
    ) -> None:
        self._name = name
        self._stream = stream
        self._findings = findings
        self._topics = topics
        self._position = 0
        self._connections: dict[int, Connection] = {}
        self._messages = 0
        self._last_logged: int | None = None

    def batches(self) -> Iterator[Batch]:
        """Yield the wanted messages, chunk by chunk.

        Raises
        ------
        InputError
            The file is damaged or encrypted.
        """
        self._read(len(MAGIC))
        closed, chunks, indexed, counted, lost = False, 0, 0, 0, ""
        while True:
            where = f"byte {self._position}"
            try:
                header, data, missing = self._record()
                kind = header.get_uint8("op")
                if kind == RecordType.BAGHEADER:
                    closed = header.get_uint64("index_pos") > 0
                    chunks = header.get_uint32("chunk_count")
                    if header.get("encryptor"):
                        raise InputError("it is encrypted")
                elif kind == RecordType.CHUNK:
                    before = self._messages
                    yield Batch.of(self._chunk(header, data, whole=not missing))
                    lost = f", a chunk; {self._messages - before} messages of it were recovered"
                elif kind == RecordType.CONNECTION and not missing:
                    self._connect(header, data)
                elif kind == RecordType.CHUNK_INFO and not missing:
                    indexed += 1
                    counted += int(np.frombuffer(data, dtype="<u4")[1::2].sum())
                elif kind not in (RecordType.CONNECTION, RecordType.CHUNK_INFO, RecordType.IDXDATA):
                    raise ReaderError(f"is of unknown kind {kind}")
            except EOFError:
                lost = ""
                break
            except InputError:
                raise
            except Exception as error:  # a damaged record makes its parser raise almost anything
                raise InputError(f"record at {where}: {first_line(error)}: damaged") from None
            if missing:
                size = len(data) + missing
                lost = f", lost are {missing} of {size} bytes of the last record{lost}"
                break
        if not closed or indexed != chunks:
            self._note_loss(f"is truncated: ends at byte {self._position}{lost}")
        elif counted != self._messages:
            self._note_loss(
                f"is damaged: its index counts {counted} messages, {self._messages} were found"
            )

    def _note_loss(self, what: str) -> None:
        if self._last_logged is not None:
            what += f"; last message that was asked for: logged {shown(self._last_logged)}"
        self._findings.losses.append(f"{self._name} {what}")

    def _record(self) -> tuple[Header, bytes, int]:
        """Return the next record's header, its data, and how many bytes of these are missing."""
        prefix = self._read(4)
        size = int.from_bytes(prefix, "little")
        fields = self._read(_bounded(size))
        length = self._read(4)
        if len(length) < 4:
            raise EOFError
        size = _bounded(int.from_bytes(length, "little"))
        data = self._read(size)
        return Header.read(BytesIO(prefix + fields)), data, size - len(data)

    def _read(self, size: int) -> bytes:
        data = self._stream.read(size)
        self._position += len(data)
        return data

    def _chunk(
        self, header: Header, data: bytes, *, whole: bool
    ) -> list[tuple[Connection, int, bytes]]:
        """Return the wanted messages of a chunk, or of as much as there is of it."""
        compression, size = header.get_string("compression"), header.get_uint32("size")
        if compression != "none":
            if compression not in _DECOMPRESSORS:
                raise InputError(f"unknown compression {compression!r}")
            data = _DECOMPRESSORS[compression]().decompress(data)
        if whole and len(data) != size:
            raise ReaderError(f"a chunk has {len(data)} bytes and claims to have {size}")
        content, messages = BytesIO(data), []
        while content.tell() < len(data):
            try:
                header = Header.read(content)
                entry = read_bytes(content, read_uint32(content))
            except ReaderError:
                if whole:
                    raise
                break
            kind = header.get_uint8("op")
            if kind == RecordType.CONNECTION:
                self._connect(header, entry)
                continue
            connection = self._connections.get(header.get_uint32("conn"))
            if kind != RecordType.MSGDATA or connection is None:
                raise ReaderError("a chunk has something else in it than messages")
            self._messages += 1
            if connection.topic in self._topics:
                self._last_logged = header.get_time("time")
                messages.append((connection, self._last_logged, entry))
        return messages

    def _connect(self, header: Header, data: bytes) -> None:
        number = header.get_uint32("conn")
        if number in self._connections:
            return
        fields = Header.read(BytesIO(len(data).to_bytes(4, "little") + data))
        connection = Connection(
            file=self._name,
            topic=normalize(header.get_string("topic")),
            msgtype=normalize_msgtype(fields.get_string("type")),
            publisher=fields.get_string("callerid") if "callerid" in fields else str(number),
            encoding=ROS1,
            definition=fields.get_string("message_definition"),
        )
        self._connections[number] = connection
        self._findings.add(connection)


def _bounded(size: int) -> int:
    if size > _LARGEST:
        raise ReaderError(f"claims to have {size} bytes")
    return size
