"""Recording a running node until its end, a signal, or a duration."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import rclpy
from rclpy.context import Context
from rclpy.signals import SignalHandlerOptions

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import JOINT_STATES, RECORDED_TOPICS, topic_of
from hma_gripper_sim.replay.simulated_settings import metadata
from hma_gripper_sim.ros.node_process import NodeError
from hma_gripper_sim.ros.recording.parameter_query import ask_parameters
from hma_gripper_sim.ros.recording.topic_logger import TopicLogger

FLUSH_PERIOD = 0.5
"""What was written longer ago than this [s] is there even if this process is killed."""

_POLL = 0.002
"""How often new messages are looked for [s]."""

_LAST_TICK = 1.0
"""How long the rest of the last tick may take to arrive [s]."""

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True)
class Summary:
    """What was recorded.

    Attributes
    ----------
    duration
        By the stamps [s].
    ticks
        Joint states.
    messages
        Of all topics.
    ending
        Why it ended.
    """

    duration: float
    ticks: int
    messages: int
    ending: str


def record(
    path: Path,
    node: str,
    duration: float | None,
    patience: float,
    progress: Callable[[Summary], None],
) -> Summary:
    """Record everything that a node takes and publishes.

    Parameters
    ----------
    path
        The rosbag2 directory to create.
    node
        Full name of the simulation node.
    duration
        How long to record [s], by the stamps; None: until a signal or the node's end.
    patience
        How long to wait for the node [s].
    progress
        Called twice a second.

    Raises
    ------
    NodeError
        The node is not there.
    InputError
        The log cannot be written.
    """
    with _listening(node) as (context, recorder):
        _await_node(recorder, node, patience)
        simulated = metadata(ask_parameters(context, node, patience))
        with (
            _ended_by_signals() as signals,
            LogWriter(path, _topics(node), custom_data=simulated) as log,
        ):
            recorder.start(log)
            begin, flushed = recorder.stamp, time.monotonic()

            def summary(ending: str) -> Summary:
                lasted = (recorder.stamp - begin) * 1e-9
                logged = recorder.logged
                return Summary(lasted, logged[JOINT_STATES], logged.total(), ending)

            ending = ""
            while not ending:
                time.sleep(_POLL)
                recorder.take()
                if signals:
                    ending = signals[0]
                elif recorder.set_back:
                    ending = "the clock was set back"
                elif duration is not None and recorder.stamp - begin >= duration * 1e9:
                    ending = "the duration is over"
                if time.monotonic() >= flushed + FLUSH_PERIOD:
                    log.flush()
                    flushed = time.monotonic()
                    progress(summary(ending))
                    if not ending and not recorder.node_is_there:
                        ending = "the node has ended"
            recorder.finish()
            give_up = time.monotonic() + _LAST_TICK
            while not recorder.finished and time.monotonic() < give_up:
                time.sleep(_POLL)
                recorder.take()
            return summary(ending)


def _topics(node: str) -> list[Topic]:
    return [topic_of(node, topic) for topic in RECORDED_TOPICS]


def _await_node(recorder: TopicLogger, node: str, patience: float) -> None:
    give_up = time.monotonic() + patience
    while not recorder.hears_node:
        if time.monotonic() > give_up:
            raise NodeError(
                f"nothing comes from {node}: within {patience:g} s it has not published its state "
                "(is it running, and with the same ROS_DOMAIN_ID?)"
            )
        time.sleep(_POLL)
        recorder.take()


@contextmanager
def _listening(node: str) -> Iterator[tuple[Context, TopicLogger]]:
    context = Context()
    # Without handlers of its own: until the log is open, Ctrl-C stays a KeyboardInterrupt.
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    recorder = TopicLogger(context, RECORDED_TOPICS, node)
    try:
        yield context, recorder
    finally:
        recorder.close()
        rclpy.try_shutdown(context=context)


@contextmanager
def _ended_by_signals() -> Iterator[list[str]]:
    """Yield a list that signals which end programs are added to, by name, instead."""
    received: list[str] = []
    before = {
        number: signal.signal(number, lambda n, _: received.append(signal.Signals(n).name))
        for number in _SIGNALS
    }
    try:
        yield received
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
