"""The ROS side of the demo: drives the node along a motion, and has it logged."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from hma_gripper_sim.experiment import Segment
from hma_gripper_sim.logs.topics import CMD_VELOCITY, NODE
from hma_gripper_sim.logs.writer import LogWriter
from hma_gripper_sim.node_process import NodeProcess
from hma_gripper_sim.ros.recorder import Recorder

COMMAND_PERIOD = 0.02
"""Time [s] between two commands of the same velocity."""

_POLL = 0.002
"""How often [s] new messages are looked for."""

_ANSWER_TIMEOUT = 10.0
"""How long [s] the node gets for an answer."""

_GRACE = 2_000_000_000
"""Simulated time [ns] that a segment may take on top of twice its duration."""

_ARRIVED = 1e-6
"""How near [m] to a way point the motion counts as there: travel limits end it just short."""


class DemoClient:
    """A client of the simulation node; use it as a context manager.

    Parameters
    ----------
    process
        The node. When it fails, the methods of the client raise `NodeError`.
    """

    def __init__(self, process: NodeProcess) -> None:
        self._process = process
        self._context = Context()
        # Without handlers of its own: Ctrl-C stays a KeyboardInterrupt.
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("hma_gripper_demo", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._command = self._node.create_publisher(Float64, CMD_VELOCITY.name, 1)
        self._recorder = Recorder(self._context)

    def wait_for_node(self, timeout: float) -> None:
        """Wait until the node publishes and takes commands, at most `timeout` [s]."""

        def ready() -> bool:  # the recorder listens to commands, too
            return self._command.get_subscription_count() > 1 and self._recorder.hears_node

        self._wait(ready, timeout, "state")

    def select(self, contour: str) -> None:
        """Go back to the start pose and put an object of the node's catalogue in place."""
        self._call(f"{NODE}/reset")
        self._call(f"{NODE}/select_contour/{contour}")
        self._wait(lambda: self._recorder.contour == contour, _ANSWER_TIMEOUT, "new contour")
        self._wait(lambda: self._recorder.slide == (0.0, 0.0), _ANSWER_TIMEOUT, "start pose")

    def follow(
        self, motion: tuple[Segment, ...], log: LogWriter, progress: Callable[[float], None]
    ) -> None:
        """Command a motion from the start pose, and log everything until it is over.

        The schedule follows what the node reports, not this process's clock: a segment that moves
        is over when its travel has been reached, a hold when its time has passed on the stamps.
        So delays between the processes never add up, at any real-time factor.

        Parameters
        ----------
        motion
            Velocities and durations.
        log
            Where to.
        progress
            Called with the time [s] of the motion, by the stamps.
        """
        begin = self._recorder.stamp
        self._recorder.start(log)
        target = 0.0
        for segment in motion:
            target += segment.velocity * segment.duration
            self._command_until(
                segment, target, lambda: progress((self._recorder.stamp - begin) * 1e-9)
            )
        self._command.publish(Float64(data=0.0))
        self._wait(
            lambda: self._recorder.command == 0.0 and self._recorder.slide[1] == 0.0,
            _ANSWER_TIMEOUT,
            "rest",
        )
        self._recorder.finish()
        self._wait(lambda: self._recorder.finished, _ANSWER_TIMEOUT, "last messages")

    def __enter__(self) -> DemoClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._executor.shutdown()
        self._recorder.close()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def _command_until(self, segment: Segment, target: float, progress: Callable[[], None]) -> None:
        """Repeat a velocity until the travel is `target` [m], or a hold's time has passed."""
        begin = stamp = self._recorder.stamp
        give_up = begin + round(2e9 * segment.duration) + _GRACE
        next_command = stamped_at = time.monotonic()
        while not self._finished(segment, target, begin):
            now = time.monotonic()
            if self._recorder.stamp != stamp:
                stamp, stamped_at = self._recorder.stamp, now
            if stamp > give_up or now > stamped_at + _ANSWER_TIMEOUT:
                travel, _ = self._recorder.slide
                raise self._process.error(
                    f"stopped at {travel * 1e3:.3g} mm on the way to {target * 1e3:.3g} mm"
                )
            if now >= next_command:
                self._command.publish(Float64(data=segment.velocity))
                next_command = now + COMMAND_PERIOD
            self._spin()
            progress()

    def _finished(self, segment: Segment, target: float, begin: int) -> bool:
        if segment.velocity == 0.0:
            return self._recorder.stamp >= begin + round(1e9 * segment.duration)
        left = target - self._recorder.slide[0]
        return (left if segment.velocity > 0.0 else -left) <= _ARRIVED

    def _call(self, service: str) -> None:
        client = self._node.create_client(Trigger, service)
        self._wait(client.service_is_ready, _ANSWER_TIMEOUT, f"service {service}")
        future = client.call_async(Trigger.Request())
        self._wait(future.done, _ANSWER_TIMEOUT, f"answer from {service}")
        answer = future.result()
        self._node.destroy_client(client)
        if not answer.success:
            raise self._process.error(f"refused {service}: {answer.message}")

    def _wait(self, condition: Callable[[], bool], timeout: float, awaited: str) -> None:
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                raise self._process.error(f"gave no {awaited} in {timeout:g} s")
            self._spin()

    def _spin(self) -> None:
        """Take the messages that have arrived, and give services a short while."""
        self._process.check()
        self._recorder.take()
        self._executor.spin_once(timeout_sec=_POLL)
