"""A node in a process of its own, and a client of it in this one, on a ROS domain of their own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from patience import patience

from hma_gripper_sim.ros.node_process import private_ros_domain

NODE = "/hma_gripper_sim"
PATIENCE = patience(20.0)  # s, for anything that happens soon
START_PATIENCE = patience(120.0)  # s, where kernels may have to be compiled first


@pytest.fixture
def domain() -> Iterator[None]:
    """Put everything that this test starts on a ROS domain that nobody else uses."""
    with private_ros_domain():
        yield


class NodeProcess:
    """A running sim_node."""

    def __init__(self, arguments: tuple[str, ...], folder: Path) -> None:
        self._folder = folder
        with self._file("stdout").open("w") as out, self._file("stderr").open("w") as err:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "hma_gripper_sim.ros.sim_node", "--ros-args", *arguments],
                stdout=out,
                stderr=err,
                start_new_session=True,
                env=os.environ.copy(),
            )

    def output(self, stream: str) -> str:
        """What it has printed on "stdout" or "stderr"."""
        return self._file(stream).read_text()

    def send_signal(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def wait_until_ready(self) -> None:
        """Wait for the line that it prints when it begins; kernels may have to be compiled."""
        end = time.monotonic() + START_PATIENCE
        while "ready" not in self.output("stderr"):
            self.check()
            assert time.monotonic() < end, "the node has not come up"
            time.sleep(0.02)

    def exit_code(self, patience: float = PATIENCE) -> int:
        """Wait for its end."""
        return self._process.wait(patience)

    def check(self) -> None:
        """Fail unless it is still there."""
        code = self._process.poll()
        if code is not None:
            pytest.fail(f"sim_node ended with {code}: {self.output('stderr')}")

    def remove(self) -> None:
        """Leave nothing behind, whatever happened."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def _file(self, stream: str) -> Path:
        return self._folder / f"sim_node.{stream}"


@pytest.fixture
def start_node(domain: None, tmp_path: Path) -> Iterator[Callable[..., NodeProcess]]:
    """Start sim_node with ROS arguments; ``a=1`` stands for ``-p a:=1``, __ for a dot."""
    started: list[NodeProcess] = []

    def start(*arguments: str, **parameters: object) -> NodeProcess:
        folder = tmp_path / str(len(started))
        folder.mkdir()
        for name, value in parameters.items():
            arguments += ("-p", f"{name.replace('__', '.')}:={value}")
        started.append(NodeProcess(arguments, folder))
        return started[-1]

    yield start
    for process in started:
        process.remove()


class Graph(NamedTuple):
    """Types of what a node has, by full name."""

    subscriptions: dict[str, str]
    publishers: dict[str, str]
    services: dict[str, str]


