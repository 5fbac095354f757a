"""Signals out of serialised messages, many messages at a time.

Where the numbers lie is worked out for one message, and checked against what `rosbags` makes of
it. Then they are copied from all messages that agree with it in whatever says what lies where.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from hma_gripper_sim.bags.byte_arrays import bytes_at, matching
from hma_gripper_sim.bags.message_batches import Batch, Bytes, Connection, Ints, shown
from hma_gripper_sim.bags.message_layout import Layout, follow
from hma_gripper_sim.errors import InputError, first_line
from hma_gripper_sim.recordings.signal_map import Signal
from hma_gripper_sim.recordings.signal_sources import (
    FloatArray,
    Frame,
    LackingError,
    Place,
    joint_names,
    transforms,
)

_REMEMBERED = 8
"""Layouts that are kept in mind: several robots may share a topic and take turns."""


@dataclass
class Samples:
    """What one connection says of one signal.

    Attributes
    ----------
    stamps
        [ns], shape (n,).
    values
        As in the log, shape (n,).
    logged
        When each was logged [ns]: arrays to be put together, which signals share.
    is_stamped
        Whether the stamps are from the messages: not all of them have one.
    passed_over
        Messages about other joints or frames.
    others
        Some of those.
    frames
        Transforms in them.
    lacking
        Messages about the signal's joint or frame that do not hold it.
    lack
        What the first of them lacks.
    is_wrong
        Whether no message of this type can hold it.
    among
        Sets of joints that messages with the signal name.
    turns
        How often one of these sets followed on another.
    """

    stamps: array[int] = field(default_factory=lambda: array("q"))  # grows in place
    values: array[float] = field(default_factory=lambda: array("d"))
    logged: list[Ints] = field(default_factory=list)
    is_stamped: bool = False
    passed_over: int = 0
    others: set[str] = field(default_factory=set)
    frames: set[Frame] = field(default_factory=set)
    lacking: int = 0
    lack: str = ""
    is_wrong: bool = False
    among: list[frozenset[str]] = field(default_factory=list)
    turns: int = 0


@dataclass(frozen=True)
class _Plan:
    """Where each signal lies in messages that agree with a template."""

    template: Bytes
    fixed: Ints
    places: tuple[Place | InputError | None, ...]
    stamps: tuple[int | None, ...]
    order: str
    others: frozenset[str]
    frames: frozenset[Frame]
    joints: frozenset[str]


class Gatherer:
    """Collects signals from the messages of one connection.

    Parameters
    ----------
    connection
        Whose messages will be added.
    signals
        What to look for in them.

    Attributes
    ----------
    samples
        One for each signal.

    Raises
    ------
    InputError
        Messages of the connection's type cannot be read.
    """

    def __init__(self, connection: Connection, signals: Sequence[Signal]) -> None:
        self.samples = [Samples() for _ in signals]
        self._connection = connection
        self._signals = signals
        _ = connection.typestore  # raises, if it must, before there are messages
        self._plans: list[_Plan] = []
        self._joints: dict[frozenset[str], int] = {}

    def add(self, batch: Batch) -> None:
        """Take the signals from messages of the connection.

        Raises
        ------
        InputError
            A message is damaged, or cannot hold a signal.
        """
        count = batch.starts.size
        stamps = [np.empty(count, dtype=np.int64) for _ in self._signals]
        values = [np.empty(count) for _ in self._signals]
        found = [np.zeros(count, dtype=np.bool_) for _ in self._signals]
        among = np.zeros(count, dtype=np.int64)
        for plan, chosen in self._sorted(batch):
            starts = batch.starts[chosen]
            among[chosen] = self._joints.setdefault(plan.joints, len(self._joints))
            for k, (signal, place) in enumerate(zip(self._signals, plan.places, strict=True)):
                sample = self.samples[k]
                if place is None:
                    sample.passed_over += chosen.size
                    sample.others |= plan.others
                    sample.frames |= plan.frames
                    continue
                if isinstance(place, InputError):
                    sample.lacking += chosen.size
                    sample.lack = sample.lack or place.reason
                    sample.is_wrong |= not isinstance(place, LackingError)
                    continue
                found[k][chosen] = True
                values[k][chosen] = signal.source.value(_numbers(batch.data, starts, place))
                stamp = plan.stamps[k]
                sample.is_stamped |= stamp is not None
                if stamp is None:
                    stamps[k][chosen] = batch.logged[chosen]
                else:
                    stamps[k][chosen] = _stamps(batch.data, starts, stamp, plan.order)
        for k, sample in enumerate(self.samples):
            if found[k].any():
                sample.stamps.frombytes(stamps[k][found[k]].tobytes())
                sample.logged.append(batch.logged if found[k].all() else batch.logged[found[k]])
                sample.values.frombytes(values[k][found[k]].tobytes())
                if len(self._joints) > 1:
                    _count_turns(sample, among[found[k]], [*self._joints])

    def _sorted(self, batch: Batch) -> Iterator[tuple[_Plan, Ints]]:
        """Yield plans and which messages each is for, until every message has had its turn."""
        pending = np.arange(batch.starts.size)
        for plan in self._plans.copy():
            chosen, pending = _matching(batch, pending, plan)
            if chosen.size:
                yield plan, chosen
        learned = 0
        while pending.size:
            start, size = batch.starts[pending[0]], batch.sizes[pending[0]]
            plan = self._learn(batch.data[start : start + size], int(batch.logged[pending[0]]))
            self._plans = [plan, *self._plans][:_REMEMBERED]
            learned += 1
            if learned <= _REMEMBERED:
                chosen, pending = _matching(batch, pending, plan)
            else:  # no two seem to agree
                chosen, pending = pending[:1], pending[1:]
            yield plan, chosen

    def _learn(self, template: Bytes, logged: int) -> _Plan:
        """Find the signals in one message."""
        data = template.tobytes()
        try:
            layout = self._connection.layout(data)
            message = self._connection.deserialise(data)
        except Exception as error:  # a damaged message makes its parser raise almost anything
            reason = first_line(error)
            raise self._damaged(f"cannot be deserialised ({reason})", logged) from None
        places = tuple(_locate(signal, layout) for signal in self._signals)
        for place in places:
            if isinstance(place, Place):
                theirs = np.array([float(follow(message, path)) for path in place.paths])
                ours = _numbers(template, np.zeros(1, dtype=np.int64), place)[0]
                if ours.tobytes() != theirs.tobytes():
                    raise self._damaged("is read differently by rosbags", logged)
        stamps = tuple(
            layout.numbers[f"{place.stamp}.sec"].offset
            if isinstance(place, Place) and place.stamp and signal.clock == "header"
            else None
            for signal, place in zip(self._signals, places, strict=True)
        )
        frames = frozenset(transforms(layout))
        others = set(map(str, frames))
        others.update(joint_names(layout))
        joints = frozenset(joint_names(layout))
        return _Plan(
            template.copy(),
            layout.fixed,
            places,
            stamps,
            layout.order,
            frozenset(others),
            frames,
            joints,
        )

    def _damaged(self, reason: str, logged: int) -> InputError:
        topic = self._connection.topic
        return InputError(f"a message logged at {shown(logged)} {reason}", field=topic)


def _locate(signal: Signal, layout: Layout) -> Place | InputError | None:
    try:
        return signal.source.locate(layout)
    except InputError as error:
        return error


def _count_turns(sample: Samples, among: Ints, joints: Sequence[frozenset[str]]) -> None:
    """Take up which sets of joints some samples are from, and how often these take turns."""
    turns = np.flatnonzero(np.diff(among)) + 1
    sample.turns += turns.size
    for index in np.unique(among).tolist():
        if joints[index] not in sample.among:
            sample.among.append(joints[index])


def _matching(batch: Batch, pending: Ints, plan: _Plan) -> tuple[Ints, Ints]:
    """Return which messages a plan is for, and which it is not for."""
    starts, sizes = batch.starts[pending], batch.sizes[pending]
    matches = matching(batch.data, starts, sizes, plan.template, plan.fixed)
    return pending[matches], pending[~matches]


def _numbers(data: Bytes, starts: Ints, place: Place) -> FloatArray:
    """Return the numbers of a place in n messages, shape (n, k)."""
    offsets = np.array(place.offsets, dtype=np.int64)
    found = bytes_at(data, starts, offsets, int(place.kind[-1]))
    return found.view(place.kind).astype(np.float64)


def _stamps(data: Bytes, starts: Ints, offset: int, order: str) -> Ints:
    """Return the stamps [ns] at a place in n messages, shape (n,)."""
    out = bytes_at(data, starts, np.array([offset]), 8)
    seconds = out[:, :4].copy().view(f"{order}i4")[:, 0].astype(np.int64)
    nanoseconds = out[:, 4:].copy().view(f"{order}u4")[:, 0].astype(np.int64)
    return seconds * 1_000_000_000 + nanoseconds
