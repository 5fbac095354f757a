"""The judging of errors, with made-up series; and a small sample of random scenes, judged."""

from __future__ import annotations

import dataclasses
import math
import os
import time
from itertools import islice

import numpy as np
import pytest

from hma_gripper_benchmarks import against_dense, asked_error
from hma_gripper_benchmarks.asked_error import (
    Judgement,
    Level,
    PopulationResult,
    Run,
    compare,
    judge,
    near_events,
    time_at,
)
from hma_gripper_benchmarks.population import POPULATIONS, plain_tasks
from hma_gripper_benchmarks.worker import Worker, WorkerError
from hma_gripper_sim import Circle, simulate
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.proximity import point_distance, segment_distance
from hma_gripper_sim.motion.prescribed_motion import evaluate, follow

TIME = np.linspace(0.0, 1.0, 1001)
FORCE = 2.0 * np.sin(2.0 * np.pi * TIME)
GENERAL = POPULATIONS["general"]


def run(force=FORCE, phi=0.0, spent=0.01):
    return Run(None, force, np.full((2, len(TIME)), phi), 1e-4, spent)


def test_the_error_is_the_larger_of_force_and_angle():
    by_force = compare(0, 1e-2, run(FORCE + 0.01), run(FORCE + 0.01), run(), run())
    assert by_force.error == pytest.approx(0.01 / 2.0)
    assert by_force.ratio == pytest.approx(0.5)
    by_angle = compare(0, 1e-2, run(phi=0.03), run(phi=0.03), run(), run())
    assert by_angle.error == pytest.approx(0.03)
    assert by_angle.force_error == 0.0
    assert [by_angle.is_within(times) for times in (1.0, 2.9, 3.1)] == [False, False, True]


def test_ten_times_what_a_picometre_does_to_the_reference_is_no_error():
    moved = run(FORCE + 0.004)  # 0.2 % of the largest force
    found = compare(0, 1e-3, run(FORCE + 0.03), run(FORCE + 0.03), run(), moved)
    assert found.sensitivity == pytest.approx(0.002)
    assert found.is_sensitive
    assert found.is_within(1.0)
    worse = compare(0, 1e-3, run(FORCE + 0.05), run(FORCE + 0.05), run(), moved)
    assert not worse.is_within(10.0)


def test_a_run_is_noisy_when_a_picometre_changes_it_but_not_the_reference():
    found = compare(0, 1e-3, run(), run(FORCE + 0.002), run(), run())
    assert found.is_noisy
    assert not dataclasses.replace(found, noise=4e-4).is_noisy
    assert not dataclasses.replace(found, sensitivity=2e-4).is_noisy  # that is the scene
    failed = Run("STEP_TOO_SMALL", np.empty(0), np.empty((2, 0)))
    assert compare(0, 1e-3, run(), failed, run(), run()).is_noisy


def test_gross_is_a_force_that_is_wrong_altogether():
    assert compare(0, 1e-3, run(0.0 * FORCE), run(0.0 * FORCE), run(), run()).is_gross
    chaotic = run(FORCE + 0.1)
    assert not compare(0, 1e-3, run(0.0 * FORCE), run(), run(), chaotic).is_gross


def test_a_late_jump_is_no_largest_error():
    early = np.where(TIME > 0.5, 1.0, 0.0) + FORCE
    late = np.where(TIME > 0.502, 1.0, 0.0) + FORCE
    found = compare(0, 1e-3, run(late), run(late), run(early), run(early))
    assert found.largest_error < 1e-12
    assert found.force_error > 0.01
    wrong = late + np.where(np.abs(TIME - 0.2) < 1e-4, 0.1, 0.0)
    found = compare(0, 1e-3, run(wrong), run(wrong), run(early), run(early))
    assert found.largest_error == pytest.approx(0.1 / np.abs(early).max())


def test_events_are_jumps_and_kinks_but_not_smooth_motion():
    assert not near_events(FORCE).any()
    kink = np.maximum(0.0, TIME - 0.4)
    assert 400 in np.flatnonzero(near_events(kink))
    assert near_events(kink).sum() <= 8


def test_the_reference_is_the_tightest_that_converges_and_tight_enough():
    asked = (1e-2, 1e-3)
    calls = []

    def one(job):
        calls.append(job)
        if job.reference and job.error < 1e-4:
            return Run("STEP_TOO_SMALL", np.empty(0), np.empty((2, 0)))
        return run()

    coarse, fine = judge(GENERAL, 0, asked, one)
    references = [job for job in calls if job.reference and not job.moved]
    assert [job.error for job in references] == pytest.approx([1e-5, 1e-3 / 30.0, 1e-2 / 30.0])
    assert coarse.is_judged
    assert not fine.is_judged  # 3.3e-4 is no reference for 1e-3
    assert fine.failure is None
    assert Level(1e-3, [fine]).without_reference == 1


def test_a_run_that_ends_early_is_not_judged():
    def one(job):
        return run() if job.reference else Run("TOO SLOW", np.empty(0), np.empty((2, 0)))

    (found,) = judge(GENERAL, 0, (1e-3,), one)
    assert (found.failure, found.error) == ("TOO SLOW", None)
    level = Level(1e-3, [found])
    assert (level.ended_early, level.without_reference) == (1, 0)
    assert math.isnan(level.within(1.0))


def made_up(seed, ratio, spent=0.01, asked=1e-3, sensitivity=0.0):
    error = ratio * asked
    return Judgement(seed, asked, None, spent, 1e-4, error, error, error, sensitivity, 0.0)