class Client:
    """Listens to a node, and talks to it."""

    def __init__(self, process: NodeProcess, *, ticking: bool = True) -> None:
        import rclpy
        from geometry_msgs.msg import WrenchStamped
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64, String

        process.wait_until_ready()  # also finds it sooner than waiting for its announcements
        self._process = process
        self._context = rclpy.Context()
        self._context.init()
        self._node = rclpy.create_node("test_client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._velocity = self._node.create_publisher(Float64, f"{NODE}/cmd_velocity", 1)
        self._clock = self._node.create_publisher(Clock, "/clock", 1)
        self._publishers: dict[str, Any] = {}
        self._others: list[Any] = []
        self._clients: dict[str, Any] = {}
        self.joints: list[Any] = []
        self.wrenches: list[Any] = []
        self.phi: list[Any] = []
        self.contours: list[str] = []
        deep = QoSProfile(depth=10_000)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for kind, topic, record, qos in (
            (JointState, "/joint_states", self.joints.append, deep),
            (WrenchStamped, f"{NODE}/actuator_wrench", self.wrenches.append, deep),
            (JointState, f"{NODE}/phi", self.phi.append, deep),
            (
                String,
                f"{NODE}/contour",
                lambda message: self.contours.append(message.data),
                latched,
            ),
        ):
            self._node.create_subscription(kind, topic, record, qos)
        self.wait(
            lambda: (
                ((self.joints and self.wrenches and self.phi) or not ticking)
                and self.contours
                and self._velocity.get_subscription_count()
            )
        )

    def close(self) -> None:
        self._executor.shutdown()
        for node in (*self._others, self._node):
            node.destroy_node()
        self._context.try_shutdown()

    def wait(self, condition: Callable[[], Any], patience: float = PATIENCE) -> None:
        """Handle messages until the condition holds; fail when it takes too long."""
        end = time.monotonic() + patience
        while not condition():
            self._process.check()
            assert time.monotonic() < end, f"waited {patience:g} s in vain"
            self._executor.spin_once(timeout_sec=0.05)

    def clear(self) -> None:
        """Forget what has been received so far."""
        for record in (self.joints, self.wrenches, self.phi, self.contours):
            record.clear()

    def call(self, service: str, data: bool | None = None) -> Any:
        """Call a Trigger service, or a SetBool service with `data`; return the response."""
        from std_srvs.srv import SetBool, Trigger

        kind = Trigger if data is None else SetBool
        request = Trigger.Request() if data is None else SetBool.Request(data=data)
        return self._request(kind, service, request)

    def set_parameter(self, name: str, value: object) -> Any:
        """Set one parameter of the node; return the result."""
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        parameter = Parameter(name, value=value).to_parameter_msg()
        request = SetParameters.Request(parameters=[parameter])
        return self._request(SetParameters, "set_parameters", request).results[0]

    def get_parameter(self, name: str) -> Any:
        """Return the value of one parameter of the node."""
        from rcl_interfaces.srv import GetParameters
        from rclpy.parameter import parameter_value_to_python

        request = GetParameters.Request(names=[name])
        answer = self._request(GetParameters, "get_parameters", request)
        return parameter_value_to_python(answer.values[0])

    def describe_parameters(self) -> list[Any]:
        """Return the descriptors of all parameters of the node."""
        from rcl_interfaces.srv import DescribeParameters, ListParameters

        listed = self._request(ListParameters, "list_parameters", ListParameters.Request())
        request = DescribeParameters.Request(names=listed.result.names)
        return list(self._request(DescribeParameters, "describe_parameters", request).descriptors)

    def parameter_names(self) -> list[str]:
        """Return the names of all parameters of the node."""
        from rcl_interfaces.srv import ListParameters

        listed = self._request(ListParameters, "list_parameters", ListParameters.Request())
        return list(listed.result.names)

    def graph(self, namespace: str) -> Graph:
        """Return what a node in a namespace has, as far as it has been discovered."""
        name = NODE.strip("/")
        self.wait(lambda: (name, namespace) in self._node.get_node_names_and_namespaces())
        return Graph(
            *(
                {topic: kind for topic, (kind,) in by_node(name, namespace)}
                for by_node in (
                    self._node.get_subscriber_names_and_types_by_node,
                    self._node.get_publisher_names_and_types_by_node,
                    self._node.get_service_names_and_types_by_node,
                )
            )
        )

    def qos(self, kind: str, topic: str) -> tuple[str, str]:
        """Return reliability and durability of the node's subscription or publisher, in words."""
        find = {
            "subscriptions": self._node.get_subscriptions_info_by_topic,
            "publishers": self._node.get_publishers_info_by_topic,
        }[kind]
        name = NODE.strip("/")
        profile = next(item.qos_profile for item in find(topic) if item.node_name == name)
        words = (profile.reliability.name, profile.durability.name)
        reliability, durability = (word.lower().replace("_", " ") for word in words)
        return reliability, durability

    def services(self) -> set[str]:
        """Names of the services of the node."""
        listed = self._node.get_service_names_and_types_by_node(NODE.strip("/"), "/")
        return {name for name, _ in listed}

    def command(self, velocity: float) -> None:
        """Send a velocity, and wait until the node has it: later requests come after it."""
        from rclpy.duration import Duration
        from std_msgs.msg import Float64

        self._velocity.publish(Float64(data=velocity))
        assert self._velocity.wait_for_all_acked(Duration(seconds=PATIENCE))

    def send(self, topic: str, message: Any) -> None:
        """Publish on a topic of the node, and wait until the node has it."""
        from rclpy.duration import Duration

        name = f"{NODE}/{topic}"
        if name not in self._publishers:
            self._publishers[name] = self._node.create_publisher(type(message), name, 1)
            self.wait(self._publishers[name].get_subscription_count)
        self._publishers[name].publish(message)
        assert self._publishers[name].wait_for_all_acked(Duration(seconds=PATIENCE))

    def listen(self, kind: Any, topic: str, *, latched: bool = False) -> list[Any]:
        """Return the list that the messages of a topic are added to from now on."""
        from rclpy.qos import DurabilityPolicy, QoSProfile

        messages: list[Any] = []
        kept = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=1000, durability=kept)
        self._node.create_subscription(kind, topic, messages.append, qos)
        return messages

    def publisher(self, kind: Any, topic: str, qos: Any = 1, *, of: str = "") -> Any:
        """Return a publisher that the node listens to, of another ROS node if a name is given."""
        import rclpy

        node = rclpy.create_node(of, context=self._context) if of else self._node
        if of:
            self._others.append(node)
        publisher = node.create_publisher(kind, topic, qos)
        self.wait(publisher.get_subscription_count)
        return publisher

    def use_sim_time(self) -> None:
        """Take the time from /clock."""
        from rclpy.parameter import Parameter

        self._node.set_parameters([Parameter("use_sim_time", value=True)])

    def now(self) -> Any:
        """Present time, as the stamp of a message."""
        return self._node.get_clock().now().to_msg()

    def has_clock_subscriber(self) -> bool:
        return self._clock.get_subscription_count() > 0

    def publish_clock(self, nanoseconds: int) -> None:
        """Act as the clock of nodes with use_sim_time."""
        from rclpy.time import Time
        from rosgraph_msgs.msg import Clock

        self._clock.publish(Clock(clock=Time(nanoseconds=nanoseconds).to_msg()))

    def _request(self, kind: Any, name: str, request: Any) -> Any:
        if name not in self._clients:
            self._clients[name] = self._node.create_client(kind, f"{NODE}/{name}")
            self.wait(self._clients[name].service_is_ready)
        future = self._clients[name].call_async(request)
        self.wait(future.done)
        return future.result()


@pytest.fixture
def connect() -> Iterator[Callable[[NodeProcess], Client]]:
    """Connect a client to a node that has been started, and wait until it publishes.

    A node that is not ticking, because it waits for its clock, publishes no states.
    """
    clients: list[Client] = []

    def make(process: NodeProcess, *, ticking: bool = True) -> Client:
        clients.append(Client(process, ticking=ticking))
        return clients[-1]

    yield make
    for client in clients:
        client.close()
