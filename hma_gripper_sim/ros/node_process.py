"""The simulation node as a child process, on a ROS domain that nobody else uses."""

from __future__ import annotations

import os
import random
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from hma_gripper_sim.errors import first_line

_FIRST_PORT, _PORTS_PER_DOMAIN = 7410, 250
"""Port on which the first program of DDS domain 0 takes discovery, and the way to the next."""

_LAST_DOMAIN = 101
"""Beyond it a domain's ports run into those that Linux hands out to other programs."""

_PATIENCE = 10.0
"""How long [s] the node gets to end after a signal."""


class NodeError(RuntimeError):
    """The simulation node did not start, did not do what it was told, or did not end cleanly."""


class NodeProcess:
    """A running ``sim_node``; leaving the context ends it, whatever happened.

    Parameters
    ----------
    parameters
        ROS parameter file.
    output
        File that takes what the node prints.
    """

    def __init__(self, parameters: Path, output: Path) -> None:
        command = [sys.executable, "-m", "hma_gripper_sim.ros.sim_node"]
        command += ["--ros-args", "--params-file", str(parameters)]
        self._output = output
        with output.open("wb") as printed:
            # A session of its own: Ctrl-C in the terminal reaches only this process, which then
            # ends the node in order. The whole environment goes along because ROS wheels need it.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=printed,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    def check(self) -> None:
        """Raise `NodeError` if the node has ended."""
        code = self._process.poll()
        if code is not None:
            raise self.error(f"ended with exit code {code}")

    def error(self, reason: str) -> NodeError:
        """Return an error that gives a reason and the last line that the node printed."""
        lines = self._output.read_text(encoding="utf-8", errors="replace").splitlines()
        last = next((line.strip() for line in reversed(lines) if line.strip()), "no output")
        return NodeError(f"sim_node {reason}: {last} ({self._output})")

    def stop(self) -> None:
        """Interrupt the node; raise `NodeError` unless it then ends in time with exit code 0."""
        self.check()
        self._process.send_signal(signal.SIGINT)
        try:
            code = self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            raise self.error(f"did not end within {_PATIENCE:g} s of SIGINT") from None
        if code != 0:
            raise self.error(f"ended with exit code {code}")

    def __enter__(self) -> NodeProcess:
        return self

    def __exit__(self, *_: object) -> None:
        for ending in (self._process.terminate, self._process.kill):
            if self._process.poll() is not None:
                return
            ending()
            try:
                self._process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                continue


def ros_is_missing(error: ImportError) -> str:
    """Return what to do where the ROS side cannot be imported."""
    return (
        f"ROS 2 is missing ({first_line(error)}): pip install 'hma_gripper_sim[ros]', "
        "or source the setup file of your ROS 2 installation"
    )


@contextmanager
def private_ros_domain() -> Iterator[int]:
    """Keep this process and its children off the network and on a free ROS domain.

    Yields
    ------
    int
        The domain's number.
    """
    domain = _free_domain()
    private = {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    # These would override the discovery range.
    unset = ("ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY", "ROS_DISCOVERY_SERVER")
    before = {name: os.environ.get(name) for name in (*private, *unset)}
    _set_environment({**private, **dict.fromkeys(unset)})
    try:
        yield domain
    finally:
        _set_environment(before)


def _set_environment(values: Mapping[str, str | None]) -> None:
    for name, value in values.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def _free_domain() -> int:
    """Return a random domain that no program on this machine takes part in."""
    for domain in random.sample(range(1, _LAST_DOMAIN + 1), _LAST_DOMAIN):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("", _FIRST_PORT + _PORTS_PER_DOMAIN * domain))
            except OSError:
                continue
            return domain
    raise NodeError("every ROS domain on this machine is in use")
