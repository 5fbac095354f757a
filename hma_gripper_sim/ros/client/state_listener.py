"""Listening to the simulation node: the last state that it has published."""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from hma_gripper_sim.model.joint_names import SLIDE
from hma_gripper_sim.ros.inputs import nanoseconds

_QUEUE = 10
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_SLIDE_ENTRY = b"\0" + SLIDE.encode() + b"\0"


@dataclass(frozen=True)
class GripperState:
    """What the node has published last.

    Attributes
    ----------
    stamp
        Time of the joint states [ns].
    travel, velocity
        Of the prismatic joint, positive towards the object [m, m/s].
    force
        Of the actuator, positive when it pushes towards the object [N].
    phi_left, phi_right
        Angles between the top beam and the side beams [rad]; at most a tick older or newer.
    contour
        Name of the object in place.
    """

    stamp: int
    travel: float
    velocity: float
    force: float
    phi_left: float
    phi_right: float
    contour: str


class StateListener:
    """Keeps the node's last messages, serialised until someone asks for the state.

    Parameters
    ----------
    node
        Whose executor takes the messages.
    name
        Full name of the simulation node.
    group
        Of the callbacks.
    """

    def __init__(self, node: Node, name: str, group: CallbackGroup) -> None:
        self._node = node
        self._joints = self._phi = self._contour = b""
        namespace = name.rpartition("/")[0]
        self._subscriptions = [
            node.create_subscription(kind, topic, take, qos, raw=True, callback_group=group)
            for kind, topic, take, qos in (
                (JointState, f"{namespace}/joint_states", self._on_joints, _QUEUE),
                (JointState, f"{name}/phi", self._on_phi, _QUEUE),
                (String, f"{name}/contour", self._on_contour, _LATCHED),
            )
        ]
        self._read: tuple[tuple[bytes, ...], GripperState] | None = None

    @property
    def complete(self) -> bool:
        """Whether everything that makes up a state has come."""
        return bool(self._joints and self._phi and self._contour)

    @property
    def state(self) -> GripperState:
        """The last state; only where it is complete."""
        read, latest = self._read, (self._joints, self._phi, self._contour)
        if read is not None and all(a is b for a, b in zip(read[0], latest, strict=True)):
            return read[1]
        joints = deserialize_message(latest[0], JointState)
        phi = deserialize_message(latest[1], JointState)
        slide = joints.name.index(SLIDE)
        state = GripperState(
            stamp=nanoseconds(joints.header.stamp),
            travel=joints.position[slide],
            velocity=joints.velocity[slide],
            force=joints.effort[slide],
            phi_left=phi.position[phi.name.index("phi_left")],
            phi_right=phi.position[phi.name.index("phi_right")],
            contour=deserialize_message(latest[2], String).data,
        )
        self._read = latest, state
        return state

    def close(self) -> None:
        """Listen no longer."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _on_joints(self, data: bytes) -> None:
        if _SLIDE_ENTRY in data:  # an arm's joints may come on the same topic
            self._joints = data

    def _on_phi(self, data: bytes) -> None:
        self._phi = data

    def _on_contour(self, data: bytes) -> None:
        self._contour = data
