"""Logs made up message by message."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.logs.topics import (
    ACTUATOR_WRENCH,
    CONTOUR,
    JOINT_STATES,
    LOGGED_TOPICS,
    PHI,
    Topic,
)
from hma_gripper_sim.logs.writer import LogWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types

START = 1_700_000_000_123_456_789  # ns
PERIOD = 10_000_000  # ns


def header(stamp: int, frame: str = "") -> Any:
    time = T["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    return T["std_msgs/msg/Header"](time, frame)


def joint_state(
    stamp: int, names: Sequence[str], position: Sequence[float], effort: Sequence[float]
) -> Any:
    rest = np.zeros(len(names))
    return T["sensor_msgs/msg/JointState"](
        header(stamp), list(names), np.array(position, float), rest, np.array(effort, float)
    )


def wrench(stamp: int, force: float) -> Any:
    vector = T["geometry_msgs/msg/Vector3"]
    content = T["geometry_msgs/msg/Wrench"](vector(0.0, 0.0, force), vector(0.0, 0.0, 0.0))
    return T["geometry_msgs/msg/WrenchStamped"](header(stamp, "gripper_mount"), content)


Entry = tuple[Topic, int, Any]


def ticks(count: int) -> list[Entry]:
    """What a node with the joints ``slide``, ``a`` and ``b`` publishes in `count` ticks."""
    entries: list[Entry] = [(CONTOUR, START, T["std_msgs/msg/String"]("box"))]
    for i in range(count):
        stamp = START + i * PERIOD
        names = ("slide", "a", "b")
        joints = joint_state(stamp, names, (0.001 * i, 0.1 * i, -0.1 * i), (9.0, 0.2, -0.3 * i))
        angles = joint_state(stamp, ("phi_right", "phi_left"), (1.5, 1.6 + 0.01 * i), ())
        entries += [
            (JOINT_STATES, stamp, joints),
            (ACTUATOR_WRENCH, stamp, wrench(stamp, 0.5 - 0.125 * i)),
            (PHI, stamp, angles),
        ]
    return entries


@pytest.fixture
def entries() -> list[Entry]:
    """Five ticks of a node, for a test to change before they are written."""
    return ticks(5)


@pytest.fixture
def write_log(tmp_path: Path) -> Callable[[Sequence[Entry]], Path]:
    """Write messages with `LogWriter`; return the log's path."""

    def write(entries: Sequence[Entry]) -> Path:
        path = tmp_path / "made" / "up"
        with LogWriter(path, LOGGED_TOPICS) as log:
            for topic, stamp, message in entries:
                log.write(topic.name, stamp, bytes(STORE.serialize_cdr(message, topic.msgtype)))
        return path

    return write


@pytest.fixture
def five_ticks(entries: list[Entry], write_log: Callable[[Sequence[Entry]], Path]) -> Path:
    """A log of five ticks."""
    return write_log(entries)
