"""Calls from other threads and signal handlers, carried out by the thread that owns the state."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from queue import Empty, SimpleQueue
from typing import TypeVar

T = TypeVar("T")


class Mailbox:
    """What others want done between two ticks, in the order in which they asked.

    One thread owns all state and calls `serve`; any other may `post` or `ask`. So nothing needs
    a lock, nothing changes in the middle of a tick, and a request waits for at most one tick,
    also where ticks follow each other without a break.
    """

    def __init__(self) -> None:
        # Unlike queue.Queue this one may be used from a signal handler.
        self._calls: SimpleQueue[Callable[[], object] | None] = SimpleQueue()
        self.stopped = False

    def post(self, call: Callable[[], object]) -> None:
        """Have `call` carried out, without waiting for it."""
        self._calls.put(call)

    def ask(self, call: Callable[[], T]) -> T:
        """Have `call` carried out; return what it returns and raise what it raises."""
        answer: Future[T] = Future()

        def run() -> None:
            try:
                answer.set_result(call())
            except Exception as error:
                answer.set_exception(error)

        self._calls.put(run)
        return answer.result()

    def stop(self) -> None:
        """Wake the owner and set `stopped`. Safe in a signal handler."""
        self._calls.put(None)

    def serve(self, timeout: float) -> None:
        """Carry out what has been asked for, and what comes within `timeout` seconds.

        With a timeout of 0 or less this takes what is there now, so a flood cannot hold up the
        owner. Returns early when told to stop.
        """
        for _ in range(self._calls.qsize()):
            self._carry_out(self._calls.get())
        end = time.monotonic() + timeout
        while not self.stopped and (left := end - time.monotonic()) > 0.0:
            try:
                call = self._calls.get(timeout=left)
            except Empty:
                return
            self._carry_out(call)

    def _carry_out(self, call: Callable[[], object] | None) -> None:
        if call is None:
            self.stopped = True
        else:
            call()
