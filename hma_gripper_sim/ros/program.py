"""The program around the node: ROS, threads, signals, and the order of their end.

The main thread owns the drive and makes the ticks; a second thread runs the ROS callbacks, which
do nothing but hand requests over (see `hma_gripper_sim.device.request_queue`). So a tick is never
interrupted, a request takes effect between two ticks, and neither can starve the other. Signals
reach the main thread too: it ends the ticks first, then the callbacks, then ROS, and nothing is
published into a ROS that is already shut down.
"""

from __future__ import annotations

import gc
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import Event, Thread

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

SIGNALS = (signal.SIGINT, signal.SIGTERM)

LOOK_UP = 0.1
"""How often the callbacks' thread looks whether it is to end [s]."""

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
    _stop_on_signals(mailbox)
    try:
        _run(arguments, mailbox)
    except InputError as error:
        source = error.source or origin(error.field, arguments)
        print(f"error: {error.within(source=source)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        pass  # while the kernels were compiled
    return 0


def _run(arguments: Sequence[str], mailbox: Mailbox) -> None:
    initialise_ros(arguments)
    try:
        node = Node(NODE.strip("/"), automatically_declare_parameters_from_overrides=True)
        try:
            settings = declare_parameters(node)
            mailbox.serve(0.0)
            if mailbox.stopped:
                return
            with _interruptible(mailbox):
                drive = _ready_drive(settings)
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


def _stop_on_signals(mailbox: Mailbox) -> None:
    for number in SIGNALS:
        signal.signal(number, lambda *_: mailbox.stop())


@contextmanager
def _interruptible(mailbox: Mailbox) -> Iterator[None]:
    """Let a signal raise `KeyboardInterrupt` meanwhile: compiling may take a quarter minute.

    The mailbox is told all the same: Python drops what is raised in a finaliser, and would print
    a traceback for it.
    """

    def interrupt(*_: object) -> None:
        _stop_on_signals(mailbox)
        mailbox.stop()
        raise KeyboardInterrupt

    report = sys.unraisablehook
    sys.unraisablehook = lambda dropped: (
        None if dropped.exc_type is KeyboardInterrupt else report(dropped)
    )
    for number in SIGNALS:
        signal.signal(number, interrupt)
    try:
        yield
    finally:
        _stop_on_signals(mailbox)
        sys.unraisablehook = report


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
