"""Reading logs back, one message at a time."""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.logs.recording import FloatArray, Recording, Series
from hma_gripper_sim.logs.signals import NODE_SIGNALS, Signal
from hma_gripper_sim.logs.topics import JOINT_STATES


class Message(NamedTuple):
    """One message of a log; `stamp` [ns] is its header's, or else the time it was logged."""

    topic: str
    stamp: int
    content: Any


def read_messages(path: str | Path, topics: Collection[str]) -> Iterator[Message]:
    """Yield the messages of `topics` in the order they were logged.

    Reads whatever `rosbags` does: rosbag2 directories and bare mcap files among others.

    Raises
    ------
    InputError
        The log cannot be read, or lacks one of the topics.
    """
    source = str(path)
    try:
        typestore = get_typestore(Stores.ROS2_JAZZY)
        with AnyReader([Path(path)], default_typestore=typestore) as reader:
            connections = [c for c in reader.connections if c.topic in topics]
            for topic in topics:
                if topic not in reader.topics:
                    raise InputError("no such topic in this log", field=topic, source=source)
            for connection, logged, data in reader.messages(connections):
                content = reader.deserialize(data, connection.msgtype)
                yield Message(connection.topic, _stamp(content, logged), content)
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", source=source) from None
    except Exception as error:  # a damaged file makes the parsers raise almost anything
        reason = str(error) or type(error).__name__
        raise InputError(f"cannot be read as a log: {reason}", source=source) from None


def read_recording(path: str | Path, signals: Mapping[str, Signal] = NODE_SIGNALS) -> Recording:
    """Read signals from a log; time 0 is the earliest stamp among them.

    Raises
    ------
    InputError
        As `read_messages`; or a value that is missing or not finite; or time that runs backwards.
    """
    source = str(path)
    by_topic: dict[str, list[str]] = defaultdict(list)
    for name, signal in signals.items():
        by_topic[signal.topic].append(name)
    stamps = {topic: array("q") for topic in by_topic}
    values = {name: array("d") for name in signals}
    for topic, stamp, content in read_messages(path, by_topic):
        if stamps[topic] and stamp < stamps[topic][-1]:
            raise InputError(
                f"time runs backwards at {_seconds(stamp)}", field=topic, source=source
            )
        stamps[topic].append(stamp)
        for name in by_topic[topic]:
            try:
                value = signals[name].read(content)
            except InputError as error:
                raise error.within(source=source) from None
            if not np.isfinite(value):
                reason = f"{name} is {value} at {_seconds(stamp)}"
                raise InputError(reason, field=topic, source=source)
            values[name].append(value)
    for topic, recorded in stamps.items():
        if not recorded:
            raise InputError("no messages on this topic", field=topic, source=source)
    start = min(recorded[0] for recorded in stamps.values())
    times: dict[str, FloatArray] = {
        topic: (np.array(recorded, dtype=np.int64) - start).astype(np.float64) * 1e-9
        for topic, recorded in stamps.items()
    }
    series = {n: Series(times[signals[n].topic], np.array(values[n])) for n in signals}
    return Recording(source, series, start)


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
    poses: list[FloatArray] = []
    wanted = sorted(stamps)
    for _, stamp, content in read_messages(path, [JOINT_STATES.name]):
        if len(poses) == len(wanted):
            break
        if stamp < wanted[len(poses)]:
            continue
        position = dict(zip(content.name, content.position, strict=True))
        try:
            pose = np.array([position[name] for name in joint_names])
        except KeyError as error:
            reason = f"joint {error} is missing at {_seconds(stamp)}"
            raise InputError(reason, field=JOINT_STATES.name, source=str(path)) from None
        poses.append(pose)
    if len(poses) < len(wanted):
        reason = f"ends before {_seconds(wanted[len(poses)])}"
        raise InputError(reason, field=JOINT_STATES.name, source=str(path))
    return poses


def _stamp(content: Any, logged: int) -> int:
    header = getattr(content, "header", None)
    if header is None:
        return logged
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def _seconds(stamp: int) -> str:
    return f"stamp {stamp * 1e-9:.6f} s"