def test_a_level_counts_its_scenes():
    level = Level(1e-3, [made_up(0, 0.5), made_up(1, 2.0), made_up(2, 20.0, sensitivity=1e-3)])
    assert level.within(1.0) == pytest.approx(1.0 / 3.0)
    assert level.within(3.0) == pytest.approx(2.0 / 3.0)
    assert (level.sensitive, level.gross, level.noisy) == (1, 0, 0)
    assert level.worst.seed == 1
    assert level.largest_ratio == pytest.approx(2.0)
    assert level.median_ratio == pytest.approx(1.25)


def test_work_is_interpolated_between_runs_that_are_worth_it():
    points = [(1e-2, 1.0), (1e-4, 100.0), (2e-2, 5.0)]  # the last is slower and worse
    assert time_at(1e-3, points) == pytest.approx(10.0)
    assert time_at(1e-1, points) == 1.0
    assert time_at(1e-5, points) == math.inf


def test_work_over_a_population_is_sorted_and_open_where_nothing_was_that_accurate():
    levels = [
        Level(1e-2, [made_up(0, 1.0, 0.002, 1e-2), made_up(1, 1.0, 0.001, 1e-2)]),
        Level(1e-3, [made_up(0, 1.0, 0.02), made_up(1, 5.0, 0.01)]),
    ]
    result = PopulationResult("general", "made up", levels)
    np.testing.assert_allclose(result.work(1e-2), [0.001, 0.002])
    np.testing.assert_allclose(result.work(1e-3), [0.02, math.inf])


def test_a_call_without_a_result_ends_and_the_next_one_works():
    endless = Worker(time.sleep, limit=0.5)
    try:
        with pytest.raises(WorkerError, match="took longer than"):
            endless.call(1e6)
        assert endless.call(0.0) is None
    finally:
        endless.close()
    dying = Worker(os._exit, limit=60.0)
    try:
        with pytest.raises(WorkerError, match="its process ended"):
            dying.call(1)
    finally:
        dying.close()


SAMPLE = range(12)
FOR_CONTACTS = range(20, 32)  # among them one whose touch both ends of a long step conceal


@pytest.mark.parametrize("seed", SAMPLE)
def test_the_error_that_is_asked_for_is_got(seed):
    (found,) = judge(GENERAL, seed, (1e-3,), asked_error.perform)
    assert found.failure is None
    assert found.is_judged
    assert found.is_within(10.0), found


@pytest.mark.filterwarnings("ignore")  # of parts that the contact model leaves out
@pytest.mark.parametrize("seed", FOR_CONTACTS)
def test_no_contact_is_stepped_over(seed):
    # Brute force: the cubic Hermite polynomials of all accepted steps, at 15 instants between
    # their ends. What is open at both ends goes nowhere deeper than to a force of the tolerance.
    tolerance = 1e-2
    drawn = GENERAL.draw(seed)
    trace = simulate(drawn.scene, drawn.velocity, drawn.duration, tolerance)
    motion = follow(drawn.velocity, 0.0, 0.0, drawn.duration)
    scale = max(np.abs(trace.actuator_force).max(), drawn.scene.models[0].bending)
    allowed = tolerance * scale / drawn.scene.normal_stiffness
    sides = ("right",) if drawn.scene.is_symmetric else ("right", "left")
    for side, model in zip(sides, drawn.scene.models, strict=False):
        assert deepest_between(trace._record(side), model, motion) <= allowed


def deepest_between(record, model, motion):
    """Largest depth between the ends of steps at both of which the contact is open [m]."""
    shares = np.linspace(0.0, 1.0, 17)
    deepest = 0.0
    for row in range(1, len(record.time)):
        start, h = record.time[row - 1], record.time[row] - record.time[row - 1]
        q = hermite(shares, h, record.q[row - 1 : row + 1], record.v[row - 1 : row + 1])
        height = -evaluate(motion, start + h * shares)[0]
        ends = [gaps(model, height[k], q[k]) for k in (0, -1)]
        is_open = np.minimum(*ends) > 0.0
        if not is_open.any():
            continue
        between = np.array([gaps(model, height[k], q[k]) for k in range(1, 16)])
        deepest = max(deepest, -between[:, is_open].min())
    return deepest


def hermite(shares, h, q, v):
    s = shares[:, None]
    rise = s * s * (3.0 - 2.0 * s)
    early, late = s * (1.0 - s) ** 2, s * s * (s - 1.0)
    return q[0] + rise * (q[1] - q[0]) + h * (early * v[0] + late * v[1])


def gaps(model, height, q):
    """Gap of each contact candidate [m]."""
    x, z, angle = place_tip(model.chain, -height, np.ascontiguousarray(q))
    points = model.fingertip.points @ [1.0, 1j] * np.exp(1j * angle) + complex(x, z)
    reach = model.obstacle.radius + model.fingertip.radius
    if model.fingertip.capsule:
        ends = (points[0].real, points[0].imag, points[1].real, points[1].imag)
        return np.array([segment_distance(model.obstacle, *ends)[0] - reach])
    return np.array([point_distance(model.obstacle, p.real, p.imag)[0] - reach for p in points])


def is_quickly_solved_and_touches_in_points(scene):
    in_points = scene.contact == "sampled" or isinstance(scene.contour, Circle)
    few = scene.discretisation == "midpoint" and scene.elements_beam <= 12
    return in_points and few and scene.design.joint_damping > 0.0


@pytest.mark.parametrize("number", range(3))
def test_independent_equations_agree_on_random_scenes(number):
    tasks = plain_tasks(4.0, is_quickly_solved_and_touches_in_points)
    found = against_dense.compare(next(islice(tasks, number, None)))
    assert found.failure is None
    # This package asks for 1e-6, Radau for 1e-7 of each step.
    assert found.force_rms < 2e-6
    assert found.phi_rms < 2e-6
