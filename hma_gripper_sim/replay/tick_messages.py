"""Blocks of results as serialised messages.

A message is serialised once; its bytes are then repeated as often as there are samples, and all
numbers of a kind are put in their places at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.message_template import MessageTemplate, placeholders
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import (
    ACTUATOR_WRENCH,
    CMD_VELOCITY,
    CONTOUR,
    JOINT_STATES,
    PHI,
)
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.results.bending_moments import joints_at_sections
from hma_gripper_sim.results.robot_description import MOUNT
from hma_gripper_sim.simulation.trace import Trace

FloatArray = npt.NDArray[np.float64]
Stamps = npt.NDArray[np.int64]

_STORE = get_typestore(Stores.ROS2_JAZZY)


class TickMessages:
    """The messages of many ticks, those of a tick with one stamp, as the node publishes them.

    Parameters
    ----------
    scene
        What is simulated.
    """

    def __init__(self, scene: Scene) -> None:
        T = _STORE.types
        time = T["builtin_interfaces/msg/Time"](0, 0)
        header, joints = T["std_msgs/msg/Header"], T["sensor_msgs/msg/JointState"]
        rows = placeholders(3, len(scene.joint_names))
        message = joints(header(time, ""), list(scene.joint_names), *rows)
        self._joints = _template(JOINT_STATES, message, rows)
        vector, wrench = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Wrench"]
        rows = placeholders(1, 1)
        message = T["geometry_msgs/msg/WrenchStamped"](
            header(time, MOUNT),
            wrench(vector(0.0, 0.0, float(rows[0, 0])), vector(0.0, 0.0, 0.0)),
        )
        self._force = _template(ACTUATOR_WRENCH, message, rows)
        self._has_moments = not joints_at_sections(scene)
        rows = placeholders(3 if self._has_moments else 2, 2)
        moments = rows[2] if self._has_moments else np.empty(0)
        message = joints(header(time, ""), ["phi_left", "phi_right"], *rows[:2], moments)
        self._phi = _template(PHI, message, rows)

    def of(self, trace: Trace, kept: slice, stamps: Stamps) -> Iterator[tuple[Topic, int, bytes]]:
        """Yield topic, stamp [ns] and bytes of every message of the kept samples of a trace."""
        sides = ("left", "right")
        of_phi = [
            [trace.phi_left[kept], trace.phi_right[kept]],
            [trace.phi_rate(side)[kept] for side in sides],
        ]
        if self._has_moments:
            of_phi.append([trace.largest_moments(side)[kept] for side in sides])
        parts = (
            self._joints.repeated(
                stamps,
                trace.joint_position[kept],
                trace.joint_velocity[kept],
                trace.joint_effort[kept],
            ),
            self._force.repeated(stamps, trace.actuator_force[kept, None]),
            self._phi.repeated(stamps, *(np.stack(numbers, axis=1) for numbers in of_phi)),
        )
        topics = (JOINT_STATES, ACTUATOR_WRENCH, PHI)
        for stamp, *messages in zip(stamps.tolist(), *parts, strict=True):
            for topic, message in zip(topics, messages, strict=True):
                yield topic, stamp, message


def velocity_message(velocity: float) -> bytes:
    """Return a command [m/s]."""
    message = _STORE.types[CMD_VELOCITY.msgtype](velocity)
    return bytes(_STORE.serialize_cdr(message, CMD_VELOCITY.msgtype))


def contour_message(name: str) -> bytes:
    """Return the name of the object in place."""
    message = _STORE.types[CONTOUR.msgtype](name)
    return bytes(_STORE.serialize_cdr(message, CONTOUR.msgtype))


def _template(topic: Topic, message: Any, rows: FloatArray) -> MessageTemplate:
    return MessageTemplate(bytes(_STORE.serialize_cdr(message, topic.msgtype)), rows)
