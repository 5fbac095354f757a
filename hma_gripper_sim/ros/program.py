"""The program around the node: ROS, threads, signals, and the order of their end.

The main thread owns the drive and makes the ticks; a second thread runs the ROS callbacks, which
do nothing but hand requests over (see `hma_gripper_sim.device.request_queue`). So a tick is never
interrupted, a request takes effect between two ticks, and neither can starve the other. Signals
reach the main thread too: it ends the ticks first, then the callbacks, then ROS, and nothing is
published into a ROS that is already shut down.
"""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from threading import Event, Thread
from typing import TypeVar

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.device.request_queue import Mailbox
from hma_gripper_sim.device.settings import Settings
from hma_gripper_sim.device.topics import NODE
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.ros.arguments import initialise_ros, origin
from hma_gripper_sim.ros.node import SimNode
from hma_gripper_sim.ros.parameters import declare_parameters
from hma_gripper_sim.simulation.simulation import Simulation

T = TypeVar("T")

SIGNALS = (signal.SIGINT, signal.SIGTERM)

LOOK_UP = 0.1
"""How often the callbacks' thread looks whether it is to end [s]."""

COMPILING_POLL = 0.02
"""How often the main thread looks whether the kernels are compiled [s]."""

REST = 2e-4
"""How long the callbacks' thread leaves the ticks alone after each round [s]: a flood of messages
costs no ticks, and of commands only the newest counts anyway."""


def run_node(arguments: Sequence[str]) -> int:
    """Run the node until SIGINT or SIGTERM.

    Returns
    -------
    The exit code: 0 after a signal; 2 when an argument or parameter cannot be used.
    """
    mailbox = Mailbox()
    for number in SIGNALS:
        signal.signal(number, lambda *_: mailbox.stop())
    try:
        _run(arguments, mailbox)
    except InputError as error:
        source = error.source or origin(error.field, arguments)
        print(f"error: {error.within(source=source)}", file=sys.stderr)
        return 2
    except _StillCompilingError:
        sys.stderr.flush()
        os._exit(0)  # Python itself could end only once the thread that compiles has
    return 0


class _StillCompilingError(Exception):
    """A signal came while the kernels were compiled."""


def _run(arguments: Sequence[str], mailbox: Mailbox) -> None:
    initialise_ros(arguments)
    try:
        node = Node(NODE.strip("/"), automatically_declare_parameters_from_overrides=True)
        try:
            settings = declare_parameters(node)
            logging.getLogger("hma_gripper_sim").addHandler(_RosLog(node))
            drive = _unless_stopped(lambda: _ready_drive(settings), mailbox)
            gripper = SimNode(node, settings, drive, mailbox)
            gc.freeze()  # what is there now stays: no collection stops a tick to look through it
            with _callbacks(node, mailbox):
                gripper.run()
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


def _ready_drive(settings: Settings) -> Drive:
    """Return a drive whose simulation's kernels are compiled, before time starts to count."""
    try:
        simulation = Simulation(settings.scenes[settings.contour], tolerance=settings.tolerance)
        simulation.step(settings.period, 0.0)
        simulation.reset()
    except SimulationError as error:
        raise InputError(f"cannot be simulated: {error}", field="design") from None
    drive = Drive(
        simulation,
        settings.scenes,
        settings.contour,
        period=settings.period,
        limits=settings.limits,
    )
    drive.validity()
    return drive


def _unless_stopped(call: Callable[[], T], mailbox: Mailbox) -> T:
    """Return what `call` returns, which may take minutes; meanwhile a signal is heard at once.

    It runs in a thread of its own: numba does not expect to be interrupted by a signal.

    Raises
    ------
    _StillCompilingError
        A signal came first. The thread goes on.
    """
    result: Future[T] = Future()

    def run() -> None:
        try:
            result.set_result(call())
        except BaseException as error:
            result.set_exception(error)

    Thread(target=run, name="compiling", daemon=True).start()
    while not result.done():
        mailbox.serve(COMPILING_POLL)
        if mailbox.stopped:
            raise _StillCompilingError
    return result.result()


class _RosLog(logging.Handler):
    """Hands what the library has to say on to the node's log."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self._log = node.get_logger()

    def emit(self, record: logging.LogRecord) -> None:
        self._log.warning(record.getMessage())


@contextmanager
def _callbacks(node: Node, mailbox: Mailbox) -> Iterator[None]:
    """Run the node's callbacks in a thread of their own; requests made meanwhile are served."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    ending = Event()

    def spin() -> None:
        while not ending.is_set():
            try:
                executor.spin_once(LOOK_UP)
            except Exception as error:
                # A malformed request is its sender's problem, not the end of the node.
                node.get_logger().error(f"a callback failed: {error!r}")
            time.sleep(REST)

    thread = Thread(target=spin, name="ros_callbacks")
    try:
        thread.start()
        yield
    finally:
        ending.set()
        while thread.is_alive():
            mailbox.serve(0.0)
            thread.join(0.01)
        executor.shutdown()
