"""Messages of a log before anyone has looked into them: bytes, many at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.serde import SerdeError
from rosbags.typesys import (
    Stores,
    get_types_from_idl,
    get_types_from_msg,
    get_typestore,
)

from hma_gripper_sim.bags.message_layout import HEADER, Layout, least_entries
from hma_gripper_sim.errors import InputError, printable
from hma_gripper_sim.yaml_reading import load_yaml

Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]

CDR, ROS1 = "cdr", "ros1"
"""How messages are serialised, in mcap's words."""

LARGEST = 2**28
"""Bytes that a record, a message or a chunk has at most, packed or unpacked: more is damaged."""

_LONGEST_DEFINITION, _MOST_LINES = 2**18, 4000
"""Characters, and lines that say something, of a type's definition with all that is in it."""

_CHECKED_AT_ONCE = 2**14
"""Characters of a definition that is read whether anything is wanted of its topic or not."""

_MOST_DECLARED = 2000
"""Entries of a type (see `least_entries`): `rosbags` takes a second for so many, and it grows."""

_IDL_SEPARATOR = "=" * 80 + "\n"


@dataclass(frozen=True, eq=False)
class Connection:
    """What one publisher, or all whom the recorder did not tell apart, sent on a topic.

    Parameters
    ----------
    file
        Name of the log's file.
    topic
        Name of the topic.
    msgtype
        Type of its messages.
    publisher
        What tells it from others on the same topic: mcap's channel, or the caller in ROS 1.
    publishers
        How many publishers the recorder put together here, as far as known.
    encoding
        ``cdr``, ``ros1``, or something that is not read.
    definition
        Text that defines the type; empty if the log has none.
    is_idl
        Whether that is IDL, not the msg format.
    """

    file: str
    topic: str
    msgtype: str
    publisher: str
    publishers: int = 1
    encoding: str = CDR
    definition: str = ""
    is_idl: bool = False

    @property
    def typestore(self) -> Any:
        """A typestore of `rosbags` that knows the type.

        Raises
        ------
        InputError
            Messages of this type cannot be read.
        """
        if self.encoding not in (CDR, ROS1):
            reason = f"its encoding {self.encoding!r} is not ROS"
        elif not self.definition:
            if self.msgtype in _jazzy().fielddefs:
                return _jazzy()
            reason = "the log does not define it"
        else:
            try:
                return _typestore(self.msgtype, self.definition, self.is_idl, self.encoding == ROS1)
            except InputError as error:
                reason = error.reason
            except Exception:  # the parsers raise many types
                reason = "its definition cannot be read"
        raise InputError(f"unknown type {self.msgtype!r}: {reason}", field=self.topic)

    def layout(self, data: bytes) -> Layout:
        """Return what lies where in a message; raise `ValueError` if it is none."""
        return Layout(data, self.msgtype, self.typestore, is_ros1=self.encoding == ROS1)

    def deserialise(self, data: bytes) -> Any:
        """Return a message as `rosbags` reads it; it raises many types where that is not one."""
        store = self.typestore
        end = self.layout(data).end  # which is bounded, as what rosbags does is not
        if self.encoding == ROS1:
            return store.deserialize_cdr(store.ros1_to_cdr(data, self.msgtype), self.msgtype)
        try:
            return store.deserialize_cdr(data, self.msgtype)
        except SerdeError:  # more may follow a message than rosbags puts up with
            return store.deserialize_cdr(data[:end], self.msgtype)


@cache
def _jazzy() -> Any:
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache(maxsize=256)
def _typestore(msgtype: str, definition: str, is_idl: bool, is_ros1: bool) -> Any:
    """Return a typestore that knows what a definition defines."""
    lines = sum(1 for line in definition.splitlines() if line.partition("#")[0].strip())
    if len(definition) > _LONGEST_DEFINITION or lines > _MOST_LINES:
        limits = f"{_LONGEST_DEFINITION} characters or {_MOST_LINES} lines"
        raise InputError(f"its definition has more than {limits}")
    types: dict[str, Any] = {}
    if is_idl:
        for text in _idl_texts(definition):
            types.update(get_types_from_idl(text))
    else:
        types.update(get_types_from_msg(definition, msgtype))
    if is_ros1 and HEADER in types:
        constants, fields = types[HEADER]
        # rosbags drops the counter on the way to ROS 2, which has none
        types[HEADER] = constants, [entry for entry in fields if entry[0] != "seq"]
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    if least_entries(store, msgtype) > _MOST_DECLARED:
        raise InputError(f"its definition has more than {_MOST_DECLARED} entries")
    return store


