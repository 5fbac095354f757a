"""Runs all parts of the benchmark."""

from __future__ import annotations

import warnings
from collections.abc import Callable

from hma_gripper_sim.benchmark import (
    cantilever,
    convergence,
    hard_cases,
    holding,
    results,
    scaling,
    startup,
    work_precision,
)
from hma_gripper_sim.benchmark.measuring import use_one_core
from hma_gripper_sim.benchmark.scenes import tasks

ROUNDS, QUICK_ROUNDS = 7, 3
RESOLUTIONS = ((5, 25), (10, 50), (16, 83), (50, 249), (160, 839))
ELEMENTS, QUICK_ELEMENTS = (10, 50, 100, 200, 500), (10, 500)
REDUCED = ("cylinder_continuous", "box_continuous")


def run(full: bool, progress: Callable[[str], None]) -> results.Results:
    """Measure everything; `progress` is told what is being done, often."""
    use_one_core()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that the contact model leaves out
        return _measure(full, progress)


def _measure(full: bool, progress: Callable[[str], None]) -> results.Results:
    rounds = ROUNDS if full else QUICK_ROUNDS
    known = tasks()
    measured = work_precision.measure(known, full, rounds, progress)
    reduced = [
        work_precision.measure_reduced(known[key], full, rounds, progress)
        for key in (REDUCED if full else REDUCED[:1])
    ]
    cantilevers = cantilever.measure(
        ELEMENTS if full else QUICK_ELEMENTS, rounds, lambda: progress("cantilever")
    )
    scaled = scaling.measure(RESOLUTIONS, rounds, lambda: progress("cost per joint"))
    studied = convergence.studies(known, full, lambda: progress("convergence"))
    started = startup.measure(full, rounds, lambda: progress("process start"))
    cases = []
    if full:
        for case in hard_cases.hard_cases():
            progress(case.title)
            cases.append((case, hard_cases.examine(case)))
    return results.Results(
        results.this_machine(),
        full,
        rounds,
        measured,
        reduced,
        holding.measure(known["hold"]),
        cantilevers,
        scaled,
        started,
        studied,
        cases,
    )
