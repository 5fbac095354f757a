"""Errors, orders, medians and the exact cantilever."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from hma_gripper_benchmarks.cantilever import PRINTED, exact_deflection, rest_run
from hma_gripper_benchmarks.convergence import order
from hma_gripper_benchmarks.hard_cases import Verdict
from hma_gripper_benchmarks.measuring import interleaved
from hma_gripper_benchmarks.scenes import phases, tasks
from hma_gripper_benchmarks.series import Series, deviation
from hma_gripper_sim.analysis import cantilever_deflection
from hma_gripper_sim.mechanics.outcome import Outcome


def test_deviation_is_relative_to_the_largest_value_of_the_reference():
    time = np.linspace(0.0, 1.0, 101)
    reference = Series(time, 2.0 * time, 0.0 * time, 4.0 * time)
    shifted = Series(time, 2.0 * time + 0.02, 0.0 * time + math.radians(0.5), 4.0 * time - 0.4)
    found = deviation(shifted, reference)
    assert found.force_rms == pytest.approx(0.01)
    assert found.force_max == pytest.approx(0.01)
    assert found.phi_max == pytest.approx(0.5)
    assert found.moment_rms == pytest.approx(0.1)


def test_a_result_that_is_not_finite_is_infinitely_wrong():
    time = np.linspace(0.0, 1.0, 11)
    reference = Series(time, time, time, time)
    broken = Series(time, np.where(time > 0.5, np.nan, time), time, time)
    assert deviation(broken, reference).force_rms == math.inf


def test_order_is_the_slope_in_logarithms():
    sizes = [10.0, 20.0, 40.0]
    assert order(sizes, [3.0 / size**2 for size in sizes]) == pytest.approx(2.0)


def test_candidates_take_turns_and_short_ones_repeat():
    counts = [0, 0]

    def count(index):
        counts[index] += 1

    times = interleaved([lambda: count(0), lambda: count(1) or sum(range(200_000))], rounds=3)
    # Once before it is timed, then often enough to be timed, in each round.
    assert min(counts) > 1 + 3
    assert counts[0] > counts[1]
    assert 0.0 < times[0] < times[1]


def test_phases_hold_their_velocity_until_they_end():
    velocity = phases((2.0, 0.004), (5.0, 0.0))
    assert velocity(0.0) == velocity(1.999) == 0.004
    assert velocity(2.0) == velocity(7.0) == velocity(8.0) == 0.0


def test_the_samples_of_a_task_reach_its_end():
    task = tasks()["hold"]
    assert task.samples[-1] == pytest.approx(task.duration)


@pytest.mark.parametrize("elements", [5, 50, 500])
def test_shooting_gives_the_printed_and_the_solved_deflection(elements):
    exact = exact_deflection(elements)
    assert 1e3 * exact == pytest.approx(PRINTED[elements], abs=0.005)
    assert cantilever_deflection(elements) == pytest.approx(exact, rel=1e-10)


def test_the_loaded_cantilever_comes_to_rest_where_it_is_in_equilibrium():
    # The beam's own weight adds a millionth, the motion has decayed to e^-17.
    assert rest_run(20)() == pytest.approx(exact_deflection(20), rel=1e-5)


def test_a_verdict_names_every_defect():
    verdict = Verdict(Outcome.CONVERGED, 0.03, 0.001, 0.01, False, 1, 0, 0.1)
    assert len(verdict.failures) == 3
    assert Verdict(Outcome.CONVERGED, 0.0, None, 0.0, True, 1, 0, 0.1).failures == ()
    assert Verdict(Outcome.NO_EQUILIBRIUM, None, None, None, True, 0, 0, 0.1).failures == ()


def test_a_chaotic_motion_is_judged_by_its_own_sensitivity():
    chaotic = Verdict(Outcome.CONVERGED, 0.2, 0.3, 0.0, True, 1, 0, 0.1)
    assert chaotic.failures == ()
    worse = dataclasses.replace(chaotic, deviation=0.95)
    assert len(worse.failures) == 1
    unknown = dataclasses.replace(chaotic, sensitivity=math.nan)
    assert len(unknown.failures) == 1
