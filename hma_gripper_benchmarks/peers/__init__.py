"""The other simulators: which there are, and how the same gripper is set up in them.

Each is imported only when it is installed and asked for.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Protocol, cast

from hma_gripper_benchmarks.measuring import Candidate
from hma_gripper_benchmarks.scenes import Task
from hma_gripper_sim.kernels.chain import Chain

# Name: distribution on PyPI, module here.
PEERS = {
    "MuJoCo": ("mujoco", "mujoco_gripper"),
    "Exudyn": ("exudyn", "exudyn_gripper"),
    "scipy": ("scipy", "scipy_gripper"),
}


class Peer(Protocol):
    """What the module of a peer offers."""

    def candidates(self, task: Task, full: bool) -> list[Candidate]:
        """The peer's settings for a task; none where it cannot express it."""

    def cantilever_runs(
        self, chain: Chain, gravity: float, duration: float
    ) -> dict[str, Callable[[], float]]:
        """Runs of a clamped chain to rest, which return the drop of its end [m]."""


def installed_version(name: str) -> str | None:
    """Version of a peer, or None when it is not installed."""
    try:
        return version(PEERS[name][0])
    except PackageNotFoundError:
        return None


def load(name: str) -> Peer:
    """Import the module of an installed peer."""
    return cast(Peer, importlib.import_module(f"{__name__}.{PEERS[name][1]}"))
