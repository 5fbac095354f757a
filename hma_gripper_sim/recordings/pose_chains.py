"""Poses that no message holds: put together from a chain of transforms, or of a robot's joints."""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from hma_gripper_sim.bags.message_batches import Ints
from hma_gripper_sim.errors import InputError, first_line
from hma_gripper_sim.recordings.gathering import Samples
from hma_gripper_sim.recordings.signal_map import Signal
from hma_gripper_sim.recordings.signal_sources import (
    POSE_FIELDS,
    Along,
    Field,
    FloatArray,
    Frame,
    Robot,
)

Part = tuple[Any, Samples | InputError]
Gather = Callable[[Sequence[Signal]], Mapping[Signal, Sequence[Part]]]
"""Reads a log and returns by signal what each connection on its topic says of it."""

_STATIC = "_static"
"""Is appended to a topic of transforms: the one of those that do not move."""


@dataclass(frozen=True)
class Poses:
    """Poses over time: rotations, and translations [m], shape (n, 3)."""

    rotation: Rotation
    translation: FloatArray

    def then(self, other: Poses) -> Poses:
        """Return the poses of a child, given these of its parent and the child's in the parent."""
        return Poses(
            self.rotation * other.rotation,
            self.translation + self.rotation.apply(other.translation),
        )

    def inverse(self) -> Poses:
        """Return the poses of the parent in the child."""
        inverse = self.rotation.inv()
        return Poses(inverse, -inverse.apply(self.translation))

    def numbers(self, path: str) -> FloatArray:
        """Return what lies at a path such as ``transform.translation.z``, shape (n,)."""
        _, part, axis = path.split(".")
        if part == "translation":
            return self.translation[:, "xyz".index(axis)]
        quaternion: FloatArray = self.rotation.as_quat()[:, "xyzw".index(axis)]
        return quaternion


@dataclass(frozen=True)
class _Course:
    """Numbers over time: stamps and times of logging [ns], shape (n,); values of shape (n, k)."""

    stamps: Ints
    logged: Ints
    values: FloatArray


def pose_along_frames(signal: Signal, gather: Gather) -> tuple[list[Part], str] | None:
    """Return a signal of a pose that several transforms make up, and which these are, in words.

    Transforms that move are interpolated at the stamps of the one with most of them.

    Returns
    -------
    As `Gather` returns it for the signal; None if no chain leads from parent to child.
    """
    frame = getattr(signal.source, "frame", None)
    if frame is None:
        return None
    topics = (signal.topic, signal.topic + _STATIC)
    nobody = Field(POSE_FIELDS[0], frame=Frame("", ""))
    known: dict[Frame, str] = {}
    for entry, told in gather([_channel(signal, topic, nobody) for topic in topics]).items():
        for _, samples in told:
            if isinstance(samples, Samples):
                known.update(dict.fromkeys(samples.frames, entry.topic))
    links = _path([(f.parent, f.child, f) for f in known], frame.parent, frame.child)
    if links is None:
        return None
    wanted = [
        [_channel(signal, known[link], Field(path, frame=link)) for path in POSE_FIELDS]
        for link, _ in links
    ]
    parts = gather([*chain.from_iterable(wanted)])
    courses = [_course([parts[entry] for entry in of_link]) for of_link in wanted]
    moving = [c for c, (link, _) in zip(courses, links, strict=True) if known[link] == topics[0]]
    base = _base(moving or courses)
    poses = None
    for course, (link, is_down) in zip(courses, links, strict=True):
        still = known[link] != topics[0]
        one = _still(course, len(base.stamps)) if still else _moving(course, base.stamps)
        one = one if is_down else one.inverse()
        poses = one if poses is None else poses.then(one)
    said = " and ".join(str(link) for link, _ in links)
    return [(parts[wanted[0][0]][0][0], _samples(signal, base, poses))], said


