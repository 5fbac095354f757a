"""A process that works on one argument at a time, each within a time limit."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

Argument = TypeVar("Argument")
Result = TypeVar("Result")
Item = TypeVar("Item")
Found = TypeVar("Found")

START = 120.0  # s, for a process to come up, compilation included


class WorkerError(RuntimeError):
    """A call that gave no result: it took too long, or its process ended."""


class Worker(Generic[Argument, Result]):
    """Calls a function in a process of its own, which is replaced when a call fails.

    Parameters
    ----------
    function
        Of a module, so that the other process can import it; what it raises ends the process.
    limit
        Of one call [s].
    """

    def __init__(self, function: Callable[[Argument], Result], limit: float) -> None:
        self._function = function
        self._limit = limit
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, self._function), daemon=True)
        self._process.start()
        theirs.close()
        self._ready = False

    def call(self, argument: Argument) -> Result:
        """Return the function's result for an argument.

        Raises
        ------
        WorkerError
            There is none.
        """
        try:
            if not self._ready:
                self._receive(START)
                self._ready = True
            self._connection.send(argument)
            result: Result = self._receive(self._limit)
            return result
        except WorkerError:
            self.close()
            self._start()
            raise

    def _receive(self, limit: float) -> Any:
        if not self._connection.poll(limit):
            raise WorkerError(f"took longer than {limit:g} s")
        try:
            return self._connection.recv()
        except (EOFError, ConnectionResetError):
            raise WorkerError("its process ended") from None

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self._connection.close()


def _serve(connection: Connection, function: Callable[[Any], Any]) -> None:
    connection.send(None)
    while True:
        try:
            argument = connection.recv()
        except EOFError:
            return
        connection.send(function(argument))


def spread(
    work: Callable[[Worker[Argument, Result], Item], Found],
    items: Iterable[Item],
    function: Callable[[Argument], Result],
    limit: float,
    workers: int,
) -> Iterator[Found]:
    """Yield ``work(worker, item)`` for all items as they are done, with so many workers at once."""
    idle: SimpleQueue[Worker[Argument, Result]] = SimpleQueue()
    staff: list[Worker[Argument, Result]] = []

    def one(item: Item) -> Found:
        worker = idle.get()
        try:
            return work(worker, item)
        finally:
            idle.put(worker)

    try:
        for _ in range(workers):
            staff.append(Worker(function, limit))
            idle.put(staff[-1])
        with ThreadPoolExecutor(workers) as pool:
            futures = [pool.submit(one, item) for item in items]
            try:
                for future in as_completed(futures):
                    yield future.result()
            finally:
                for future in futures:
                    future.cancel()
    finally:
        for worker in staff:
            worker.close()
