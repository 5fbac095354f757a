"""Reading mcap files from front to back, whole or not (https://mcap.dev/spec).

Nothing is looked up in the summary at the end, because a recording that was not finished has none.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Container, Iterator
from io import BytesIO
from typing import BinaryIO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, Schema, Statistics

from hma_gripper_sim.bags.byte_arrays import PREFIX
from hma_gripper_sim.bags.decompression import lz4_content, most_content, zstd_content
from hma_gripper_sim.bags.mcap_parsing import Records, column, parse, scan, size_behind
from hma_gripper_sim.bags.message_batches import (
    LARGEST,
    Batch,
    Bytes,
    Connection,
    Findings,
    absolute,
    count_profiles,
    full_type,
    shown,
)
from hma_gripper_sim.errors import InputError, first_line

MAGIC = b"\x89MCAP0\r\n"

_PIECE = 4 * 2**20
"""How much of a file is read at a time [bytes], if no record in it is longer."""

_DECOMPRESSORS = {
    "": lambda data, most: data[: most + 1],
    "lz4": lz4_content,
    "zstd": zstd_content,
}

_MESSAGE_PREFIX = 22
"""Bytes in front of a message's own: channel, sequence number, two times."""

_PROFILE = "ros2"

_OPCODES, _FIRST_PRIVATE = frozenset(map(int, Opcode)), 0x80
"""Kinds of records that mcap knows, and the first one that everybody may use."""

_PARSED = (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS)


