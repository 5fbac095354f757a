"""The simulated gripper as a ROS 2 node, and the program that runs it.

The main thread owns the drive and makes the ticks; a second thread runs the ROS callbacks, which
do nothing but hand requests over (see `hma_gripper_sim.ros.mailbox`). So a tick is never
interrupted, a request takes effect between two ticks, and neither can starve the other. Signals
reach the main thread too: it ends the ticks first, then the callbacks, then ROS, and nothing is
published into a ROS that is already shut down.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from threading import Thread
from typing import Any

import rclpy
from geometry_msgs.msg import WrenchStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, Trigger

from hma_gripper_sim.drive import Drive
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.outcome import SimulationError
from hma_gripper_sim.ros.arguments import initialise_ros, origin
from hma_gripper_sim.ros.mailbox import Mailbox
from hma_gripper_sim.ros.messages import StateMessages
from hma_gripper_sim.ros.parameters import declare_parameters
from hma_gripper_sim.ros.settings import Settings
from hma_gripper_sim.ros.timeline import Timeline
from hma_gripper_sim.scene import Scene
from hma_gripper_sim.simulation import Simulation

STATE_QOS = QoSProfile(depth=100)
"""A recorder that stalls for a tenth of a second at 1 kHz loses nothing."""

LATCHED_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

CLOCK_POLL = 1e-3
"""How often a clock that is not the system's is looked at while waiting [s]."""


