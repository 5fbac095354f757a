"""SIGINT and SIGTERM at random moments of the node's life, from its first line on.

Every time the node has to end with exit code 0, without a traceback, and without leaving shared
memory behind. Before Python has come to the program's first line nobody can catch a signal.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import click

from hma_gripper_sim.ros.node_process import private_ros_domain

PATIENCE = 20.0  # s, to end after a signal
START_PATIENCE = 120.0  # s, where kernels have to be compiled first
COMPILING = 8.0  # s; whoever takes this long to start has compiled kernels, which are then kept
POLL = 0.002  # s
SHARED_MEMORY = Path("/dev/shm")


@dataclass(frozen=True)
class End:
    """How a node ended."""

    signal: str
    moment: float  # s after its first line
    factor: float
    exit_code: int | None  # None: it did not
    traceback: str
    left_behind: list[str]

    @property
    def clean(self) -> bool:
        return self.exit_code == 0 and not self.traceback and not self.left_behind


class Node:
    """A sim_node whose use of shared memory is watched."""

    def __init__(self, factor: float, errors: Path) -> None:
        self._errors = errors
        command = [sys.executable, "-m", "hma_gripper_sim.ros.sim_node", "--ros-args"]
        command += ["-p", f"real_time_factor:={factor}", "-p", "publish_rate:=1000.0"]
        self._before = {file.name for file in SHARED_MEMORY.iterdir()}
        with errors.open("w") as output:
            self._process = subprocess.Popen(command, stderr=output)
        self._used: set[str] = set()

    def wait_for_first_line(self) -> None:
        """Wait until it catches SIGTERM, which Python on its own does not."""
        status = Path(f"/proc/{self._process.pid}/status")
        while True:
            caught = next(s for s in status.read_text().splitlines() if s.startswith("SigCgt"))
            if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
                return
            time.sleep(POLL)

    def wait_until_ready(self) -> None:
        end = time.monotonic() + START_PATIENCE
        while "ready" not in self._errors.read_text():
            assert time.monotonic() < end, "the node has not come up"
            time.sleep(POLL)

    def watch(self, duration: float) -> None:
        """Let it run for a while [s]."""
        end = time.monotonic() + duration
        while time.monotonic() < end:
            self._look()
            time.sleep(POLL)

    def end(self, number: signal.Signals) -> tuple[int | None, str, list[str]]:
        """Send a signal; return exit code, traceback, what is left behind."""
        self._look()
        self._process.send_signal(number)
        end = time.monotonic() + PATIENCE
        while self._process.poll() is None and time.monotonic() < end:
            self._look()
            time.sleep(POLL)
        code = self._process.poll()
        if code is None:
            self._process.kill()
            self._process.wait()
        used = self._used - self._before
        left = {name for name in used if (SHARED_MEMORY / name).exists()}
        if left:  # others may still need it: some is shared by all programs of the machine
            for process in Path("/proc").glob("[0-9]*"):
                left -= shared_memory(process)
        return code, self._errors.read_text().partition("Traceback")[2], sorted(left)

    def _look(self) -> None:
        self._used |= shared_memory(Path(f"/proc/{self._process.pid}"))


def shared_memory(process: Path) -> set[str]:
    """Names of the shared memory and locks of DDS that a process has open."""
    try:
        places = [line.split()[-1] for line in (process / "maps").read_text().splitlines()]
        places += [os.readlink(file) for file in (process / "fd").iterdir()]
    except OSError:
        return set()  # it has ended meanwhile
    names = {place.name for place in map(Path, places) if place.parent == SHARED_MEMORY}
    return {name for name in names if "fastrtps" in name}


def end_at(moment: float, number: signal.Signals, factor: float, folder: Path) -> End:
    """Start a node, and end it so long [s] after its first line."""
    node = Node(factor, folder / "stderr")
    node.wait_for_first_line()
    node.watch(moment)
    return End(number.name, moment, factor, *node.end(number))


def time_to_ready(folder: Path) -> float:
    """How long a node takes from its first line until it ticks [s], with kernels compiled."""
    node = Node(1.0, folder / "stderr")
    node.wait_for_first_line()
    begin = time.monotonic()
    node.wait_until_ready()
    duration = time.monotonic() - begin
    node.end(signal.SIGINT)
    return duration if duration < COMPILING else time_to_ready(folder)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--moments", default=50, show_default=True, help="How many.")
@click.option("--seed", default=0, show_default=True, help="Of the moments.")
def main(moments: int, seed: int) -> None:
    r"""End nodes at random moments and print how they ended, as JSON.

    \b
    Exit code: 0  every one ended cleanly
               1  otherwise
    """
    with private_ros_domain(), TemporaryDirectory() as folder:
        start = time_to_ready(Path(folder))
        chance = random.Random(seed)
        ends = [
            end_at(
                # Evenly over the start, and as long again of running.
                2.0 * start * (i + chance.random()) / moments,
                chance.choice([signal.SIGINT, signal.SIGTERM]),
                chance.choice([0.0, 1.0]),
                Path(folder),
            )
            for i in range(moments)
        ]
    unclean = [vars(end) for end in ends if not end.clean]
    figures = {"moments": moments, "clean": moments - len(unclean), "ready after [s]": start}
    print(json.dumps({**figures, "unclean": unclean}, indent=2))
    sys.exit(bool(unclean))


if __name__ == "__main__":
    main()
