"""Listening to the simulation node: the last state that it has published."""

from __future__ import annotations

from dataclasses import dataclass
from threading import Lock

from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from hma_gripper_sim.model.joint_names import SLIDE
from hma_gripper_sim.ros.inputs import nanoseconds
from hma_gripper_sim.ros.message_bytes import header_stamp

_QUEUE = 10
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_SLIDE_ENTRY = SLIDE.encode() + b"\0"
"""In serialised joint states that hold the joint, whatever its prefix."""

_KEPT = 100
"""Ticks of which one message has come and the other is awaited."""


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
        Angles between the top beam and the side beams, of the same tick [rad].
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

    Others may publish joint states, even of the gripper's joints, on the same topic. Those of the
    node have the stamp of one of its own messages on ``~/phi``.

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
        self._joints: dict[int, bytes] = {}
        self._phi: dict[int, bytes] = {}
        self._lock = Lock()
        self._tick = b"", b""
        self._contour = b""
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
        return bool(self._tick[0] and self._contour)

    @property
    def nodes(self) -> int:
        """How many simulation nodes have this name."""
        return int(self._node.count_publishers(self._subscriptions[1].topic_name))

    @property
    def slide(self) -> str:
        """Name of the prismatic joint, with the node's prefix; only where the state is complete."""
        return str(deserialize_message(self._tick[0], JointState).name[0])

    @property
    def state(self) -> GripperState:
        """The last state; only where it is complete."""
        read, latest = self._read, (*self._tick, self._contour)
        if read is not None and all(a is b for a, b in zip(read[0], latest, strict=True)):
            return read[1]
        joints = deserialize_message(latest[0], JointState)
        phi = deserialize_message(latest[1], JointState)
        state = GripperState(
            stamp=nanoseconds(joints.header.stamp),
            travel=joints.position[0],
            velocity=joints.velocity[0],
            force=joints.effort[0],
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
        if _SLIDE_ENTRY in data:
            self._keep(self._joints, data)

    def _on_phi(self, data: bytes) -> None:
        self._keep(self._phi, data)

    def _keep(self, record: dict[int, bytes], data: bytes) -> None:
        """Keep a message; with the other one of its stamp it makes up the tick."""
        stamp = header_stamp(data)
        with self._lock:
            # Joint states of others on the same clock may have the stamp, but not all numbers.
            record[stamp] = max(data, record.get(stamp, b""), key=len)
            if stamp in self._joints and stamp in self._phi:
                self._tick = self._joints[stamp], self._phi[stamp]
            if len(record) > _KEPT:
                del record[next(iter(record))]

    def _on_contour(self, data: bytes) -> None:
        self._contour = data