class McapFile:
    """One mcap file.

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
        self._schemas: dict[int, Schema] = {}
        self._connections: dict[int, Connection] = {}
        self._known = np.zeros(2**16, dtype=np.bool_)
        self._wanted = np.zeros(2**16, dtype=np.bool_)
        self._crc = 0
        self._messages: Counter[int] = Counter()  # those that are wanted, by channel
        self._undeclared = 0
        self._counted: dict[int, int] = {}  # all, by channel, as the summary has it
        self._last_logged: int | None = None
        self._has_ended = False

    def batches(self) -> Iterator[Batch]:
        """Yield the wanted messages.

        Raises
        ------
        InputError
            A checksum does not match, or the file is no mcap file or damaged.
        """
        magic = self._stream.read(len(MAGIC))
        if magic != MAGIC[: len(magic)]:
            raise InputError(f"not an mcap file: begins with {magic.hex(' ')}")
        self._crc = zlib.crc32(magic)
        data, base, missing = b"", len(magic), 0
        while missing <= LARGEST and (piece := self._stream.read(max(_PIECE, missing))):
            data += piece
            if self._has_ended:
                break
            position = 0
            for records, end in scan(np.frombuffer(data, dtype=np.uint8)):
                yield from self._file_records(records, position, end, base)
                position = end
            data, base = data[position:], base + position
            missing = PREFIX + size_behind(data) - len(data)
        if not self._has_ended or not data.startswith(MAGIC):
            yield from self._rest(data, base)
        for channel, counted in self._counted.items():
            found = self._messages[channel]
            if self._wanted[channel] and counted != found:
                self._findings.lose(
                    f"{self._name} is damaged: of {self._connections[channel].topic} its summary "
                    f"counts {counted} messages, {found} were found"
                )
        if self._undeclared:
            self._findings.lose(
                f"{self._name}: {self._undeclared} messages of undeclared channels skipped"
            )

    def _file_records(self, records: Records, begin: int, end: int, base: int) -> Iterator[Batch]:
        """Treat records that lie between two positions of the piece of the file from `base` on."""
        hashed, done = begin, 0
        for index in np.flatnonzero(records.opcodes != Opcode.MESSAGE).tolist():
            if index > done:
                yield self._batch(records, slice(done, index))
            done = index + 1
            opcode = int(records.opcodes[index])
            content = int(records.starts[index])
            where = f"byte {base + content - PREFIX}"
            if opcode == Opcode.CHUNK and not self._is_needed(records, index + 1):
                continue
            if opcode == Opcode.CHUNK:
                chunk = parse(Chunk.read, records.content(index), f"chunk at {where}")
                yield from self._chunk(chunk, where)
            elif opcode == Opcode.DATA_END:
                self._hash(records.data[hashed : content - PREFIX])
                end_record = parse(DataEnd.read, records.content(index), f"end of data at {where}")
                self._compare(end_record.data_section_crc, "data section", where)
                self._crc, hashed = 0, content + int(records.sizes[index])
            elif opcode == Opcode.FOOTER:
                self._hash(records.data[hashed : content + 16])
                footer = parse(Footer.read, records.content(index), f"footer at {where}")
                if footer.summary_start:
                    self._compare(footer.summary_crc, "summary", where)
                self._has_ended = True
                return
            else:
                self._declare(records, index, where)
        self._hash(records.data[hashed:end])
        if done < records.opcodes.size:
            yield self._batch(records, slice(done, None))

    def _is_needed(self, records: Records, following: int) -> bool:
        """Return whether a chunk may hold wanted messages: its indexes follow it, one a channel."""
        index = following
        while index < records.opcodes.size and records.opcodes[index] == Opcode.MESSAGE_INDEX:
            channel = int.from_bytes(records.content(index).read(2), "little")
            if self._wanted[channel] or not self._known[channel]:
                return True
            index += 1
        return index in (following, records.opcodes.size)  # not indexed, or not all of it is here

    def _declare(self, records: Records, index: int, where: str) -> None:
        """Take up a header, schema or channel; skip what else there is."""
        opcode = int(records.opcodes[index])
        if opcode not in _OPCODES and opcode < _FIRST_PRIVATE:
            raise InputError(f"record of unknown kind {opcode} at {where}: damaged")
        if opcode not in _PARSED:
            return
        content = records.content(index)
        if opcode == Opcode.HEADER:
            header = parse(Header.read, content, f"header at {where}")
            if header.profile not in ("", _PROFILE):
                self._findings.note(f"its mcap profile is {header.profile!r}, not {_PROFILE!r}")
        elif opcode == Opcode.SCHEMA:
            schema = parse(Schema.read, content, f"schema at {where}")
            self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel.read, content, f"channel at {where}")
            if channel.id not in self._connections:
                connection = self._connection(channel)
                self._connections[channel.id] = connection
                self._known[channel.id] = True
                self._wanted[channel.id] = connection.topic in self._topics
                self._findings.add(connection)
        elif opcode == Opcode.STATISTICS:
            statistics = parse(Statistics.read, content, f"statistics at {where}")
            self._counted = statistics.channel_message_counts

    def _connection(self, channel: Channel) -> Connection:
        schema = self._schemas.get(channel.schema_id)
        qos = channel.metadata.get("offered_qos_profiles", "")
        return Connection(
            file=self._name,
            topic=absolute(channel.topic),
            msgtype=full_type(schema.name) if schema else "",
            publisher=str(channel.id),
            publishers=count_profiles(qos),
            encoding=channel.message_encoding,
            definition=schema.data.decode(errors="replace") if schema else "",
            is_idl=schema is not None and schema.encoding == "ros2idl",
        )

    def _chunk(self, chunk: Chunk, where: str) -> Iterator[Batch]:
        """Decompress a chunk, check it, and treat its records."""
        name = f"chunk at {where}, {_span(chunk)}"
        if chunk.compression not in _DECOMPRESSORS:
            raise InputError(f"{name}: unknown compression {chunk.compression!r}")
        if chunk.uncompressed_size > min(LARGEST, most_content(len(chunk.data))):
            raise InputError(f"{name}: claims to have {chunk.uncompressed_size} bytes")
        try:
            content = _DECOMPRESSORS[chunk.compression](chunk.data, chunk.uncompressed_size)
        except Exception as error:  # each library that decompresses raises its own
            raise InputError(f"{name}: {first_line(error)}") from None
        size = len(content)
        if size > chunk.uncompressed_size:
            raise InputError(f"{name}: has more bytes than the {chunk.uncompressed_size} it claims")
        if chunk.uncompressed_crc not in (0, zlib.crc32(content)):  # 0: not stated
            raise InputError(f"{name}: crc validation failed: damaged")
        data = np.frombuffer(content, dtype=np.uint8)
        position = 0
        for records, end in scan(data):
            yield from self._chunk_records(records, where)
            position = end
        if size != chunk.uncompressed_size or position != size:
            raise InputError(
                f"{name}: has {size} bytes, of which {position} are records, "
                f"and claims to have {chunk.uncompressed_size}"
            )

    def _chunk_records(self, records: Records, where: str) -> Iterator[Batch]:
        for index in np.flatnonzero(records.opcodes != Opcode.MESSAGE).tolist():
            self._declare(records, index, f"chunk at {where}")
        yield self._batch(records, slice(None))

    def _batch(self, records: Records, part: slice) -> Batch:
        """Return the wanted messages among some records."""
        found = np.flatnonzero(records.opcodes[part] == Opcode.MESSAGE) + (part.start or 0)
        starts, sizes = records.starts[found], records.sizes[found]
        if (sizes < _MESSAGE_PREFIX).any():
            raise InputError("a message record is too short to be one: the file is damaged")
        channel = column(records.data, starts, 0, "<u2")
        self._undeclared += int(np.count_nonzero(~self._known[channel]))
        wanted = np.flatnonzero(self._wanted[channel])
        starts, sizes, channel = starts[wanted], sizes[wanted], channel[wanted]
        logged = column(records.data, starts, 6, "<u8").astype(np.int64)
        if logged.size:
            self._last_logged = int(logged[-1])
        senders, which = np.unique(channel, return_inverse=True)
        self._messages.update(dict(zip(senders.tolist(), np.bincount(which), strict=True)))
        return Batch(
            records.data,
            tuple(self._connections[sender] for sender in senders.tolist()),
            which.astype(np.int64),
            logged,
            starts + _MESSAGE_PREFIX,
            sizes - _MESSAGE_PREFIX,
        )

    def _rest(self, data: bytes, base: int) -> Iterator[Batch]:
        """Recover what can be read of a file that breaks off, and note what is lost."""
        end, lost = base + len(data), ""
        if len(data) >= PREFIX and not self._has_ended:
            size = PREFIX + size_behind(data)
            if data.endswith(MAGIC) or size > LARGEST:
                raise InputError(f"the record at byte {base} claims to have {size} bytes: damaged")
            lost = f", lost are {size - len(data)} of {size} bytes of the last record"
            chunk = _partial_chunk(data) if data[0] == Opcode.CHUNK else None
            if chunk is not None:
                before = self._messages.total()
                for records, _ in scan(np.frombuffer(_begin(chunk), dtype=np.uint8)):
                    yield from self._chunk_records(records, f"byte {base}")
                recovered = self._messages.total() - before
                lost += (
                    f", a chunk {_span(chunk)}; {recovered} messages of it that were asked for "
                    "were recovered, which no checksum covers"
                )
        if self._last_logged is not None:
            lost += f"; last message that was asked for: logged {shown(self._last_logged)}"
        self._findings.lose(f"{self._name} is truncated: ends at byte {end}{lost}")

    def _hash(self, data: Bytes) -> None:
        self._crc = zlib.crc32(data.data, self._crc)

    def _compare(self, stated: int, what: str, where: str) -> None:
        if stated not in (0, self._crc):  # 0: not stated
            raise InputError(f"the checksum of the {what} at {where} does not match: damaged")


def _partial_chunk(data: bytes) -> Chunk | None:
    """Return a chunk that breaks off; None if not even its own header is complete."""
    try:
        chunk: Chunk = Chunk.read(ReadDataStream(BytesIO(data[PREFIX:])))
    except Exception:
        return None
    return chunk


def _begin(chunk: Chunk) -> bytes:
    """Return the first bytes of the content of a chunk that breaks off."""
    decompress = _DECOMPRESSORS.get(chunk.compression)
    size = min(chunk.uncompressed_size, LARGEST, most_content(len(chunk.data)))
    try:
        return decompress(chunk.data, size)[:size] if decompress else b""
    except Exception:  # damaged as well
        return b""


def _span(chunk: Chunk) -> str:
    return f"logged {shown(chunk.message_start_time)} to {shown(chunk.message_end_time)}"
