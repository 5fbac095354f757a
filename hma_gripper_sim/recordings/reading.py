"""Reading logs back: signals, poses, and single messages."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hma_gripper_sim.bags.message_batches import Connection, Ints, absolute, shown
from hma_gripper_sim.bags.stored_log import Log
from hma_gripper_sim.device.topics import JOINT_STATES
from hma_gripper_sim.errors import InputError, first_line
from hma_gripper_sim.recordings.assembly import AbsentError, Part, assemble, missing_topic
from hma_gripper_sim.recordings.gathering import Gatherer, Samples
from hma_gripper_sim.recordings.plausibility import doubts
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series
from hma_gripper_sim.recordings.signal_map import Signal, SignalMap
from hma_gripper_sim.recordings.signal_sources import Robot
from hma_gripper_sim.recordings.stamps import refuse_other_clocks

_NEVER = 2**63
"""A stamp [ns] after all others."""

_REMEDY = (
    "looked for where a node without prefix and namespace publishes it; for other names "
    "'hma_gripper inspect LOG --map FILE' proposes a signal map, which '--signals FILE' takes, or "
    "'--sim-signals FILE' for the simulated log of a comparison"
)
"""What to do about a signal that the shipped signal map does not find."""


class Message(NamedTuple):
    """One message of a log; `stamp` [ns] is its header's, or else the time it was logged."""

    topic: str
    stamp: int
    content: Any


def read_messages(path: str | Path, topics: Collection[str]) -> Iterator[Message]:
    """Yield the messages of `topics` in the order they lie in the log.

    Raises
    ------
    InputError
        The log cannot be read, or lacks one of the topics.
    """
    log = Log(path)
    for batch in log.batches(topics):
        for connection, logged, data in batch:
            try:
                content = connection.deserialise(data)
            except InputError as error:
                raise error.within(source=log.source) from None
            except Exception as error:  # a damaged message makes its parser raise almost anything
                reason = f"a message logged at {shown(logged)} cannot be deserialised"
                raise InputError(
                    f"{reason} ({first_line(error)})", field=connection.topic, source=log.source
                ) from None
            yield Message(connection.topic, _stamp(content, logged), content)
    for topic in topics:
        if absolute(topic) not in log.findings.topics:
            raise InputError(missing_topic(log.findings), field=topic, source=log.source)


def read_recording(path: str | Path, signal_map: SignalMap | None = None) -> Recording:
    """Read signals from a log; time 0 is the earliest stamp among them.

    Parameters
    ----------
    path
        An mcap, db3 or ROS 1 bag file, or a rosbag2 directory.
    signal_map
        Where in the log the signals are; None: where this project's own node publishes them.

    Returns
    -------
    Recording
        Its `notes` say everything that was skipped or recovered.

    Raises
    ------
    InputError
        The log cannot be read; or a signal that is not optional is missing, is nowhere finite, or
        is published more than once; or its stamps run back, or jump, by more than a recorder does.
    """
    log = Log(path)
    try:
        parts = _gather(log, (signal_map or SignalMap.sim_node()).signals)
        entries = _held(parts)
        for signal in entries:
            _put_together(log, signal, parts)
        taken: dict[str, tuple[Ints, FloatArray]] = {}
        for signal in entries:
            samples = assemble(signal, parts[signal], log.findings)
            if samples is not None:
                taken[signal.name] = samples
        refuse_other_clocks({name: int(stamps[0]) for name, (stamps, _) in taken.items()})
    except InputError as error:
        remedy = (_REMEDY,) if signal_map is None and isinstance(error, AbsentError) else ()
        reason = "; ".join((error.reason, *remedy, *log.findings.losses))
        raise InputError(reason, field=error.field, source=error.source or log.source) from None
    start = min((int(stamps[0]) for stamps, _ in taken.values()), default=0)
    signals: dict[str, Series] = {}
    for name in [*taken]:
        stamps, value = taken.pop(name)
        time = (stamps - start).astype(np.float64) * 1e-9
        # Signals with the same stamps share them: an hour's are many.
        time = next((s.time for s in signals.values() if np.array_equal(s.time, time)), time)
        signals[name] = Series(time, value)
    notes = (*log.findings.losses, *log.findings.notes, *doubts(signals, entries))
    return Recording(log.source, signals, start, notes)


