"""Which numbers of a message a signal is made of."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.bags.message_layout import Layout, Numbers
from hma_gripper_sim.errors import InputError

FloatArray = npt.NDArray[np.float64]

POSE_FIELDS = tuple(
    f"transform.{part}.{axis}"
    for part, axes in (("translation", "xyz"), ("rotation", "xyzw"))
    for axis in axes
)
"""The numbers of a transform."""

_JOINT_NAMES = ("name", "joint_names")
"""Fields that name the joints of the arrays beside them, in sensor_msgs and in control_msgs."""


_LAST_INDEX = re.compile(r"(.*)\[(\d{1,9})\]")
"""A path that ends with an index."""


class LackingError(InputError):
    """A message holds less than its type can: others of the type may hold the signal."""


class Place(NamedTuple):
    """Where the numbers of a signal lie in messages of one layout.

    Attributes
    ----------
    paths
        Dotted, one for each number.
    offsets
        [bytes], one for each number.
    kind
        numpy's, of all of them.
    stamp
        Dotted path of the time that belongs to them, if there is one.
    """

    paths: tuple[str, ...]
    offsets: tuple[int, ...]
    kind: str
    stamp: str | None


class Source(Protocol):
    """A rule that finds a signal in messages."""

    @property
    def subject(self) -> str:
        """What the messages are about, as errors name it."""

    def locate(self, layout: Layout) -> Place | None:
        """Find the signal; None if the message is about other joints or frames.

        Raises
        ------
        LackingError
            It is not in this message.
        InputError
            Messages of this type cannot hold it.
        """

    def value(self, numbers: FloatArray) -> FloatArray:
        """Return the signal, shape (n,), from its numbers in n messages, shape (n, k)."""


@dataclass(frozen=True)
class Frame:
    """A transform of a TFMessage: the pose of `child` in `parent`."""

    parent: str
    child: str

    def __str__(self) -> str:
        return f"{self.parent} → {self.child}"


@dataclass(frozen=True)
class Field:
    """A number in a message.

    Parameters
    ----------
    field
        Dotted path, such as ``wrench.force.z`` or ``data[0]``.
    joint
        The field is an array, and this names the joint whose entry is meant.
    frame
        The message holds transforms, and the field is one of this transform's.
    """

    field: str
    joint: str | None = None
    frame: Frame | None = None

    @property
    def subject(self) -> str:
        """The joint or frame."""
        if self.frame is not None:
            return f"frame {self.frame}"
        return f"joint {self.joint!r}" if self.joint else repr(self.field)

    def locate(self, layout: Layout) -> Place | None:
        """Find the number."""
        if self.frame is not None:
            index = _transform(layout, self.frame)
            if index is None:
                return None
            prefix = f"transforms[{index}]."
            return _place(layout, prefix + self.field, None, prefix + "header.stamp")
        if self.joint is None:
            return _place(layout, self.field, None, "header.stamp")
        names = _joint_names(layout)
        if self.joint not in names:
            return None
        return _joint_place(layout, self.field, names, names.index(self.joint))

    def value(self, numbers: FloatArray) -> FloatArray:
        """Return the number itself."""
        return numbers[:, 0]


@dataclass(frozen=True)
class Along:
    """The component of a vector along a direction: of the force of a tilted sensor, for example.

    Parameters
    ----------
    field
        Dotted path of the vector, which has ``x``, ``y`` and ``z``, such as ``wrench.force``.
    direction
        Unit vector.
    frame
        The message holds transforms, and the field is one of this transform's.
    """

    field: str
    direction: tuple[float, float, float]
    frame: Frame | None = None

    @property
    def subject(self) -> str:
        """The frame, or the vector."""
        return repr(self.field) if self.frame is None else f"frame {self.frame}"

    @property
    def paths(self) -> tuple[str, ...]:
        """Of the vector's components."""
        return tuple(f"{self.field}.{axis}" for axis in "xyz")

    def locate(self, layout: Layout) -> Place | None:
        """Find the components."""
        places = [Field(path, frame=self.frame).locate(layout) for path in self.paths]
        found = [place for place in places if place is not None]
        return _together(found) if found else None

    def value(self, numbers: FloatArray) -> FloatArray:
        """Return the component."""
        component: FloatArray = numbers @ np.array(self.direction)
        return component


@dataclass(frozen=True)
class Robot:
    """A pose that the joints of a robot make up; no message holds it (see `pose_chains`).

    Parameters
    ----------
    field
        Of the pose, as of a transform: ``transform.translation.z``.
    file
        The robot's description (URDF).
    parent, child
        Links of it: the pose of `child` in `parent`.
    """

    field: str
    file: str
    parent: str
    child: str

    @property
    def subject(self) -> str:
        """The links."""
        return f"link {self.child!r} in {self.parent!r}"

    def locate(self, layout: Layout) -> Place | None:
        """Return that no message holds it."""
        return None

    def value(self, numbers: FloatArray) -> FloatArray:
        """Return the number itself."""
        return numbers[:, 0]