def pose_along_joints(signal: Signal, gather: Gather) -> list[Part]:
    """Return a signal of a pose that the positions of a robot's joints make up.

    Raises
    ------
    InputError
        The robot's description cannot be read, has no such links, or a joint that is not told.
    """
    source = signal.source
    if not isinstance(source, Robot):
        raise TypeError(f"{source!r} is no robot")
    joints = _described_joints(source)
    links = _path([(j.parent, j.child, j) for j in joints], source.parent, source.child)
    if links is None:
        reason = f"no chain of joints from {source.parent!r} to {source.child!r}"
        raise InputError(reason, source=source.file)
    by_name = {joint.name: joint for joint in joints}
    moved = {}
    for joint, _ in links:
        if joint.type not in ("fixed", "revolute", "continuous", "prismatic"):
            reason = f"joint {joint.name!r} is {joint.type}, which is not followed"
            raise InputError(reason, source=source.file)
        if joint.type != "fixed":
            moved[joint.name] = joint.mimic.joint if joint.mimic else joint.name
    names = [*dict.fromkeys(moved.values())]
    for name in names:
        if name not in by_name:
            raise InputError(f"no joint {name!r}, which another mimics", source=source.file)
    if not names:
        raise InputError("no joint between these links moves", source=source.file)
    wanted = [_channel(signal, signal.topic, Field("position", joint=name)) for name in names]
    parts = gather(wanted)
    courses = {name: _course([parts[w]]) for name, w in zip(names, wanted, strict=True)}
    base = _base([*courses.values()])
    poses = None
    for joint, is_down in links:
        position = np.zeros(len(base.stamps))
        if joint.name in moved:
            position = _interpolated(courses[moved[joint.name]], base.stamps)[:, 0]
            if joint.mimic:
                position = joint.mimic.multiplier * position + joint.mimic.offset
        one = _of_joint(joint, position)
        one = one if is_down else one.inverse()
        poses = one if poses is None else poses.then(one)
    return [(parts[wanted[0]][0][0], _samples(signal, base, poses))]


def _channel(signal: Signal, topic: str, source: Field) -> Signal:
    """Return what is read as it is, at the same clock and of the same publisher."""
    return Signal(signal.name, topic, source, clock=signal.clock, publisher=signal.publisher)


def _path(links: Sequence[tuple[str, str, Any]], start: str, end: str) -> list[Any] | None:
    """Return what leads from a frame to another: links, and whether each is followed downwards."""
    start, end = start.removeprefix("/"), end.removeprefix("/")
    beside: dict[str, list[tuple[str, Any, bool]]] = {}
    for parent, child, link in links:
        beside.setdefault(parent, []).append((child, link, True))
        beside.setdefault(child, []).append((parent, link, False))
    came: dict[str, tuple[str, Any, bool] | None] = {start: None}
    waiting = deque([start])
    while waiting and end not in came:
        here = waiting.popleft()
        for there, link, is_down in beside.get(here, ()):
            if there not in came:
                came[there] = here, link, is_down
                waiting.append(there)
    if end not in came:
        return None
    path = []
    step = came[end]
    while step is not None:
        here, link, is_down = step
        path.append((link, is_down))
        step = came[here]
    return path[::-1]


def _course(channels: Sequence[Sequence[Part]]) -> _Course:
    """Put the numbers that come with the same messages together, in the order of their stamps."""
    stamps, logged, values = [], [], []
    for parts in channels:
        told = [samples for _, samples in parts if isinstance(samples, Samples) and samples.values]
        if not told:
            lacks = [s.lack for _, s in parts if isinstance(s, Samples) and s.lack]
            raise InputError(lacks[0] if lacks else "a part of the chain is told by no message")
        stamps.append(np.concatenate([np.frombuffer(s.stamps, np.int64) for s in told]))
        logged.append(np.concatenate([part for s in told for part in s.logged]))
        values.append(np.concatenate([np.frombuffer(s.values, np.float64) for s in told]))
    table = np.column_stack(values)
    _, kept = np.unique(stamps[0], return_index=True)
    kept = kept[np.isfinite(table[kept]).all(axis=1)]
    if not kept.size:
        raise InputError("a part of the chain is nowhere finite")
    return _Course(stamps[0][kept], logged[0][kept], table[kept])


