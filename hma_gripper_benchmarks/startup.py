"""How long the first simulated step takes after an installation, and in later processes."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from time import perf_counter

SCRIPT = """
from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
simulation = Simulation(Scene(GripperDesign.thesis_2013(), Circle(radius=0.015)))
simulation.step(0.002, 0.004)
"""
TIMEOUT = 300.0  # s


@dataclass(frozen=True)
class Startup:
    """Wall times from the start of a process to the end of its first step [s].

    Parameters
    ----------
    first
        With nothing compiled yet; None: not measured.
    later
        With the compiled kernels on disk, median.
    """

    first: float | None
    later: float


def measure(compile_too: bool, rounds: int, tick: Callable[[], None]) -> Startup:
    """Start processes; the first with an empty cache of compiled kernels."""
    if not compile_too:
        _start(None)
        tick()
        return Startup(None, _median(None, rounds, tick))
    with tempfile.TemporaryDirectory() as cache:
        first = _start(cache)
        tick()
        return Startup(first, _median(cache, rounds, tick))


def _median(cache: str | None, rounds: int, tick: Callable[[], None]) -> float:
    times = []
    for _ in range(rounds):
        times.append(_start(cache))
        tick()
    return median(times)


def _start(cache: str | None) -> float:
    environment = dict(os.environ)
    if cache is not None:
        environment["NUMBA_CACHE_DIR"] = cache
    start = perf_counter()
    subprocess.run([sys.executable, "-c", SCRIPT], check=True, env=environment, timeout=TIMEOUT)
    return perf_counter() - start
