"""Reading ROS 1 bag files from front to back, whole or not (wiki.ros.org/Bags/Format/2.0).

The reader of `rosbags` needs the index at the end, which a bag that was not closed lacks, and
keeps all of it in memory. Its parser of records is used here.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from io import BytesIO
from typing import BinaryIO

import numpy as np
from rosbags.rosbag1.reader import (
    Header,
    ReaderError,
    RecordType,
    read_bytes,
    read_uint32,
)

from hma_gripper_sim.bags.decompression import bz2_content, lz4_content, most_content
from hma_gripper_sim.bags.message_batches import (
    LARGEST,
    ROS1,
    Batch,
    Connection,
    Findings,
    absolute,
    full_type,
    shown,
)
from hma_gripper_sim.errors import InputError, first_line

MAGIC = b"#ROSBAG V2.0\n"

_NO_END = 2**63

_GROUP = 10_000
"""Messages that are put together where they lie in no chunk."""

_DECOMPRESSORS: dict[str, Callable[[bytes, int], bytes]] = {
    "none": lambda data, most: data[: most + 1],
    "bz2": bz2_content,
    "lz4": lz4_content,
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
        self, name: str, stream: BinaryIO, findings: Findings, topics: Container[str]
    ) -> None:
        self._name = name
        self._stream = stream
        self._findings = findings
        self._topics = topics
        self._position = 0
        self._index = 0  # where the index begins; 0: the bag was not closed
        self._end = _NO_END  # up to where bytes may belong to the present record
        self._is_open = False  # whether messages follow that no chunk was closed around
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
        chunks, indexed, counted, lost = 0, 0, 0, ""
        damage: tuple[int, InputError] | None = None
        group: list[tuple[Connection, int, bytes]] = []
        while True:
            begin = self._position
            try:
                header, data, missing = self._record()
                kind = header.get_uint8("op")
                if kind == RecordType.BAGHEADER:
                    self._index = header.get_uint64("index_pos")
                    chunks = header.get_uint32("chunk_count")
                    if header.get("encryptor"):
                        raise InputError("it is encrypted")
                elif kind == RecordType.CHUNK:
                    before = self._messages
                    yield Batch.of(self._chunk(header, data, whole=not missing))
                    if missing:
                        recovered = self._messages - before
                        lost = f", a chunk; {recovered} messages of it were recovered"
                elif kind == RecordType.MSGDATA and self._is_open:
                    if not missing:
                        self._message(header, data, group)
                elif kind == RecordType.CONNECTION:
                    if not missing:
                        self._connect(header, data)
                elif kind == RecordType.CHUNK_INFO and not missing:
                    indexed += 1
                    counted += int(np.frombuffer(data, dtype="<u4")[1::2].sum())
                elif kind not in (RecordType.CHUNK_INFO, RecordType.IDXDATA):
                    raise ReaderError(f"is of unknown kind {kind}")
            except EOFError:
                lost = ""
                break
            except InputError:
                raise
            except Exception as error:  # a damaged record makes its parser raise almost anything
                reason = f"record at byte {begin}: {first_line(error)}: damaged"
                if not begin < self._index:
                    raise InputError(reason) from None
                # What a recorder was writing when it was killed stays where it is when the bag is
                # indexed afterwards: the index says whether anything is missed.
                damage = begin, InputError(reason)
                self._skip_to_index()
                continue
            if len(group) >= _GROUP:
                yield Batch.of(group)
                group = []
            if missing:
                size = len(data) + missing
                lost = f", lost are {missing} of {size} bytes of the last record{lost}"
                if self._position != self._index:
                    break
                self._note_loss(f"was indexed after it had been cut off{lost}")
        if group:
            yield Batch.of(group)
        if damage is not None:
            if indexed != chunks or counted > self._messages:
                raise damage[1]
            self._note_loss(
                f"has {self._index - damage[0]} bytes in front of its index that are no record, "
                f"from byte {damage[0]} on"
            )
        elif not self._index or indexed != chunks:
            self._note_loss(f"is truncated: ends at byte {self._position}{lost}")
        elif counted != self._messages:
            self._note_loss(
                f"is damaged: its index counts {counted} messages, {self._messages} were found"
            )

    def _note_loss(self, what: str) -> None:
        if self._last_logged is not None:
            what += f"; last message that was asked for: logged {shown(self._last_logged)}"
        self._findings.lose(f"{self._name} {what}")

    def _record(self) -> tuple[Header, bytes, int]:
        """Return the next record's header, its data, and how many bytes of these are missing."""
        self._end = self._index if self._position < self._index else _NO_END
        prefix = self._read(4)
        size = int.from_bytes(prefix, "little")
        fields = self._read(_bounded(size))
        length = self._read(4)
        if len(length) < 4:
            if self._position == self._index:
                raise ReaderError("breaks off")
            raise EOFError
        size = _bounded(int.from_bytes(length, "little"))
        header = Header.read(BytesIO(prefix + fields))
        data = self._read(size)
        return header, data, size - len(data)

    def _read(self, size: int) -> bytes:
        """Read so many bytes, but in front of the index none beyond its beginning."""
        data = self._stream.read(min(size, self._end - self._position))
        self._position += len(data)
        return data

    def _skip_to_index(self) -> None:
        while self._position < self._index and self._read(min(2**20, self._index - self._position)):
            pass

    def _chunk(
        self, header: Header, data: bytes, *, whole: bool
    ) -> list[tuple[Connection, int, bytes]]:
        """Return the wanted messages of a chunk, or of as much as there is of it."""
        compression, size = header.get_string("compression"), header.get_uint32("size")
        if compression not in _DECOMPRESSORS:
            raise InputError(f"unknown compression {compression!r}")
        if whole and not data:  # the recorder was killed before it knew the size
            self._is_open = True
            if compression == "none":
                return []
            data, whole = self._read(LARGEST), False
            size = min(LARGEST, most_content(len(data)))
        if size > most_content(len(data)):
            raise ReaderError(f"a chunk of {len(data)} bytes claims to stand for {size}")
        content = _DECOMPRESSORS[compression](data, _bounded(size))
        if whole and len(content) != size:
            raise ReaderError(f"a chunk has not the {size} bytes that it claims to have")
        stream = BytesIO(content)
        messages: list[tuple[Connection, int, bytes]] = []
        while stream.tell() < len(content):
            try:
                header = Header.read(stream)
                entry = read_bytes(stream, read_uint32(stream))
            except ReaderError:
                if whole:
                    raise
                break
            kind = header.get_uint8("op")
            if kind == RecordType.CONNECTION:
                self._connect(header, entry)
            elif kind == RecordType.MSGDATA:
                self._message(header, entry, messages)
            else:
                raise ReaderError("a chunk has something else in it than messages")
        return messages

    def _message(
        self, header: Header, data: bytes, messages: list[tuple[Connection, int, bytes]]
    ) -> None:
        """Append a message, if it is wanted."""
        connection = self._connections.get(header.get_uint32("conn"))
        if connection is None:
            raise ReaderError("a chunk has something else in it than messages")
        self._messages += 1
        if connection.topic in self._topics:
            self._last_logged = header.get_time("time")
            messages.append((connection, self._last_logged, data))

    def _connect(self, header: Header, data: bytes) -> None:
        number = header.get_uint32("conn")
        if number in self._connections:
            return
        fields = Header.read(BytesIO(len(data).to_bytes(4, "little") + data))
        connection = Connection(
            file=self._name,
            topic=absolute(header.get_string("topic")),
            msgtype=full_type(fields.get_string("type")),
            publisher=fields.get_string("callerid") if "callerid" in fields else str(number),
            encoding=ROS1,
            definition=fields.get_string("message_definition"),
        )
        self._connections[number] = connection
        self._findings.add(connection)


def _bounded(size: int) -> int:
    if size > LARGEST:
        raise ReaderError(f"claims to have {size} bytes")
    return size