class SimNode(Node):
    """Translates between ROS and a `Drive`.

    Parameters
    ----------
    mailbox
        Carries requests to the thread that calls `run`, and tells it to stop.

    Raises
    ------
    InputError
        A parameter cannot be used.
    """

    def __init__(self, mailbox: Mailbox) -> None:
        super().__init__("hma_gripper_sim", automatically_declare_parameters_from_overrides=True)
        self._mailbox = mailbox
        self._settings = settings = declare_parameters(self)
        scene = settings.scenes[settings.contour]
        self._drive = Drive(
            _ready_simulation(scene, settings),
            settings.scenes,
            settings.contour,
            period=settings.period,
            limits=settings.limits,
        )
        self._reported = self._drive.status()
        self._timeline = Timeline(settings.period_ns, settings.real_time_factor)
        self._messages = StateMessages(scene.joint_names)

        self._joint_states = self.create_publisher(JointState, "joint_states", STATE_QOS)
        self._wrench = self.create_publisher(WrenchStamped, "~/actuator_wrench", STATE_QOS)
        self._phi = self.create_publisher(JointState, "~/phi", STATE_QOS)
        self._contour = self.create_publisher(String, "~/contour", LATCHED_QOS)

        self.create_subscription(Float64, "~/cmd_velocity", self._on_velocity, QoSProfile(depth=1))
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(SetBool, "~/pause", self._on_pause)
        for name in settings.scenes:
            self.create_service(Trigger, f"~/select_contour/{name}", partial(self._on_select, name))
        self.add_on_set_parameters_callback(self._on_parameters)

    # What ROS asks for; these run in the executor's thread.

    def _on_velocity(self, message: Float64) -> None:
        self._mailbox.post(partial(self._command, message.data))

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(response, self._drive.reset, "at the start pose")

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        done = "paused" if request.data else "running"
        return self._answer(response, partial(self._drive.pause, request.data), done)

    def _on_select(
        self, name: str, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        result = self.set_parameters([Parameter("contour", value=name)])[0]
        response.success = result.successful
        response.message = result.reason or f"{name} selected"
        return response

    def _on_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        known = self._settings.values
        changes = {item.name: item.value for item in parameters if item.name in known}
        try:
            self._mailbox.ask(partial(self._apply, self._settings.changed(changes)))
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _answer(self, response: Any, call: Callable[[], None], done: str) -> Any:
        try:
            self._mailbox.ask(call)
        except InputError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, done
        return response

    # What the drive does; these run in the thread of `run`, between two ticks.

    def run(self) -> None:
        """Tick until told to stop."""
        self.get_logger().info(f"ready, with the contour {self._settings.contour!r} in place")
        self._publish_contour()
        self._wait_for_clock()
        self._timeline.start(self._now())
        while True:
            self._wait_for_tick()
            if self._mailbox.stopped:
                return
            state = self._drive.tick()
            self._timeline.advance(self._now(), moved=self._drive.running)
            self._messages.fill(state, self._timeline.stamp)
            self._joint_states.publish(self._messages.joint_states)
            self._wrench.publish(self._messages.actuator_wrench)
            self._phi.publish(self._messages.phi)
            self._report()

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _wait_for_clock(self) -> None:
        """A simulated clock stands at 0 until its first message."""
        while not self._mailbox.stopped and self._now() == 0:
            self._mailbox.serve(CLOCK_POLL)

    def _wait_for_tick(self) -> None:
        """Serve requests until the next tick is due, and at least those that are there."""
        simulated_clock = self.get_clock().ros_time_is_active
        while True:
            left = self._timeline.until_due(self._now()) * 1e-9
            self._mailbox.serve(min(left, CLOCK_POLL) if simulated_clock else left)
            if self._mailbox.stopped or self._timeline.until_due(self._now()) <= 0:
                return

    def _command(self, velocity: float) -> None:
        rejection = self._drive.command(velocity)
        if rejection is not None:
            self.get_logger().warning(rejection, throttle_duration_sec=1.0)

    def _apply(self, settings: Settings) -> None:
        """Put new settings into effect, all of them or none."""
        self._drive.configure(
            scenes=settings.scenes,
            contour=settings.contour,
            limits=settings.limits,
            period=settings.period,
        )
        before, self._settings = self._settings, settings
        self._timeline.set_rate(settings.period_ns, settings.real_time_factor)
        if settings.contour != before.contour:
            self._publish_contour()

    def _publish_contour(self) -> None:
        self._contour.publish(String(data=self._settings.contour))

    def _report(self) -> None:
        """Say in the log what the drive has had to correct since the last tick."""
        before, now = self._reported, self._drive.status()
        log = self.get_logger()
        if now.failure and not before.failure:
            log.error(f"the simulation stopped: {now.failure}; ~/reset returns to the start pose")
        if now.timeouts > before.timeouts:
            log.warning("no command within command_timeout: ramping to rest")
        if now.clamps > before.clamps:
            log.warning("command beyond max_velocity: clamped", throttle_duration_sec=1.0)
        if now.at_limit and not before.at_limit:
            log.warning("travel limit reached", throttle_duration_sec=1.0)
        self._reported = now


def _ready_simulation(scene: Scene, settings: Settings) -> Simulation:
    """Return a simulation whose kernels are compiled, before time starts to count."""
    try:
        simulation = Simulation(scene, tolerance=settings.tolerance)
        simulation.step(settings.period, 0.0)
        simulation.reset()
    except SimulationError as error:
        raise InputError(f"cannot be simulated: {error}", field="design") from None
    return simulation


def main(arguments: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM.

    Returns
    -------
    The exit code: 0, also after a signal; 2 when an argument or parameter cannot be used.
    """
    arguments = sys.argv if arguments is None else arguments
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    try:
        _run(arguments)
    except InputError as error:
        source = error.source or origin(error.field, arguments)
        print(f"error: {error.within(source=source)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass  # while starting; once it runs, the node is told instead
    return 0


def _run(arguments: list[str]) -> None:
    initialise_ros(arguments)
    try:
        mailbox = Mailbox()
        node = SimNode(mailbox)
        try:
            with _callbacks(node, mailbox):
                for number in (signal.SIGINT, signal.SIGTERM):
                    signal.signal(number, lambda *_: mailbox.stop())
                node.run()
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


@contextmanager
def _callbacks(node: SimNode, mailbox: Mailbox) -> Iterator[None]:
    """Run the node's callbacks in a thread of their own; requests made meanwhile are served."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    ending: Future = Future()

    def spin() -> None:
        while not ending.done():
            try:
                executor.spin_until_future_complete(ending)
            except Exception as error:
                # A malformed request is its sender's problem, not the end of the node.
                node.get_logger().error(f"a callback failed: {error!r}")

    thread = Thread(target=spin, name="ros_callbacks")
    try:
        thread.start()
        yield
    finally:
        ending.set_result(None)
        while thread.is_alive():
            mailbox.serve(0.0)
            thread.join(0.01)
        executor.shutdown()


if __name__ == "__main__":
    sys.exit(main())