@dataclass(frozen=True)
class LargestMagnitude:
    """The largest absolute entry of an array, of some joints or of all but one.

    Parameters
    ----------
    field
        Dotted path of the array.
    among
        The joints that count; none: all.
    without
        The joint that does not count, where all others do.

    Messages that do not name these joints are about other robots.
    """

    field: str
    among: tuple[str, ...] = ()
    without: str = ""

    @property
    def named(self) -> tuple[str, ...]:
        """The joints that tell the robot's messages from others."""
        return self.among or (self.without,)

    @property
    def subject(self) -> str:
        """The joints that are named."""
        return f"joint {', '.join(map(repr, self.named))}"

    def locate(self, layout: Layout) -> Place | None:
        """Find the entries."""
        names = _joint_names(layout)
        if not set(self.named) <= set(names):
            return None
        counted = self.among or {*names} - {self.without}
        kept = [index for index, name in enumerate(names) if name in counted]
        if not kept:
            raise LackingError(f"a message has no {self.field!r} of a joint but {self.without!r}")
        places = [_joint_place(layout, self.field, names, index) for index in kept]
        return _together(places)

    def value(self, numbers: FloatArray) -> FloatArray:
        """Return the largest magnitude."""
        largest: FloatArray = np.abs(numbers).max(axis=1)
        return largest


def joint_names(layout: Layout) -> Sequence[str]:
    """Return the names of the joints that a message is about; none if it is about none."""
    for path in _JOINT_NAMES:
        names = layout.texts.get(path)
        if isinstance(names, list):
            return names
    return ()


def transforms(layout: Layout) -> list[Frame]:
    """Return the transforms that a message holds."""
    frames: list[Frame] = []
    while (child := layout.texts.get(f"transforms[{len(frames)}].child_frame_id")) is not None:
        parent = layout.texts[f"transforms[{len(frames)}].header.frame_id"]
        frames.append(Frame(_bare(str(parent)), _bare(str(child))))
    return frames


def _joint_names(layout: Layout) -> Sequence[str]:
    if not any(path in layout.texts for path in _JOINT_NAMES):
        raise InputError(f"{layout.msgtype} names no joints")
    return joint_names(layout)


def _transform(layout: Layout, frame: Frame) -> int | None:
    wanted = Frame(_bare(frame.parent), _bare(frame.child))
    frames = transforms(layout)
    return frames.index(wanted) if wanted in frames else None


def _bare(frame: str) -> str:
    """Return a frame's name without the slash that ROS 1 put in front."""
    return frame.removeprefix("/")


def _together(places: Sequence[Place]) -> Place:
    """Return the places of several numbers of one message as one."""
    return places[0]._replace(
        paths=tuple(place.paths[0] for place in places),
        offsets=tuple(place.offsets[0] for place in places),
    )


def _joint_place(layout: Layout, field: str, names: Sequence[str], index: int) -> Place:
    """Find the number of the joint that is named at `index`."""
    place = _place(layout, field, index, "header.stamp")
    if layout.numbers[field].length != len(names):
        length = layout.numbers[field].length
        raise LackingError(f"a message has {length} entries of {field!r} for {len(names)} joints")
    if names.count(names[index]) > 1:
        raise LackingError(f"a message names joint {names[index]!r} more than once")
    return place


def _place(layout: Layout, field: str, index: int | None, stamp: str) -> Place:
    """Find one number; `index` counts in the array `field` and stands for a joint."""
    path = field
    if index is None and (match := _LAST_INDEX.fullmatch(field)):
        path, index = match[1], int(match[2])
    numbers = layout.numbers.get(path)
    if numbers is None and layout.declares(path):
        raise LackingError(f"a message has no {field!r}: its lists are shorter")
    if numbers is None or (numbers.length is None) != (index is None):
        raise InputError(f"a message has no number {field!r} ({layout.msgtype}: {_known(layout)})")
    if index is not None:
        if index >= (numbers.length or 0):
            raise LackingError(
                f"a message has {numbers.length} entries of {path!r}, not {index + 1}"
            )
        path = f"{path}[{index}]"
    offset = numbers.offset + (index or 0) * int(numbers.kind[-1])
    has_stamp = f"{stamp}.sec" in layout.numbers
    return Place((path,), (offset,), numbers.kind, stamp if has_stamp else None)


def _known(layout: Layout) -> str:
    """Return the paths of a message's numbers as text."""

    def shown(path: str, numbers: Numbers) -> str:
        return path if numbers.length is None else f"{path}[...]"

    paths = [shown(path, numbers) for path, numbers in layout.numbers.items()]
    more = ", …" if len(paths) > 12 else ""
    return ", ".join(paths[:12]) + more if paths else "no numbers"