def _base(courses: Sequence[_Course]) -> _Course:
    """Return the times of the course with most samples at which all others are known as well."""
    finest = max(courses, key=lambda course: len(course.stamps))
    first = max(int(course.stamps[0]) for course in courses)
    last = min(int(course.stamps[-1]) for course in courses)
    kept = (finest.stamps >= first) & (finest.stamps <= last)
    if not kept.any():
        raise InputError("the parts of the chain were never told at the same time")
    return _Course(finest.stamps[kept], finest.logged[kept], finest.values[kept])


def _still(course: _Course, count: int) -> Poses:
    """Return poses of a transform that does not move: what was told last."""
    return _of_numbers(np.repeat(course.values[-1:], count, axis=0))


def _moving(course: _Course, stamps: Ints) -> Poses:
    """Return poses of a transform at stamps [ns]."""
    known = _of_numbers(course.values)
    begin = int(course.stamps[0])
    at, asked = (course.stamps - begin) * 1e-9, (stamps - begin) * 1e-9
    translation = np.column_stack([np.interp(asked, at, c) for c in known.translation.T])
    if len(at) == 1:
        return _still(course, len(stamps))
    return Poses(Slerp(at, known.rotation)(np.clip(asked, at[0], at[-1])), translation)


def _of_numbers(numbers: FloatArray) -> Poses:
    """Return poses of translations and quaternions, shape (n, 7)."""
    if (np.linalg.norm(numbers[:, 3:], axis=1) < 1e-6).any():
        raise InputError("a transform has no rotation: its quaternion is 0")
    return Poses(Rotation.from_quat(numbers[:, 3:]), numbers[:, :3])


def _interpolated(course: _Course, stamps: Ints) -> FloatArray:
    begin = int(course.stamps[0])
    at, asked = (course.stamps - begin) * 1e-9, (stamps - begin) * 1e-9
    return np.column_stack([np.interp(asked, at, column) for column in course.values.T])


def _of_joint(joint: Any, position: FloatArray) -> Poses:
    """Return poses of a joint's child in its parent."""
    count = len(position)
    origin = np.eye(4) if joint.origin is None else np.asarray(joint.origin)
    axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else np.asarray(joint.axis, dtype=float)
    placed = Poses(
        Rotation.from_matrix(np.repeat(origin[None, :3, :3], count, axis=0)),
        np.repeat(origin[None, :3, 3], count, axis=0),
    )
    along = np.outer(position, axis / (np.linalg.norm(axis) or 1.0))
    none = np.zeros_like(along)
    slides = joint.type == "prismatic"
    moved = Poses(Rotation.from_rotvec(none if slides else along), along if slides else none)
    return placed.then(moved)


def _described_joints(source: Robot) -> list[Any]:
    """Return the joints of a robot's description."""
    try:
        from yourdfpy import URDF
    except ImportError:
        reason = "needs yourdfpy: pip install 'hma_gripper_sim[urdf]'"
        raise InputError(reason, field="urdf") from None
    if not Path(source.file).is_file():
        raise InputError("cannot be read: no such file", source=source.file)
    try:
        described = URDF.load(source.file, load_meshes=False, build_scene_graph=False)
        return [*described.robot.joints]
    except Exception as error:  # its parser raises many types
        reason = f"cannot be read as URDF: {first_line(error)}"
        raise InputError(reason, source=source.file) from None


def _samples(signal: Signal, base: _Course, poses: Poses | None) -> Samples:
    """Return a number of poses as if a message had held it."""
    if poses is None:
        raise InputError("parent and child are the same frame", field="frame")
    source = signal.source
    if isinstance(source, Along):
        values = source.value(np.column_stack([poses.numbers(path) for path in source.paths]))
    elif isinstance(source, (Field, Robot)):
        values = poses.numbers(source.field)
    else:
        raise TypeError(f"{source!r} is of no pose")
    samples = Samples(is_stamped=signal.clock == "header")
    samples.stamps = array("q", base.stamps.tobytes())
    samples.logged = [base.logged]
    samples.values = array("d", np.ascontiguousarray(values, dtype=np.float64).tobytes())
    return samples
