"""Writing the mcap file of a rosbag2 directory: with checksums, and readable whenever it ends.

The storage that `rosbags` brings writes no checksums, and what waits for its next chunk is lost
when the program is killed.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from itertools import chain
from pathlib import Path
from typing import Any

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import LIBRARY_IDENTIFIER, MCAP0_MAGIC
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import CompressionMode

_CHUNK = 2**20
"""A chunk ends when it has this many bytes."""

_MESSAGE = struct.Struct("<BQHIQQ")
"""Kind and length of a message record, its channel, sequence number, and both its times."""

_BEHIND_LENGTH = _MESSAGE.size - 9


class McapStorage:
    """A storage for `rosbags.rosbag2.Writer`.

    Parameters
    ----------
    path
        The rosbag2 directory.
    compression
        ``STORAGE``: chunks are compressed (zstd).
    """

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        self.path = path / f"{path.name}.mcap"
        self._file = self.path.open("xb")
        self._compress = (
            zstandard.ZstdCompressor().compress if compression == CompressionMode.STORAGE else None
        )
        self._position = 0
        self._schemas: dict[str, Schema] = {}
        self._channels: list[Channel] = []
        self._chunk: list[bytes] = []
        self._size = 0
        self._places: dict[int, list[tuple[int, int]]] = defaultdict(list)
        self._chunks: list[ChunkIndex] = []
        self._counts: dict[int, int] = defaultdict(int)
        self._append(MCAP0_MAGIC)
        self._append_record(Header("ros2", LIBRARY_IDENTIFIER))

    def add_msgtype(self, connection: Any) -> None:
        """Write the definition of a connection's type."""
        is_idl = connection.msgdef.format == MessageDefinitionFormat.IDL
        schema = Schema(
            id=len(self._schemas) + 1,
            name=connection.msgtype,
            encoding="ros2idl" if is_idl else "ros2msg",
            data=connection.msgdef.data.encode(),
        )
        self._schemas[connection.msgtype] = schema
        self._add(_content(schema))

    def add_connection(self, connection: Any, offered_qos_profiles: str) -> None:
        """Write what a topic is."""
        channel = Channel(
            id=connection.id,
            topic=connection.topic,
            message_encoding=connection.ext.serialization_format,
            metadata={"offered_qos_profiles": offered_qos_profiles},
            schema_id=self._schemas[connection.msgtype].id,
        )
        self._channels.append(channel)
        self._add(_content(channel))

    def write(self, connection: Any, timestamp: int, data: bytes | memoryview) -> None:
        """Add a message, logged at `timestamp` [ns]."""
        channel, size = connection.id, _BEHIND_LENGTH + len(data)
        self._places[channel].append((timestamp, self._size))
        self._add(_MESSAGE.pack(Opcode.MESSAGE, size, channel, 0, timestamp, timestamp))
        self._add(bytes(data))
        if self._size >= _CHUNK:
            self._end_chunk()

    def flush(self) -> None:
        """Hand everything to the operating system: a killed program then loses none of it."""
        self._end_chunk()
        self._file.flush()

    def close(self, version: int, metadata: str) -> None:
        """Write what follows the messages; `metadata` is the content of ``metadata.yaml``."""
        self._end_chunk()
        entry = Metadata("rosbag2", {"serialized_metadata": metadata})
        begin = self._position
        self._append_record(entry)
        index = MetadataIndex(begin, self._position - begin, entry.name)
        self._append_record(DataEnd(0))  # the chunks have checksums
        self._write_summary(index)
        self._file.close()

    def abort(self) -> None:
        """Close the file as it is."""
        self._file.close()

    def _add(self, data: bytes) -> None:
        self._chunk.append(data)
        self._size += len(data)

    def _end_chunk(self) -> None:
        if not self._chunk:
            return
        content = b"".join(self._chunk)
        data = self._compress(content) if self._compress else content
        chunk = Chunk(
            compression="zstd" if self._compress else "",
            data=b"",
            message_start_time=min((min(p)[0] for p in self._places.values()), default=0),
            message_end_time=max((max(p)[0] for p in self._places.values()), default=0),
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        begin = self._position
        # The library would copy the data several times: they follow what it makes of none.
        head = _content(chunk)
        size = struct.pack("<Q", len(head) - 9 + len(data))
        self._append(head[:1] + size + head[9:-8] + struct.pack("<Q", len(data)))
        self._append(data)
        end = self._position
        offsets = {}
        for channel, places in self._places.items():
            offsets[channel] = self._position
            self._counts[channel] += len(places)
            self._append(_message_index(channel, places))
        self._chunks.append(
            ChunkIndex(
                chunk_start_offset=begin,
                chunk_length=end - begin,
                message_index_offsets=offsets,
                message_index_length=self._position - end,
                message_start_time=chunk.message_start_time,
                message_end_time=chunk.message_end_time,
                compression=chunk.compression,
                compressed_size=len(data),
                uncompressed_size=chunk.uncompressed_size,
            )
        )
        self._chunk.clear()
        self._size = 0
        self._places.clear()

    def _write_summary(self, metadata: MetadataIndex) -> None:
        start = self._position
        groups: list[tuple[Opcode, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*self._schemas.values()]),
            (Opcode.CHANNEL, [*self._channels]),
            (Opcode.CHUNK_INDEX, [*self._chunks]),
            (Opcode.METADATA_INDEX, [metadata]),
            (Opcode.STATISTICS, [self._statistics()]),
        ]
        summary, offsets = b"", b""
        for opcode, records in groups:
            group = b"".join(map(_content, records))
            offsets += _content(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        footer = Footer(start, start + len(summary), 0)
        footer.summary_crc = zlib.crc32(summary + offsets + _content(footer)[:-4])
        self._append(summary + offsets + _content(footer) + MCAP0_MAGIC)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_start_time=min((c.message_start_time for c in self._chunks), default=0),
            message_end_time=max((c.message_end_time for c in self._chunks), default=0),
            metadata_count=1,
            schema_count=len(self._schemas),
        )

    def _append_record(self, record: McapRecord) -> None:
        self._append(_content(record))

    def _append(self, data: bytes) -> None:
        self._file.write(data)
        self._position += len(data)


def _content(record: McapRecord) -> bytes:
    """Return a record's bytes."""
    builder = RecordBuilder()
    record.write(builder)
    content: bytes = builder.end()  # type: ignore[no-untyped-call]
    return content


def _message_index(channel: int, places: list[tuple[int, int]]) -> bytes:
    """Return where the messages of a channel lie in a chunk: a tenth of the library's time."""
    size = 16 * len(places)
    content = struct.pack(f"<{2 * len(places)}Q", *chain.from_iterable(places))
    return struct.pack("<BQHI", Opcode.MESSAGE_INDEX, 6 + size, channel, size) + content
