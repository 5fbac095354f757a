"""Opening a log, however it is stored: the messages of its files, one file after the other."""

from __future__ import annotations

import re
import shutil
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO, cast

import zstandard
from rosbags.interfaces import MessageDefinitionFormat
from rosbags.rosbag2 import Reader

from hma_gripper_sim.bags import mcap_file, ros1_bag
from hma_gripper_sim.bags.mcap_file import McapFile
from hma_gripper_sim.bags.message_batches import CDR, Batch, Connection, Findings
from hma_gripper_sim.bags.ros1_bag import BagFile
from hma_gripper_sim.errors import InputError, first_line
from hma_gripper_sim.units import choice
from hma_gripper_sim.yaml_reading import read_yaml

METADATA = "metadata.yaml"

_SQLITE, _ZSTD = b"SQLite format 3\0", b"(\xb5/\xfd"
"""What files begin with."""

_SUFFIXES = (".mcap", ".db3")
"""Of the files in a rosbag2 directory, which may be compressed."""

_GROUP = 4 * 2**20
"""Bytes of messages that are put together, where a library hands them out one by one."""


class Log:
    """A log: an mcap, db3 or ROS 1 bag file, or a rosbag2 directory.

    Parameters
    ----------
    path
        Where it is.

    Attributes
    ----------
    source
        The path, as errors name it.
    findings
        Topics and notes; complete when `batches` has come to its end.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self.source = str(path)
        self.findings = Findings()

    def batches(self, topics: Collection[str]) -> Iterator[Batch]:
        """Yield the messages of `topics`, file after file in the order they were logged.

        Raises
        ------
        InputError
            The log cannot be read.
        """
        wanted = frozenset(topics)
        files, compression = self._files()
        for file in files:
            with self._reporting(file):
                for batch in self._file_batches(file, wanted):
                    yield _decompressed(batch) if compression == "message" else batch

    def _files(self) -> tuple[list[Path], str]:
        """Return the files in order, and how they are compressed: by message or not."""
        if not self._path.is_dir():
            return [self._path], "none"
        present = [
            entry
            for entry in self._path.iterdir()
            if entry.name.removesuffix(".zstd").endswith(_SUFFIXES)
        ]
        present.sort(key=lambda entry: _natural(entry.name))
        metadata = self._path / METADATA
        if not metadata.exists():
            if not present:
                reason = f"has no {METADATA}, and no .mcap or .db3 file"
                raise InputError(f"not a rosbag2 directory: {reason}", source=self.source)
            self.findings.note(f"has no {METADATA}: the recording was not finished")
            return present, "none"
        names, compression = _metadata(metadata)
        listed = [self._path / name for name in names]
        for entry in present:
            if entry not in listed:
                self.findings.note(f"{entry.name} is not listed in {METADATA}: not read")
        return listed, compression

    def _file_batches(self, file: Path, topics: Collection[str]) -> Iterator[Batch]:
        with ExitStack() as stack:
            stream: BinaryIO = stack.enter_context(file.open("rb"))
            begin = _begin(stream)
            if begin.startswith(_ZSTD):
                begin = _begin(_inflated(stream))
                stream.seek(0)
                stream = _inflated(stream)
                if begin.startswith(_SQLITE):  # is not read from front to back
                    file = _unpack(stream, file, stack)
            if not begin:
                raise InputError("it is empty")
            if begin.startswith(mcap_file.MAGIC[: len(begin)]):
                yield from McapFile(file.name, stream, self.findings, topics).batches()
            elif begin.startswith(ros1_bag.MAGIC[: len(begin)]):
                yield from BagFile(file.name, stream, self.findings, topics).batches()
            elif begin.startswith(_SQLITE):
                file = self._settled(file, stack)
                yield from self._read_db3(stack.enter_context(Reader(file)), file.name, topics)
            else:
                raise InputError("it is neither an mcap, nor a db3, nor a ROS 1 bag file")

    def _settled(self, file: Path, stack: ExitStack) -> Path:
        """Return a database that needs no journal: `file`, or a copy where one is left of it."""
        journals = [file.with_name(file.name + suffix) for suffix in ("-wal", "-journal")]
        left = [journal for journal in journals if journal.exists() and journal.stat().st_size]
        if not left:
            return file
        folder = Path(stack.enter_context(TemporaryDirectory()))
        for entry in (file, *left):
            shutil.copy(entry, folder)
        copy = folder / file.name
        with closing(sqlite3.connect(copy)) as database:
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        names = " and ".join(journal.name for journal in left)
        self.findings.note(f"{file.name} was not closed: read with its {names}")
        return copy

    def _read_db3(self, reader: Any, name: str, topics: Collection[str]) -> Iterator[Batch]:
        connections: dict[int, Connection] = {}
        wanted = []
        for theirs in reader.connections:
            ours = _connection(name, theirs)
            self.findings.add(ours)
            if theirs.topic in topics:
                connections[theirs.id] = ours
                wanted.append(theirs)
        if not wanted:
            return
        group: list[tuple[Connection, int, bytes]] = []
        size = 0
        for theirs, logged, data in reader.messages(connections=wanted):
            group.append((connections[theirs.id], logged, bytes(data)))
            size += len(data)
            if size > _GROUP:
                yield Batch.of(group)
                group, size = [], 0
        if group:
            yield Batch.of(group)

    @contextmanager
    def _reporting(self, file: Path) -> Iterator[None]:
        """Turn whatever a damaged file makes the parsers raise into one kind of error."""
        source = str(file)
        try:
            yield
        except InputError as error:
            raise InputError(
                f"cannot be read: {error.reason}", field=error.field, source=source
            ) from None
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"cannot be read: {reason}", source=source) from None
        except Exception as error:
            raise InputError(f"cannot be read: {first_line(error)}", source=source) from None


def _metadata(path: Path) -> tuple[list[str], str]:
    """Return the names of a rosbag2 directory's files, and how they are compressed."""
    source = str(path)
    content = read_yaml(path).get("rosbag2_bagfile_information")
    if not isinstance(content, dict):
        raise InputError("is missing", field="rosbag2_bagfile_information", source=source)
    names = content.get("relative_file_paths")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names) or not names:
        raise InputError(
            f"expected a list of names, got {names!r}", field="relative_file_paths", source=source
        )
    mode = str(content.get("compression_mode") or "none").lower()
    options = ("none", "file", "message", "storage")
    choice(mode, options, field="compression_mode", source=source)
    if mode in ("file", "message"):
        choice(
            content.get("compression_format"), ("zstd",), field="compression_format", source=source
        )
    return [Path(name).name for name in names], mode


