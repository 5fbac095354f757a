"""A client of the simulated gripper: select an object, move, hold, wait, read the state."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from hma_gripper_sim.device.topics import NODE
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.motion.trapezoid import trapezoid
from hma_gripper_sim.ros.client.background_node import OwnNode
from hma_gripper_sim.ros.client.motion_sender import MotionSender
from hma_gripper_sim.ros.client.state_listener import GripperState, StateListener
from hma_gripper_sim.ros.node_process import NodeError
from hma_gripper_sim.units import quantity

PATIENCE = 10.0
"""How long the node gets for an answer, by default [s]."""

_POLL = 0.002
"""How often a wait looks [s]."""

_ARRIVED = 1e-9
"""How near to its end a move is over [m]; the drive gets a thousand times nearer."""

_GRACE = 0.5
"""Simulated time after which a move that should be over, but rests elsewhere, has failed [s]."""

_LATEST = 2.0
"""Real time that has to pass as well [s]: until then the command may still be on its way."""


class GripperError(NodeError):
    """The gripper did not do what it was asked to."""


class GripperRefusedError(GripperError):
    """The node refused a request; the text says why, in the node's words."""


class GripperTimeoutError(GripperError, TimeoutError):
    """What was waited for did not come."""


class GripperClient:
    """Commands a running ``sim_node``; use it as a context manager.

    On its own it has a ROS context and a thread that listens. In a program with a node of its own,
    give it that node, and let the program's executor spin: in another thread than the one that
    waits here, or, with a `MultiThreadedExecutor`, also from within a callback. When the block
    is left by an exception, the gripper is told to stop.

    Timeouts of waits are in simulated time, by the node's stamps, so they hold at any speed of the
    simulation.

    Parameters
    ----------
    node
        Of the program that this is part of; None: none.
    name
        Full name of the simulation node.
    patience
        How long the node may keep silent, or time stand still, in a method that waits [s].
    check
        Called every few milliseconds by each method that waits; what it raises ends the wait.

    Raises
    ------
    GripperTimeoutError
        By every method: the node is not there, does not answer, or has been paused.
    GripperError
        By every method that waits: the node's time ran back, or a second node has its name.
    """

    def __init__(
        self,
        node: Node | None = None,
        *,
        name: str = NODE,
        patience: float = PATIENCE,
        check: Callable[[], None] | None = None,
    ) -> None:
        if not name.startswith("/"):
            raise InputError(f"must be a full name, got {name!r}", field="name")
        self._name = name
        self._patience = quantity(patience, "s", field="patience", minimum=0.0)
        self._check = check or (lambda: None)
        self._own = None if node else OwnNode("hma_gripper_client")
        self._node = node or self._own.node  # type: ignore[union-attr]
        group = ReentrantCallbackGroup()
        self._listener = StateListener(self._node, name, group)
        self._sender = MotionSender(self._node, name, group)
        self._clients = {
            "reset": self._node.create_client(Trigger, f"{name}/reset", callback_group=group),
            "get_parameters": self._node.create_client(
                GetParameters, f"{name}/get_parameters", callback_group=group
            ),
            "set_parameters": self._node.create_client(
                SetParameters, f"{name}/set_parameters", callback_group=group
            ),
        }
        if self._own:
            self._own.start()

    @property
    def state(self) -> GripperState:
        """The last state; raises `GripperError` where `wait_for_node` has not been called."""
        if not self._listener.complete:
            raise GripperError(f"nothing has come from {self._name} yet")
        return self._listener.state

    def wait_for_node(self, timeout: float | None = None) -> None:
        """Wait until the node publishes and takes commands.

        Every other method does so too.

        Parameters
        ----------
        timeout
            In real time [s]; None: the client's patience.
        """
        self._await(lambda: self._listener.complete and self._sender.heard, "state", timeout)
        try:
            self._await(lambda: self._listener.nodes == 1, "single source of its state", timeout)
        except GripperTimeoutError:
            raise self._several_nodes() from None

    def select(self, contour: str) -> None:
        """Put an object of the node's catalogue in place.

        Raises
        ------
        GripperRefusedError
            There is none of this name, or it would overlap the gripper where it is now.
        """
        self.wait_for_node()
        parameter = Parameter("contour", value=str(contour)).to_parameter_msg()
        answer = self._call("set_parameters", SetParameters.Request(parameters=[parameter]))
        if not answer.results[0].successful:
            raise GripperRefusedError(f"{contour!r} refused: {answer.results[0].reason}")
        self._await(lambda: self.state.contour == contour, f"contour {contour!r}")

    def reset(self) -> None:
        """Return to the start pose, at rest; the object stays in place."""
        self.wait_for_node()
        answer = self._call("reset", Trigger.Request())
        if not answer.success:
            raise GripperRefusedError(f"reset refused: {answer.message}")
        self.wait_for(lambda state: state.travel == state.velocity == 0.0, awaited="the start pose")

    def move(self, distance: float, speed: float, *, wait: bool = True) -> None:
        """Move by a distance from where the gripper is now, and come to rest there.

        A velocity that was to be kept up ends first.

        Parameters
        ----------
        distance
            Positive towards the object [m].
        speed
            Largest on the way [m/s]; no more than the node's ``max_velocity``. The ramps have the
            node's ``max_acceleration``.
        wait
            False: return at once.

        Raises
        ------
        GripperError
            It came to rest elsewhere: a travel limit, or someone else commands it.
        InputError
            An argument cannot be used; nothing has been sent.
        """
        distance = quantity(distance, "m", field="distance", source="move")
        self.wait_for_node()
        self._move(self.state.travel + distance, speed, wait)

    def move_to(self, travel: float, speed: float, *, wait: bool = True) -> None:
        """Move to a travel [m]; everything else as for `move`."""
        travel = quantity(travel, "m", field="travel", source="move_to")
        self.wait_for_node()
        self._move(travel, speed, wait)

    def drive(self, velocity: float) -> None:
        """Go at a velocity [m/s, towards the object] until told otherwise, and return at once.

        It is renewed every 20 ms of real time for as long as this program lives: when
        it dies, the gripper stops after the node's ``command_timeout``.

        Raises
        ------
        InputError
            It is not finite; nothing has been sent.
        """
        velocity = quantity(velocity, "m/s", field="velocity", source="drive")
        self.wait_for_node()
        self._sender.drive(velocity)

    def hold(self, duration: float = 0.0) -> None:
        """Come to rest, and stay there for a simulated duration [s]."""
        duration = quantity(duration, "s", field="duration", source="hold", minimum=0.0)
        self.wait_for_node()
        self._sender.stop()
        rest = self.wait_for(lambda state: state.velocity == 0.0, awaited="rest")
        end = rest.stamp + round(1e9 * duration)
        self.wait_for(lambda state: state.stamp >= end, timeout=duration + PATIENCE)

    def wait_for_force(
        self,
        *,
        at_least: float | None = None,
        at_most: float | None = None,
        timeout: float = 10.0,
    ) -> GripperState:
        """Wait until the actuator's force is in a range.

        Parameters
        ----------
        at_least, at_most
            Ends of the range [N]; None: open.
        timeout
            In simulated time [s].

        Returns
        -------
        The first state seen in which it is.
        """
        inside = _range(at_least, at_most, "N", "wait_for_force")
        return self.wait_for(lambda state: inside(state.force), timeout, "the force")

    def wait_for_travel(
        self,
        *,
        at_least: float | None = None,
        at_most: float | None = None,
        timeout: float = 10.0,
    ) -> GripperState:
        """Wait until the travel is in a range [m]; everything else as for `wait_for_force`."""
        inside = _range(at_least, at_most, "m", "wait_for_travel")
        return self.wait_for(lambda state: inside(state.travel), timeout, "the travel")

    def wait_for(
        self,
        condition: Callable[[GripperState], bool],
        timeout: float = 10.0,
        awaited: str = "the condition",
    ) -> GripperState:
        """Wait until a condition on the state holds.

        Parameters
        ----------
        condition
            Asked about each state that this client sees: not every one where they come faster
            than every few milliseconds.
        timeout
            In simulated time [s].
        awaited
            What to call it in an error.

        Returns
        -------
        The first state seen in which it holds.
        """
        timeout = quantity(timeout, "s", field="timeout", source="wait", minimum=0.0)
        self.wait_for_node()
        state = self.state
        end = state.stamp + round(1e9 * timeout)
        while not condition(state):
            if state.stamp >= end:
                raise GripperTimeoutError(
                    f"waited {timeout:g} s for {awaited} in vain, at a travel of "
                    f"{1e3 * state.travel:.4g} mm and a force of {state.force:.4g} N"
                )
            state = self._next_state(state.stamp)
        return state

    def close(self) -> None:
        """Leave ROS, or the program's node.

        A move that is under way goes on to its end, a velocity expires.
        """
        if self._own:
            self._own.stop()
            return
        self._listener.close()
        for client in self._clients.values():
            self._node.destroy_client(client)
        self._sender.close()

    def __enter__(self) -> GripperClient:
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if error is not None and self._node.context.ok():
            self._sender.stop()
            self._sender.flush(1.0)
        self.close()

    def _move(self, target: float, speed: float, wait: bool) -> None:
        speed = quantity(speed, "m/s", field="speed", source="move", minimum=0.0, exclusive=True)
        if self._sender.driving:
            self.hold()
        rate, fastest, acceleration = self._parameters(
            "publish_rate", "max_velocity", "max_acceleration"
        )
        start = self.state
        distance = target - start.travel
        points = trapezoid(start.travel, distance, min(speed, fastest), acceleration, 1.0 / rate)
        if not points:
            return
        sent = time.monotonic()
        self._sender.follow(points, self._listener.slide)
        if wait:
            over = start.stamp + round(1e9 * (points[-1].time + _GRACE))
            self._await_arrival(target, over, sent)

    def _await_arrival(self, target: float, over: int, sent: float) -> None:
        """Wait until the gripper rests at `target` [m]; by the stamp `over` it should."""
        state = self.state
        while state.velocity != 0.0 or abs(state.travel - target) > _ARRIVED:
            late = state.stamp >= over and time.monotonic() > sent + _LATEST
            if late and state.velocity == 0.0:
                raise GripperError(
                    f"stopped at {1e3 * state.travel:.4g} mm on the way to {1e3 * target:.4g} mm"
                )
            state = self._next_state(state.stamp)

    def _next_state(self, stamp: int) -> GripperState:
        """Wait for the first state that has another stamp, which must be later."""
        self._await(lambda: self.state.stamp != stamp, "new state (is it paused?)")
        state = self.state
        if state.stamp < stamp:
            raise GripperError(
                f"time ran back from {1e-9 * stamp:.3f} s to {1e-9 * state.stamp:.3f} s during a "
                f"wait: the clock was set back, or {self._name} has been started anew"
            )
        if self._listener.nodes > 1:
            raise self._several_nodes()
        return state

    def _several_nodes(self) -> GripperError:
        return GripperError(f"several nodes are called {self._name}: end all but one")

    def _parameters(self, *names: str) -> list[float]:
        answer = self._call("get_parameters", GetParameters.Request(names=names))
        return [float(value.double_value) for value in answer.values]

    def _call(self, service: str, request: Any) -> Any:
        client = self._clients[service]
        self._await(client.service_is_ready, f"service {service}")
        future = client.call_async(request)
        self._await(future.done, f"answer from {service}")
        return future.result()

    def _await(
        self, condition: Callable[[], bool], awaited: str, timeout: float | None = None
    ) -> None:
        """Wait for something that the node owes, in real time."""
        timeout = self._patience if timeout is None else timeout
        deadline = time.monotonic() + timeout
        while not condition():
            self._check()
            if time.monotonic() > deadline:
                spun = "" if self._own else " (does an executor spin its client's node?)"
                raise GripperTimeoutError(f"{self._name} gave no {awaited} in {timeout:g} s{spun}")
            time.sleep(_POLL)


def _range(
    at_least: float | None, at_most: float | None, unit: str, source: str
) -> Callable[[float], bool]:
    """Return whether a number is in a range of which at least one end is given."""
    if at_least is None and at_most is None:
        raise InputError("give at_least or at_most", source=source)
    low = (
        -math.inf if at_least is None else quantity(at_least, unit, field="at_least", source=source)
    )
    high = math.inf if at_most is None else quantity(at_most, unit, field="at_most", source=source)
    return lambda value: low <= value <= high
