"""The ROS side of the demo: drives the node along a motion, and has it logged."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.experiments.experiment import Segment
from hma_gripper_sim.ros.client.gripper_client import GripperClient, GripperError
from hma_gripper_sim.ros.node_process import NodeProcess
from hma_gripper_sim.ros.recording.topic_logger import TopicLogger

_POLL = 0.002
"""How often new messages are looked for [s]."""

_ANSWER_TIMEOUT = 10.0
"""How long the node gets for an answer [s]."""

_GRACE = 2.0
"""Simulated time that a segment may take on top of twice its duration [s]."""

_ARRIVED = 1e-6
"""How near to a way point the motion counts as there [m]: travel limits end it just short."""


class DemoClient:
    """A client of the simulation node, and a log of it; use it as a context manager.

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
        self._recorder = TopicLogger(self._context)
        self._gripper = GripperClient(patience=_ANSWER_TIMEOUT, check=self._check)
        self._progress: Callable[[], None] = lambda: None

    def wait_for_node(self, timeout: float) -> None:
        """Wait until the node publishes and takes commands, at most `timeout` [s]."""
        with self._explained():
            self._gripper.wait_for_node(timeout)
        self._wait(lambda: self._recorder.hears_node, timeout, "state")

    def select(self, contour: str) -> None:
        """Go back to the start pose and put an object of the node's catalogue in place."""
        with self._explained():
            self._gripper.reset()
            self._gripper.select(contour)
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
        self._progress = lambda: progress((self._recorder.stamp - begin) * 1e-9)
        target = 0.0
        with self._explained():
            for segment in motion:
                target += segment.velocity * segment.duration
                self._follow_segment(segment, target)
            self._gripper.hold()
        self._progress = lambda: None
        end = self._gripper.state.stamp
        self._wait(lambda: self._recorder.stamp >= end, _ANSWER_TIMEOUT, "last states")
        self._wait(lambda: self._recorder.command == 0.0, _ANSWER_TIMEOUT, "last command")
        self._recorder.finish()
        self._wait(lambda: self._recorder.finished, _ANSWER_TIMEOUT, "last messages")

    def __enter__(self) -> DemoClient:
        return self

    def __exit__(self, *_: object) -> None:
        self._gripper.close()
        self._recorder.close()
        rclpy.try_shutdown(context=self._context)

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Add the last line that the node printed to what the gripper did not do."""
        try:
            yield
        except GripperError as error:
            raise self._process.error(f"did not do as told: {error}") from None

    def _follow_segment(self, segment: Segment, target: float) -> None:
        """Command a velocity until the travel is `target` [m], or a hold's time has passed."""
        timeout = 2.0 * segment.duration + _GRACE
        if segment.velocity == 0.0:
            self._gripper.hold(segment.duration)
            return
        self._gripper.drive(segment.velocity)
        if segment.velocity > 0.0:
            self._gripper.wait_for_travel(at_least=target - _ARRIVED, timeout=timeout)
        else:
            self._gripper.wait_for_travel(at_most=target + _ARRIVED, timeout=timeout)

    def _wait(self, condition: Callable[[], bool], timeout: float, awaited: str) -> None:
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                raise self._process.error(f"gave no {awaited} in {timeout:g} s")
            self._check()
            time.sleep(_POLL)

    def _check(self) -> None:
        """Take the messages that have arrived; raise `NodeError` if no more can come."""
        self._process.check()
        self._recorder.take()
        self._progress()
