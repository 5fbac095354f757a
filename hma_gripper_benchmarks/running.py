"""Runs all parts of the benchmark."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial

from hma_gripper_benchmarks import (
    against_dense,
    against_mujoco,
    asked_error,
    cantilever,
    convergence,
    hard_cases,
    holding,
    peers,
    population,
    results,
    scaling,
    startup,
    work_precision,
)
from hma_gripper_benchmarks.measuring import use_one_core
from hma_gripper_benchmarks.scenes import tasks

ROUNDS, QUICK_ROUNDS = 7, 3
RESOLUTIONS = ((5, 25), (10, 50), (16, 83), (50, 249), (160, 839))
ELEMENTS, QUICK_ELEMENTS = (10, 50, 100, 200, 500), (10, 500)
POPULATION = {"general": 300, "picks": 300, "accuracy": 200}  # scenes
QUICK_POPULATION = {"general": 10, "picks": 10}
QUICK_ASKED = (1e-3,)
DENSE, QUICK_DENSE = 30, 2  # scenes
RIVALS, QUICK_RIVALS = 60, 3
REDUCED = ("cylinder_continuous", "box_continuous")


def run(full: bool, progress: Callable[[str], None]) -> results.Results:
    """Measure everything; `progress` is told what is being done, often."""
    populations = _populations(full, progress)
    dense = against_dense.measure(
        DENSE if full else QUICK_DENSE, lambda: progress("random scenes: the reference itself")
    )
    use_one_core()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that the contact model leaves out
        return _measure(full, progress, populations, dense)


def _populations(full: bool, progress: Callable[[str], None]) -> list[asked_error.PopulationResult]:
    found = []
    for key, count in (POPULATION if full else QUICK_POPULATION).items():
        drawn = population.POPULATIONS[key]
        progress(drawn.title)
        asked = drawn.asked if full else QUICK_ASKED
        found.append(asked_error.measure(drawn, count, asked, partial(progress, drawn.title)))
    return found


def _measure(
    full: bool,
    progress: Callable[[str], None],
    populations: list[asked_error.PopulationResult],
    dense: list[against_dense.Difference],
) -> results.Results:
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
    rivals = []
    if peers.installed_version("MuJoCo") is not None:
        rivals = against_mujoco.measure(
            RIVALS if full else QUICK_RIVALS,
            QUICK_ROUNDS if full else 1,
            lambda: progress("random scenes: MuJoCo"),
        )
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
        populations,
        dense,
        rivals,
    )
