"""Timing: CPU time on one core, in rounds in which all candidates take turns."""

from __future__ import annotations

import gc
import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median
from time import process_time
from typing import Any

from hma_gripper_benchmarks.series import Series

SHORT = 0.02  # s; runs that take less are repeated within a round until they take as long


@dataclass(frozen=True)
class Candidate:
    """A solver with its settings, ready to run.

    Parameters
    ----------
    solver, setting
        For people.
    run
        What is timed: the simulation up to sampled forces.
    series
        Makes of its result what is compared; not timed.
    """

    solver: str
    setting: str
    run: Callable[[], Any]
    series: Callable[[Any], Series]


def use_one_core() -> int | None:
    """Keep this process on one of its cores; return which, or None where that cannot be done."""
    if not hasattr(os, "sched_setaffinity"):
        return None
    core = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    return core


def interleaved(
    runs: Sequence[Callable[[], Any]], rounds: int, tick: Callable[[], None] = lambda: None
) -> list[float]:
    """Median CPU time of each of `runs` over `rounds` [s]; all have been run before.

    All take turns in every round, so that a machine that slows down slows down all.
    """
    times: list[list[float]] = [[] for _ in runs]
    repeats = [1 for _ in runs]
    for index, run in enumerate(runs):
        spent = _time(run, 1)
        if spent < SHORT:
            repeats[index] = math.ceil(SHORT / max(spent, 1e-6))
        else:
            times[index].append(spent)
        tick()
    for count in range(rounds):
        for run, repeat, spent_in in zip(runs, repeats, times, strict=True):
            if len(spent_in) <= count:
                spent_in.append(_time(run, repeat))
                tick()
    return [median(spent_in) for spent_in in times]


def _time(run: Callable[[], Any], count: int) -> float:
    gc.collect()
    gc.disable()
    try:
        start = process_time()
        for _ in range(count):
            run()
        return (process_time() - start) / count
    finally:
        gc.enable()
