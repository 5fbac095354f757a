"""Opening a log, however it is stored: the messages of its files, one file after the other."""

from __future__ import annotations

import re
import shutil
import sqlite3
from collections import Counter
from collections.abc import Collection, Container, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO, cast

import numpy as np

from hma_gripper_sim.bags import db3_file, mcap_file, ros1_bag
from hma_gripper_sim.bags.db3_file import Db3File
from hma_gripper_sim.bags.decompression import InflatedFile, zstd_message
from hma_gripper_sim.bags.log_metadata import METADATA, counted_messages, is_blank
from hma_gripper_sim.bags.mcap_file import McapFile
from hma_gripper_sim.bags.message_batches import CDR, Batch, Connection, Findings, absolute
from hma_gripper_sim.bags.ros1_bag import BagFile
from hma_gripper_sim.errors import InputError, first_line
from hma_gripper_sim.units import choice
from hma_gripper_sim.yaml_reading import read_yaml

_ZSTD, _LFS_POINTER = b"(\xb5/\xfd", b"version https://"
"""What files begin with."""

_SUFFIXES = (".mcap", ".db3")
"""Of the files in a rosbag2 directory, which may be compressed."""


_NAMED = 3
"""Files that an error names beside the one that is missing."""


class _Everything(Container[str]):
    """Holds every topic there may be."""

    def __contains__(self, topic: object) -> bool:
        return True


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

    def batches(self, topics: Collection[str] | None = None) -> Iterator[Batch]:
        """Yield the messages of `topics`, by default of all, as they lie in file after file.

        Raises
        ------
        InputError
            The log cannot be read.
        """
        wanted = _Everything() if topics is None else frozenset(map(absolute, topics))
        files, by_message = self._files()
        counts: Counter[str] = Counter()
        empty = 0
        for file in files:
            with self._reporting(file):
                if len(files) > 1 and is_blank(file):
                    self.findings.lose(f"{file.name} is empty: the recording was not finished")
                    empty += 1
                    continue
                for batch in self._file_batches(file, wanted):
                    numbers = np.bincount(batch.which, minlength=len(batch.connections))
                    for connection, number in zip(batch.connections, numbers.tolist(), strict=True):
                        counts[connection.topic] += number
                    yield batch if by_message is False else _decompressed(batch, by_message)
        if empty == len(files):
            raise InputError("cannot be read: all of its files are empty", source=self.source)
        if not self.findings.losses:
            self._compare(counts, wanted)

    def _compare(self, counts: Mapping[str, int], topics: Container[str]) -> None:
        """Note where there are fewer messages than the metadata count."""
        for topic, counted in counted_messages(self._path).items():
            if topic in topics and counts.get(topic, 0) < counted:
                self.findings.lose(
                    f"{topic}: {METADATA} counts {counted} messages, and {counts.get(topic, 0)} "
                    "are there: the log is damaged"
                )

    def _files(self) -> tuple[list[Path], bool | None]:
        """Return the files in order, and whether their messages are compressed one by one.

        None: nobody says so; the messages show it.
        """
        if not self._path.is_dir():
            return [self._path], None
        present = [
            entry
            for entry in self._path.iterdir()
            if entry.name.removesuffix(".zstd").endswith(_SUFFIXES)
        ]
        present.sort(key=lambda entry: _natural(entry.name))
        metadata = self._path / METADATA
        if not metadata.exists() or is_blank(metadata):
            if not present:
                reason = f"has no {METADATA}, and no .mcap or .db3 file"
                raise InputError(f"not a rosbag2 directory: {reason}", source=self.source)
            missing = f"its {METADATA} is empty" if metadata.exists() else f"has no {METADATA}"
            self.findings.note(f"{missing}: the recording was not finished")
            return present, None
        names, mode = _metadata(metadata)
        listed = [self._path / name for name in names]
        for entry in present:
            if entry not in listed:
                self.findings.note(f"{entry.name} is not listed in {METADATA}: not read")
        return listed, mode == "message"

    def _file_batches(self, file: Path, topics: Container[str]) -> Iterator[Batch]:
        with ExitStack() as stack:
            if file.exists() and not file.is_file():
                raise InputError("it is no regular file")
            stream: BinaryIO = stack.enter_context(file.open("rb"))
            begin = _begin(stream)
            if begin.startswith(_ZSTD):
                size = file.stat().st_size
                begin = InflatedFile(stream, size).read(len(begin))
                stream.seek(0)
                stream = cast(BinaryIO, InflatedFile(stream, size))
                if begin.startswith(db3_file.MAGIC):  # is not read from front to back
                    file = _unpack(stream, file, stack)
            if not begin.strip(b"\0"):
                raise InputError("it is empty")
            if begin.startswith(mcap_file.MAGIC[: len(begin)]):
                yield from McapFile(file.name, stream, self.findings, topics).batches()
            elif begin.startswith(ros1_bag.MAGIC[: len(begin)]):
                yield from BagFile(file.name, stream, self.findings, topics).batches()
            elif begin.startswith(db3_file.MAGIC):
                settled = self._settled(file, stack)
                yield from Db3File(settled, file.name, self.findings, topics).batches()
            elif begin.startswith(_LFS_POINTER):
                raise InputError("it is a Git LFS pointer, not the log: 'git lfs pull' gets that")
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
            reason = (error.strerror or str(error)) + _beside(file)
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


def _begin(stream: BinaryIO) -> bytes:
    """Return what a file begins with; it is then at its beginning again."""
    begin = stream.read(16)
    stream.seek(0)
    return begin


def _beside(file: Path) -> str:
    """Return which logs lie where one is missing, in words."""
    if file.exists() or not file.parent.is_dir():
        return ""
    beside = (entry for entry in sorted(file.parent.iterdir()) if entry.suffix == file.suffix)
    names = [entry.name for entry in beside if entry.is_file()]
    if not names or not file.suffix:
        return ""
    return f"; beside it there is {' and '.join(names[:_NAMED])}: has it been renamed?"


def _unpack(stream: BinaryIO, file: Path, stack: ExitStack) -> Path:
    """Write content to a file that is removed with the stack; return its path."""
    path = Path(stack.enter_context(TemporaryDirectory()), file.name.removesuffix(".zstd"))
    with path.open("wb") as out:
        shutil.copyfileobj(stream, out)
    return path


def _decompressed(batch: Batch, by_message: bool | None) -> Batch:
    """Decompress messages that are compressed one by one, or those that show that they are."""
    if by_message is None and not (batch.data[batch.starts[batch.sizes > 0]] == _ZSTD[0]).any():
        return batch
    return Batch.of(
        [
            (
                sender,
                logged,
                zstd_message(data) if by_message or _is_compressed(sender, data) else data,
            )
            for sender, logged, data in batch
        ]
    )


def _is_compressed(sender: Connection, data: bytes) -> bool:
    """Return whether a message can only be a compressed one: CDR begins with a zero."""
    return sender.encoding == CDR and data.startswith(_ZSTD)


def _natural(name: str) -> list[int | str]:
    """Return a key that sorts log_2 before log_10."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]