def _idl_texts(definition: str) -> list[str]:
    if not definition.startswith(f"{_IDL_SEPARATOR}IDL: "):
        return [definition]
    return [text.partition("\n")[2] for text in definition.split(_IDL_SEPARATOR)[1:]]


@dataclass(frozen=True, eq=False)
class Batch:
    """Messages in the order they were logged; message i is ``data[starts[i]:][:sizes[i]]``.

    Parameters
    ----------
    data
        Bytes that hold all messages, among others.
    connections
        Who sent them.
    which
        Index of each message's connection, shape (n,).
    logged
        When each was logged [ns], shape (n,).
    starts, sizes
        Where each begins in `data`, and its length, shape (n,).
    """

    data: Bytes
    connections: tuple[Connection, ...]
    which: Ints
    logged: Ints
    starts: Ints
    sizes: Ints

    @classmethod
    def of(cls, messages: list[tuple[Connection, int, bytes]]) -> Batch:
        """Put messages together: who sent each, when it was logged [ns], and its bytes."""
        connections = tuple(dict.fromkeys(connection for connection, _, _ in messages))
        index = {connection: i for i, connection in enumerate(connections)}
        sizes = np.array([len(data) for _, _, data in messages], dtype=np.int64)
        return cls(
            np.frombuffer(b"".join(data for _, _, data in messages), dtype=np.uint8),
            connections,
            np.array([index[connection] for connection, _, _ in messages], dtype=np.int64),
            np.array([logged for _, logged, _ in messages], dtype=np.int64),
            np.cumsum(sizes) - sizes,
            sizes,
        )

    def __iter__(self) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield who sent each message, when it was logged [ns], and its bytes."""
        content = self.data.tobytes()
        columns = (self.which.tolist(), self.logged.tolist())
        places = (self.starts.tolist(), self.sizes.tolist())
        for which, logged, start, size in zip(*columns, *places, strict=True):
            yield self.connections[which], logged, content[start : start + size]

    def split(self) -> Iterator[tuple[Connection, Batch]]:
        """Yield the messages of each connection."""
        for index, connection in enumerate(self.connections):
            mine = np.flatnonzero(self.which == index)
            if mine.size:
                yield (
                    connection,
                    Batch(
                        self.data,
                        (connection,),
                        np.zeros_like(mine),
                        self.logged[mine],
                        self.starts[mine],
                        self.sizes[mine],
                    ),
                )


@dataclass
class Findings:
    """What has been found out about a log while it is read.

    Parameters
    ----------
    topics
        All that have been seen.
    losses
        What of the log is missing, one line each.
    notes
        What else was skipped or recovered, one line each.
    """

    topics: set[str] = field(default_factory=set)
    losses: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, connection: Connection) -> None:
        """Take up a connection; note it if its messages cannot be read."""
        self.topics.add(connection.topic)
        if len(connection.definition) > _CHECKED_AT_ONCE:
            return  # that it cannot be read is said where it is wanted
        try:
            _ = connection.typestore
        except InputError as error:
            self.note(f"{connection.topic}: skipped, {error.reason}")

    def note(self, text: str) -> None:
        """Take up a note, once."""
        text = printable(text)
        if text not in self.notes:
            self.notes.append(text)

    def lose(self, text: str) -> None:
        """Take up a loss."""
        self.losses.append(printable(text))


def absolute(topic: str) -> str:
    """Return the name of a topic as ROS has it, with a slash in front: not every recorder does."""
    return "/" + "/".join(part for part in topic.split("/") if part)


def full_type(msgtype: str) -> str:
    """Return the name of a type as ROS 2 has it: ROS 1 and its first versions lack the ``msg``."""
    package, slash, name = msgtype.partition("/")
    return msgtype if not slash or "/" in name else f"{package}/msg/{name}"


def count_profiles(qos: str) -> int:
    """Return how many publishers' quality of service rosbag2 noted for a topic; at least 1."""
    try:
        profiles: Any = load_yaml(qos)
    except InputError:
        return 1
    return max(1, len(profiles)) if isinstance(profiles, list) else 1


def shown(stamp: int | np.int64) -> str:
    """Return a stamp [ns] as text."""
    return f"{int(stamp) // 10**9}.{int(stamp) % 10**9 // 1000:06d} s"
