"""The node: what ROS asks of the drive, and the ticks that it makes.

The methods that ROS calls run in the callbacks' thread and do nothing but hand requests over; all
others run in the thread of `SimNode.run`, between two ticks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from geometry_msgs.msg import PolygonStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from hma_gripper_sim.device.arbitration import Arbiter, Command
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.device.request_queue import Mailbox
from hma_gripper_sim.device.settings import OUTLINE, Settings
from hma_gripper_sim.device.tick_schedule import MAX_LAG_NS, MAX_SIMULATED_LAG_NS, Timeline
from hma_gripper_sim.device.topics import OUTLINES, NodeTopic
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.joint_names import SLIDE
from hma_gripper_sim.ros.company import Company
from hma_gripper_sim.ros.inputs import READERS, read_outline
from hma_gripper_sim.ros.listener import Listener
from hma_gripper_sim.ros.message_types import message_type
from hma_gripper_sim.ros.node_clock import NodeClock
from hma_gripper_sim.ros.parameters import refuse_two_clocks, whole_numbers_as_declared
from hma_gripper_sim.ros.publishers import Outputs

CLOCK_POLL = 1e-3
"""How often a clock that is not the system's is looked at while waiting [s]."""


class SimNode:
    """Translates between ROS and a `Drive`.

    Parameters
    ----------
    node
        With the parameters of `settings` declared.
    settings
        At the start.
    drive
        As these settings say.
    mailbox
        Carries requests to the thread that calls `run`, and tells it to stop.
    """

    def __init__(self, node: Node, settings: Settings, drive: Drive, mailbox: Mailbox) -> None:
        self._node = node
        self._log = node.get_logger()
        self._settings = settings
        self._drive = drive
        self._mailbox = mailbox
        self._arbiter = Arbiter(drive, [_source(topic) for topic in READERS])
        self._timeline = Timeline(
            settings.period_ns, settings.real_time_factor, is_clock=settings.publish_clock
        )
        self._clock = NodeClock(node.get_clock())
        self._clock_problem = ""
        self._outputs = Outputs(node, settings)
        self._company = Company(
            node,
            settings.prefix + SLIDE,
            publishes_clock=settings.publish_clock,
            was_published_here=self._outputs.was_published_here,
        )
        self._reported = drive.status()

        for topic in READERS:
            on_command = partial(self._on_command, topic)
            Listener(node, message_type(topic), topic.relative, on_command)
        Listener(node, PolygonStamped, OUTLINES.relative, self._on_outline)
        node.create_service(Trigger, "~/reset", self._on_reset)
        node.create_service(SetBool, "~/pause", self._on_pause)
        node.create_service(Trigger, "~/step", self._on_step)
        for name in (*settings.scenes, OUTLINE):
            on_select = partial(self._on_select, name)
            node.create_service(Trigger, f"~/select_contour/{name}", on_select)
        node.add_pre_set_parameters_callback(whole_numbers_as_declared)
        node.add_on_set_parameters_callback(self._on_parameters)

    # What ROS asks for; these run in the callbacks' thread.

    def _on_command(self, topic: NodeTopic, message: Any, info: Mapping[str, int]) -> None:
        self._company.note_command(topic.relative, info)
        try:
            call = partial(self._take, _source(topic), READERS[topic](message, self._settings))
        except InputError as error:
            call = partial(self._reject, _source(topic), error)
        self._mailbox.post(call)

    def _on_outline(self, message: PolygonStamped, _: Mapping[str, int]) -> None:
        try:
            points = read_outline(message, self._settings)
            settings = self._settings.with_outline(points)
            self._mailbox.ask(partial(self._apply, settings))
        except InputError as error:
            self._log.warning(f"~/outline: {error}", throttle_duration_sec=1.0)
            return
        corners = len(settings.scenes[OUTLINE].contour.core)
        self._log.info(f"~/outline: {len(points)} points, a polygon of {corners} corners")

    def _on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(response, self._reset)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        return self._answer(response, partial(self._pause, request.data))

    def _on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(response, self._step)

    def _on_select(
        self, name: str, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        result = self._node.set_parameters([Parameter("contour", value=name)])[0]
        response.success = result.successful
        response.message = result.reason or f"{name} selected"
        return response

    def _on_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        given = {item.name: item.value for item in parameters}
        changes = {name: given[name] for name in given if name in self._settings.values}
        try:
            refuse_two_clocks(self._settings, use_sim_time=given.get("use_sim_time", False))
            self._mailbox.ask(partial(self._apply, self._settings.changed(changes)))
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _answer(self, response: Any, call: Callable[[], str]) -> Any:
        try:
            response.message = self._mailbox.ask(call)
            response.success = True
        except InputError as error:
            response.success, response.message = False, str(error)
        return response

    # What the drive does; these run in the thread of `run`, between two ticks.

    def run(self) -> None:
        """Tick until told to stop."""
        self._log.info(f"ready, with the contour {self._settings.contour!r} in place")
        self._outputs.publish_contour(self._settings.contour)
        self._wait(lambda: self._clock.now() != 0)
        self._timeline.start(self._clock.now())
        while True:
            self._wait(lambda: self._until_due() <= 0)
            if self._mailbox.stopped:
                return
            begin = time.perf_counter()
            state = self._drive.tick()
            moved = self._drive.running
            self._timeline.advance(self._clock.now(), moved=moved)
            self._outputs.publish_state(state, self._timeline.stamp)
            self._outputs.count_tick(state, time.perf_counter() - begin, moved=moved)
            self._report()
            self._publish_slow()

    def _until_due(self) -> int:
        return self._timeline.until_due(self._clock.now())

    def _wait(self, over: Callable[[], bool]) -> None:
        """Serve requests, at least those that are there, until a condition holds.

        Time may be simulated, and stand still: reports come meanwhile all the same.
        """
        while True:
            simulated = self._clock.simulated
            self._timeline.max_lag = MAX_SIMULATED_LAG_NS if simulated else MAX_LAG_NS
            wait = CLOCK_POLL if simulated else 1e-9 * self._until_due()
            self._mailbox.serve(0.0 if over() else wait)
            if self._mailbox.stopped or over():
                return
            self._publish_slow()

    def _publish_slow(self) -> None:
        problem = self._clock.problem(self._company.clock_publishers)
        if problem and not self._clock_problem:
            self._log.warning(problem)
        self._clock_problem = problem
        self._outputs.publish_slow(
            self._settings, self._drive, self._arbiter, self._timeline, self._clock, self._company
        )

    def _take(self, source: str, command: Command) -> None:
        clock = self._clock.now()
        present = self._timeline.present(clock)
        try:
            self._arbiter.take(source, command, present, max(0, clock - present))
        except InputError as error:
            self._warn(source, error)

    def _reject(self, source: str, error: InputError) -> None:
        self._arbiter.reject(source)
        self._warn(source, error)

    def _warn(self, source: str, error: InputError) -> None:
        self._log.warning(f"~/{source}: {error}; dropped", throttle_duration_sec=1.0)

    def _reset(self) -> str:
        self._drive.reset()
        return "at the start pose"

    def _pause(self, paused: bool) -> str:
        self._drive.pause(paused)
        return "paused" if paused else "running"

    def _step(self) -> str:
        """Make ticks while paused; their states are published like all others."""
        status, count = self._drive.status(), self._settings.step_ticks
        if not status.paused:
            raise InputError("only while paused: call ~/pause with true first", field="step")
        for _ in range(count):
            state = self._drive.step()
            if failure := self._drive.status().failure:
                raise InputError(failure, field="step")
            self._timeline.step(self._clock.now())
            self._outputs.publish_state(state, self._timeline.stamp)
        seconds, nanoseconds = divmod(self._timeline.stamp, 1_000_000_000)
        return f"stamp: {seconds}.{nanoseconds:09d} s, travel: {self._drive.state.travel!r} m"

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
            self._outputs.publish_contour(settings.contour)

    def _report(self) -> None:
        """Say in the log what the drive has had to correct since the last tick."""
        before, now, log = self._reported, self._drive.status(), self._log
        if now.failure and not before.failure:
            log.error(f"the simulation stopped: {now.failure}; ~/reset returns to the start pose")
        if now.timeouts > before.timeouts:
            log.warning("no command within command_timeout: ramping to rest")
        if now.clamps > before.clamps:
            log.warning("command beyond max_velocity: clamped", throttle_duration_sec=1.0)
        if now.at_limit and not before.at_limit:
            log.warning("travel limit reached", throttle_duration_sec=1.0)
        self._reported = now


def _source(topic: NodeTopic) -> str:
    """Return what a topic is called where a source of commands is named."""
    return topic.relative.removeprefix("~/")
