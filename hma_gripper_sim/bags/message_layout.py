"""Where in the bytes of a message its numbers lie.

ROS 2 messages are serialised as XCDR1 (OMG formal/02-06-51): numbers lie at multiples of their
size, texts and sequences begin with their length. ROS 1 does the same without alignment. So
messages of one type in which all of those lengths are equal have every number at the same place.
"""

from __future__ import annotations

import re
import struct
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Nodetype

HEADER = "std_msgs/msg/Header"

_PLACEHOLDER = "structure_needs_at_least_one_member"
"""Of a type without fields in ROS 2; in ROS 1 it has none."""

_ENCAPSULATION = 4
"""Bytes in front of a message that say how it is serialised; alignment counts from behind them."""

_BIG_ENDIAN, _LITTLE_ENDIAN = b"\x00\x00", b"\x00\x01"

_PADDING, _PADDING_PER_EMPTY = 3, 8
"""How many bytes may follow a message: ROS 2 reserves room for aligning what is not there."""

_KINDS = {
    "bool": "u1",
    "byte": "i1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
"""numpy's names of ROS' numbers."""

MOST_ENTRIES = 100_000
"""Numbers, texts and structures of one message: with more of them it is not worth reading.

An array of numbers is one.
"""

_STEP = re.compile(r"([^.\[\]]+)|\[(\d+)\]")


class Numbers(NamedTuple):
    """Place of a number, or of an array of them.

    `offset` [bytes] is from the beginning of the message; `kind` is numpy's; `length` is None for a
    single number.
    """

    offset: int
    kind: str
    length: int | None


class Layout:
    """What lies where in one message, and in all others that agree in its `fixed` bytes.

    Parameters
    ----------
    data
        The message, serialised.
    msgtype
        Its type.
    typestore
        Of `rosbags`; knows the type.
    is_ros1
        Whether it is serialised as in ROS 1.

    Attributes
    ----------
    numbers
        By dotted path, such as ``transforms[0].transform.translation.z``; an array is one entry.
    texts
        By dotted path; arrays of texts as lists.
    order
        Of the bytes of a number, as numpy writes it.
    end
        Bytes that the message has; a few more may follow.
    fixed
        First byte, and the one behind the last, of what makes the layout: lengths and texts,
        shape (n, 2).

    Raises
    ------
    ValueError
        The bytes are not such a message.
    """

    def __init__(self, data: bytes, msgtype: str, typestore: Any, *, is_ros1: bool = False) -> None:
        if not is_ros1 and data[:2] not in (_BIG_ENDIAN, _LITTLE_ENDIAN):
            raise ValueError(f"serialised in an unknown way ({data[:2].hex(' ') or 'no bytes'})")
        self.msgtype = msgtype
        self.numbers: dict[str, Numbers] = {}
        self.texts: dict[str, str | list[str]] = {}
        self._data = data
        self.order = "<" if is_ros1 or data[:2] == _LITTLE_ENDIAN else ">"
        self._typestore = typestore
        self._is_ros1 = is_ros1
        self._position = 0 if is_ros1 else _ENCAPSULATION
        self._fixed = [[0, self._position]]
        self._empty = 0
        self._entries = 0
        self._struct(msgtype, "")
        self.end = self._position
        behind = len(data) - self.end
        if behind > (0 if is_ros1 else _PADDING + _PADDING_PER_EMPTY * self._empty):
            raise ValueError(f"{behind} bytes behind its end")
        self.fixed: npt.NDArray[np.int64] = np.array(self._fixed, dtype=np.int64)

    def declares(self, path: str) -> bool:
        """Return whether the type has a number at a dotted path, be it in this message or not."""
        node, description = Nodetype.NAME, self.msgtype
        for name in (step[0] for step in _STEP.findall(path) if step[0]):
            if node != Nodetype.NAME:
                return False
            fields = dict(self._typestore.fielddefs[description][1])
            if name not in fields:
                return False
            node, description = fields[name]
            if node not in (Nodetype.BASE, Nodetype.NAME):
                node, description = description[0]
        return node == Nodetype.BASE and description[0] in _KINDS

    def _struct(self, msgtype: str, path: str) -> None:
        self._entries += 1
        if self._entries > MOST_ENTRIES:
            raise ValueError(f"has more than {MOST_ENTRIES} entries")
        if self._is_ros1 and msgtype == HEADER:
            self._skip(4)  # a counter, which ROS 2 does not know
        for name, (node, description) in self._typestore.get_msgdef(msgtype).fields:
            if self._is_ros1 and name == _PLACEHOLDER:
                continue
            inner = f"{path}.{name}" if path else name
            if node in (Nodetype.BASE, Nodetype.NAME):
                self._single(node, description, inner)
                continue
            (element, subtype), count = description
            if node == Nodetype.SEQUENCE:
                count = self._length()
                self._empty += not count
            self._array(element, subtype, count, inner)

    def _single(self, node: int, description: Any, path: str) -> None:
        if node == Nodetype.NAME:
            self._struct(description, path)
        elif description[0] == "string":
            self.texts[path] = self._string()
        else:
            self._number(_KINDS[description[0]], None, path)

    def _array(self, node: int, description: Any, count: int, path: str) -> None:
        if node == Nodetype.NAME:
            for index in range(count):
                self._struct(description, f"{path}[{index}]")
        elif description[0] == "string":
            self.texts[path] = [self._string() for _ in range(count)]
        else:
            self._number(_KINDS[description[0]], count, path)

    def _number(self, kind: str, count: int | None, path: str) -> None:
        size = int(kind[1])
        if count != 0:  # an empty array is not aligned
            self._align(size)
        self.numbers[path] = Numbers(self._position, self.order + kind, count)
        self._skip(size * (1 if count is None else count))

    def _string(self) -> str:
        size = self._length()
        start = self._position
        self._skip(size)
        self._fixed[-1][1] = self._position  # the length lies right in front
        return self._data[start : self._position].rstrip(b"\x00").decode()

    def _length(self) -> int:
        self._align(4)
        start = self._position
        self._skip(4)
        self._fixed.append([start, self._position])
        (length,) = struct.unpack_from(f"{self.order}I", self._data, start)
        if length > len(self._data):
            raise ValueError(f"{length} elements at byte {start}")
        return int(length)

    def _align(self, size: int) -> None:
        if not self._is_ros1:
            self._position += -(self._position - _ENCAPSULATION) % size

    def _skip(self, size: int) -> None:
        self._position += size
        if self._position > len(self._data):
            raise ValueError(f"ends after {len(self._data)} bytes")


def least_entries(typestore: Any, msgtype: str) -> int:
    """Return how many numbers, texts and structures any message of a type has at least.

    Told from the definitions alone: what `rosbags` makes of a type may take as long as reading it.
    It raises `RecursionError` of a type that holds itself.
    """
    known: dict[str, int] = {}

    def of(msgtype: str) -> int:
        if msgtype not in known:
            total = 1
            for _, (node, description) in typestore.fielddefs[msgtype][1]:
                count = 1
                if node == Nodetype.ARRAY:
                    (node, description), count = description
                is_number = node == Nodetype.BASE and description[0] != "string"
                each = of(description) if node == Nodetype.NAME else 1
                total += 1 if is_number else count * each
            known[msgtype] = total
        return known[msgtype]

    return of(msgtype)


def follow(message: Any, path: str) -> Any:
    """Return what lies at a dotted path of a message that `rosbags` has deserialised."""
    steps = [(name, index) for name, index in _STEP.findall(path)]
    return reduce(lambda at, s: getattr(at, s[0]) if s[0] else at[int(s[1])], steps, message)
