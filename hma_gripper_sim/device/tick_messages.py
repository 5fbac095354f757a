"""What is published every tick, as serialised messages: the node's, and those of a replay.

A message is serialised once; then only the numbers in its bytes change: of one tick, as the node
goes on, or of many at a time. That costs a fifth of what it takes rclpy to convert a message of 63
names every time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.message_template import MessageTemplate, placeholders
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import (
    ACTUATOR_WRENCH,
    JOINT_STATES,
    PHI,
    STAMPED_TOPICS,
    NodeTopic,
)
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.results.bending_moments import joints_at_sections
from hma_gripper_sim.results.robot_description import MOUNT
from hma_gripper_sim.simulation.state import SimulationState

Array = npt.NDArray[np.float64]
Stamps = npt.NDArray[np.int64]

_STORE = get_typestore(Stores.ROS2_JAZZY)
_TYPES = _STORE.types


class Content(NamedTuple):
    """A message with `placeholders` in it, these, and the numbers of states that take their places.

    The numbers are as many arrays as there are rows of placeholders, of shape (..., columns).
    """

    message: Any
    rows: Array
    numbers: Callable[[SimulationState], tuple[Array, ...]]


class TickMessages:
    """The messages of ticks, those of a tick with one stamp.

    Parameters
    ----------
    scene
        What is simulated.
    prefix
        Of names of joints and frames.
    """

    def __init__(self, scene: Scene, prefix: str = "") -> None:
        self._contents = {topic: _CONTENTS[topic](scene, prefix) for topic in STAMPED_TOPICS}
        self._templates = {
            topic: MessageTemplate(_serialised(topic, content.message), content.rows)
            for topic, content in self._contents.items()
        }

    def of_tick(self, state: SimulationState, stamp: int) -> dict[NodeTopic, bytes]:
        """Return the messages of one state, stamped with a time in nanoseconds."""
        for topic, template in self._templates.items():
            template.stamp(*divmod(stamp, 1_000_000_000))
            for place, numbers in zip(
                template.numbers, self._contents[topic].numbers(state), strict=True
            ):
                place[:] = numbers
        return {topic: template.content for topic, template in self._templates.items()}

    def of_ticks(
        self, states: SimulationState, stamps: Stamps
    ) -> Iterator[tuple[Topic, int, bytes]]:
        """Yield topic, stamp [ns] and bytes of every message of many states."""
        parts = [
            template.repeated(stamps, *self._contents[topic].numbers(states))
            for topic, template in self._templates.items()
        ]
        for stamp, *messages in zip(stamps.tolist(), *parts, strict=True):
            for topic, message in zip(self._templates, messages, strict=True):
                yield topic, stamp, message


def data_message(topic: Topic, data: float | str) -> bytes:
    """Return a message whose only field is `data`: a velocity [m/s], or a name."""
    return _serialised(topic, _TYPES[topic.msgtype](data))


def _joint_states(scene: Scene, prefix: str) -> Content:
    names = [prefix + name for name in scene.joint_names]
    rows = placeholders(3, len(names))
    return Content(
        _joints(names, *rows),
        rows,
        lambda states: (states.joint_position, states.joint_velocity, states.joint_effort),
    )


def _actuator_wrench(scene: Scene, prefix: str) -> Content:
    vector, wrench = _TYPES["geometry_msgs/msg/Vector3"], _TYPES["geometry_msgs/msg/Wrench"]
    rows = placeholders(1, 1)
    force, torque = vector(0.0, 0.0, float(rows[0, 0])), vector(0.0, 0.0, 0.0)
    message = _TYPES[ACTUATOR_WRENCH.msgtype](_header(prefix + MOUNT), wrench(force, torque))
    return Content(message, rows, lambda states: (np.asarray(states.actuator_force)[..., None],))


def _phi(scene: Scene, prefix: str) -> Content:
    has_moments = not joints_at_sections(scene)
    rows = placeholders(3 if has_moments else 2, 2)

    def numbers(states: SimulationState) -> tuple[Array, ...]:
        angles = _both(states.phi_left, states.phi_right)
        rates = _both(states.phi_left_rate, states.phi_right_rate)
        moments = (_both(states.moment_left, states.moment_right),) if has_moments else ()
        return angles, rates, *moments

    moments = rows[2] if has_moments else np.empty(0)
    return Content(_joints(["phi_left", "phi_right"], rows[0], rows[1], moments), rows, numbers)


_CONTENTS: Mapping[NodeTopic, Callable[[Scene, str], Content]] = {
    JOINT_STATES: _joint_states,
    ACTUATOR_WRENCH: _actuator_wrench,
    PHI: _phi,
}
"""How the messages of each of the `STAMPED_TOPICS` are made."""


def _joints(names: list[str], position: Array, velocity: Array, effort: Array) -> Any:
    return _TYPES["sensor_msgs/msg/JointState"](_header(""), names, position, velocity, effort)


def _header(frame: str) -> Any:
    return _TYPES["std_msgs/msg/Header"](_TYPES["builtin_interfaces/msg/Time"](0, 0), frame)


def _both(left: float, right: float) -> Array:
    return np.stack([left, right], axis=-1)


def _serialised(topic: Topic, message: Any) -> bytes:
    return bytes(_STORE.serialize_cdr(message, topic.msgtype))
