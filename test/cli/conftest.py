"""Logs of signals that are known, written as the node's topics, and a short replay."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from short_replay import course, parameters, replayed

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.device.topics import ACTUATOR_WRENCH, JOINT_STATES, PHI

__all__ = ["course", "parameters", "replayed", "write_log"]

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
START = 1_700_000_000_000_000_000


@pytest.fixture
def write_log(tmp_path: Path) -> Callable[..., Path]:
    """Write a log of a stroke; φ and force are functions of the travel."""

    def write(
        name: str,
        *,
        start: int = START,
        phi_offset: float = 0.0,
        force_offset: float = 0.0,
        prefix: str = "",
    ) -> Path:
        path = tmp_path / name
        header = T["std_msgs/msg/Header"]
        joints, vector = T["sensor_msgs/msg/JointState"], T["geometry_msgs/msg/Vector3"]
        with LogWriter(path, (JOINT_STATES, ACTUATOR_WRENCH, PHI)) as log:
            for i in range(300):
                stamp = start + i * 50_000_000
                time = header(T["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9)), "")
                travel = float(np.interp(0.05 * i, [1.0, 8.0, 14.0], [0.0, 0.028, 0.0]))
                pressed = max(0.0, travel - 0.004)
                phi = 1.69 + 6.0 * pressed + phi_offset
                force = -0.044 + 20.0 * pressed + force_offset
                wrench = T["geometry_msgs/msg/Wrench"](vector(0.0, 0.0, force), vector(0, 0, 0))
                two, none = np.array([travel, 0.0]), np.zeros(2)
                moment = np.array([force, 1e-3 * pressed])
                for topic, message in (
                    (
                        JOINT_STATES,
                        joints(time, [f"{prefix}slide", f"{prefix}top_1"], two, none, moment),
                    ),
                    (ACTUATOR_WRENCH, T["geometry_msgs/msg/WrenchStamped"](time, wrench)),
                    (
                        PHI,
                        joints(
                            time,
                            [f"{prefix}phi_left", f"{prefix}phi_right"],
                            np.full(2, phi),
                            none,
                            np.empty(0),
                        ),
                    ),
                ):
                    data = bytes(STORE.serialize_cdr(message, topic.msgtype))
                    log.write(topic.name, stamp, data)
        return path

    return write