def read_poses(
    path: str | Path, stamps: Collection[int], joint_names: tuple[str, ...]
) -> list[FloatArray]:
    """Return the joint positions recorded first at or after each stamp [ns], ascending.

    Returns
    -------
    list of arrays
        [rad] (the prismatic joint: [m]), each of shape (n_joints,), in `joint_names` order.

    Raises
    ------
    InputError
        As `read_messages`; or a joint is missing; or the log ends before the last stamp.
    """
    wanted = sorted(stamps)
    found: list[tuple[int, Any]] = [(_NEVER, None)] * len(wanted)
    for _, stamp, content in read_messages(path, [JOINT_STATES.name]):
        for k in range(bisect_right(wanted, stamp)):
            if stamp < found[k][0]:
                found[k] = stamp, content
    poses: list[FloatArray] = []
    for asked, (stamp, content) in zip(wanted, found, strict=True):
        if content is None:
            reason = f"ends before stamp {shown(asked)}"
            raise InputError(reason, field=JOINT_STATES.name, source=str(path))
        position = dict(zip(content.name, content.position, strict=False))
        try:
            poses.append(np.array([position[name] for name in joint_names]))
        except KeyError as error:
            reason = f"joint {error} is missing at stamp {shown(stamp)}"
            raise InputError(reason, field=JOINT_STATES.name, source=str(path)) from None
    return poses


def _held(parts: Mapping[Signal, Sequence[Part]]) -> list[Signal]:
    """Return the entry of each name that the log holds first, or else the last."""
    held: dict[str, Signal] = {}
    for signal in parts:
        if signal.name not in held or not _has_samples(parts[held[signal.name]]):
            held[signal.name] = signal
    return [*held.values()]


def _has_samples(said: Sequence[Part]) -> bool:
    return any(isinstance(samples, Samples) and samples.values for _, samples in said)


def _put_together(log: Log, signal: Signal, parts: dict[Signal, list[Part]]) -> None:
    """Put together what no message holds by itself: poses along chains of frames or joints."""

    def gather(entries: Sequence[Signal]) -> dict[Signal, list[Part]]:
        return _gather(Log(log.source), entries)

    is_pose = isinstance(signal.source, Robot) or getattr(signal.source, "frame", None) is not None
    if not is_pose or _has_samples(parts[signal]):
        return
    # Slow to import, and seldom needed.
    from hma_gripper_sim.recordings.pose_chains import pose_along_frames, pose_along_joints

    try:
        if isinstance(signal.source, Robot):
            parts[signal] = pose_along_joints(signal, gather)
            return
        chain = pose_along_frames(signal, gather)
    except InputError as error:
        reason = f"{signal.name}: {error.reason}"
        raise InputError(reason, field=error.field or signal.topic, source=error.source) from None
    if chain is not None:
        parts[signal], transforms = chain
        log.findings.note(f"{signal.topic}: {signal.name} was put together from {transforms}")


def _gather(log: Log, entries: Sequence[Signal]) -> dict[Signal, list[Part]]:
    """Read the log; return by signal what each connection on its topic says of it."""
    by_topic: dict[str, list[Signal]] = defaultdict(list)
    for signal in dict.fromkeys(entries):
        by_topic[signal.topic].append(signal)
    gatherers: dict[Connection, Gatherer | InputError] = {}
    for batch in log.batches(by_topic):
        for connection, messages in batch.split():
            if connection not in gatherers:
                gatherers[connection] = _gatherer(connection, by_topic[connection.topic])
            gatherer = gatherers[connection]
            if isinstance(gatherer, Gatherer):
                gatherer.add(messages)
    parts: dict[Signal, list[Part]] = {signal: [] for signal in entries}
    for connection, gatherer in gatherers.items():
        for k, signal in enumerate(by_topic[connection.topic]):
            said = gatherer.samples[k] if isinstance(gatherer, Gatherer) else gatherer
            parts[signal].append((connection, said))
    return parts


def _gatherer(connection: Connection, signals: Sequence[Signal]) -> Gatherer | InputError:
    try:
        return Gatherer(connection, signals)
    except InputError as error:
        return error


def _stamp(content: Any, logged: int) -> int:
    header = getattr(content, "header", None)
    if header is None:
        return logged
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)