def _connection(file: str, theirs: Any) -> Connection:
    """Take over a connection from `rosbags`."""
    has_definition = theirs.msgdef.format != MessageDefinitionFormat.NONE
    return Connection(
        file=file,
        topic=theirs.topic,
        msgtype=theirs.msgtype,
        publisher=str(theirs.id),
        publishers=max(1, len(theirs.ext.offered_qos_profiles)),
        encoding=theirs.ext.serialization_format or CDR,
        definition=theirs.msgdef.data if has_definition else "",
        is_idl=theirs.msgdef.format == MessageDefinitionFormat.IDL,
    )


def _begin(stream: BinaryIO) -> bytes:
    """Return what a file begins with; a file itself is then at its beginning again."""
    begin = stream.read(16)
    if stream.seekable():
        stream.seek(0)
    return begin


def _inflated(stream: BinaryIO) -> BinaryIO:
    """Return the content of a compressed file."""
    reader = zstandard.ZstdDecompressor().stream_reader(
        stream, read_across_frames=True, closefd=False
    )
    return cast(BinaryIO, reader)


def _unpack(stream: BinaryIO, file: Path, stack: ExitStack) -> Path:
    """Write content to a file that is removed with the stack; return its path."""
    path = Path(stack.enter_context(TemporaryDirectory()), file.name.removesuffix(".zstd"))
    with path.open("wb") as out:
        shutil.copyfileobj(stream, out)
    return path


def _decompressed(batch: Batch) -> Batch:
    """Decompress messages that are compressed one by one."""
    decompress = zstandard.ZstdDecompressor().decompress
    return Batch.of([(sender, logged, decompress(data)) for sender, logged, data in batch])


def _natural(name: str) -> list[int | str]:
    """Return a key that sorts log_2 before log_10."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]
