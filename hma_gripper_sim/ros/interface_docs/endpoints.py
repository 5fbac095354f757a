"""The topics and services of the node with the shipped parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.device.request_queue import Mailbox
from hma_gripper_sim.device.topics import NODE
from hma_gripper_sim.ros.arguments import initialise_ros
from hma_gripper_sim.ros.node import SimNode
from hma_gripper_sim.ros.node_process import private_ros_domain
from hma_gripper_sim.ros.parameters import declare_parameters
from hma_gripper_sim.simulation.simulation import Simulation
from hma_gripper_sim.yaml_reading import config_directory

_NAMESPACE = "/namespace"
"""Where the node is put for reading: so names show whether they are relative."""

_CLOCKS = ("publish_clock", "use_sim_time")
"""Parameters that each add a topic, and exclude each other."""


@dataclass(frozen=True, order=True)
class Endpoint:
    """A topic or service.

    Attributes
    ----------
    name
        As a node writes it: ``~/private``, ``relative`` to its namespace, or ``/absolute``.
    kind
        Its type, such as ``std_msgs/msg/Float64``.
    qos
        In words; empty for services and for what ROS itself adds.
    """

    name: str
    kind: str
    qos: str = ""


Endpoints = tuple[Endpoint, ...]


@dataclass(frozen=True)
class Interface:
    """Everything that a node takes, publishes and serves, by name."""

    subscriptions: Endpoints
    publishers: Endpoints
    services: Endpoints


def shipped_interface() -> Interface:
    """Return what the node has with the shipped parameters, in either role about the clock."""
    with private_ros_domain():
        clock, follower = (_read(parameter) for parameter in _CLOCKS)
    return Interface(
        subscriptions=_joined(clock.subscriptions, follower.subscriptions),
        publishers=_joined(clock.publishers, follower.publishers),
        services=_joined(clock.services, follower.services),
    )


def _read(parameter: str) -> Interface:
    """Read the interface of a node with one of its parameters set."""
    with _node(parameter) as node:
        name = NODE.strip("/")
        topics = (*node.publishers, *node.subscriptions)
        qos = {item.topic_name: item.qos_profile for item in topics}

        def endpoints(by_node: Callable[[str, str], list[tuple[str, list[str]]]]) -> Endpoints:
            return tuple(
                Endpoint(_relative(topic), kind, _words(qos.get(topic)))
                for topic, (kind,) in by_node(name, _NAMESPACE)
            )

        return Interface(
            subscriptions=endpoints(node.get_subscriber_names_and_types_by_node),
            publishers=endpoints(node.get_publisher_names_and_types_by_node),
            services=endpoints(node.get_service_names_and_types_by_node),
        )


def _joined(a: Endpoints, b: Endpoints) -> Endpoints:
    return tuple(sorted({*a, *b}))


@contextmanager
def _node(parameter: str) -> Iterator[Node]:
    """A complete node that does not tick."""
    file = config_directory() / "sim_node.yaml"
    settings_of_ros = ["-r", f"__ns:={_NAMESPACE}", "-p", f"{parameter}:=true"]
    initialise_ros(["sim_node", "--ros-args", "--params-file", str(file), *settings_of_ros])
    try:
        node = Node(NODE.strip("/"), automatically_declare_parameters_from_overrides=True)
        settings = declare_parameters(node)
        drive = Drive(
            Simulation(settings.scenes[settings.contour]),
            settings.scenes,
            settings.contour,
            period=settings.period,
            limits=settings.limits,
        )
        SimNode(node, settings, drive, Mailbox())
        yield node
        node.destroy_node()
    finally:
        rclpy.try_shutdown()


def _relative(name: str) -> str:
    for start, short in ((f"{_NAMESPACE}{NODE}/", "~/"), (f"{_NAMESPACE}/", "")):
        if name.startswith(start):
            return short + name.removeprefix(start)
    return name


def _words(qos: QoSProfile | None) -> str:
    if qos is None:
        return ""
    reliability = "reliable" if qos.reliability == ReliabilityPolicy.RELIABLE else "best effort"
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return f"{reliability}, {'transient local' if latched else 'volatile'}, depth {qos.depth}"
