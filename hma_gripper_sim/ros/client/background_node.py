"""A ROS node of one's own in a program that has none: context, executor and thread."""

from __future__ import annotations

from threading import Event, Thread

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

_LOOK_UP = 0.1
"""How often the thread looks whether it is to end [s]."""


class OwnNode:
    """A node whose callbacks run in a thread of their own, once it is started.

    Attributes
    ----------
    node
        The node.
    """

    def __init__(self, name: str) -> None:
        self._context = Context()
        # Without handlers of its own: Ctrl-C stays a KeyboardInterrupt.
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(name, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._ending = Event()
        self._thread = Thread(target=self._spin, name=name, daemon=True)

    def start(self) -> None:
        """Handle what comes from now on."""
        self._thread.start()

    def stop(self) -> None:
        """Leave ROS."""
        self._ending.set()
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def _spin(self) -> None:
        while not self._ending.is_set():
            try:
                self._executor.spin_once(timeout_sec=_LOOK_UP)
            except ExternalShutdownException:
                return
