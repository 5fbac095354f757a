"""Random scenes: drawn again the same, of all kinds, and moved onto their objects."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest

from hma_gripper_benchmarks.population import (
    LONGEST,
    MOTIONS,
    NATURAL,
    POPULATIONS,
    Way,
    plain_tasks,
)
from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD
from hma_gripper_sim import Circle, GripperDesign, Polygon, RoundedBox
from hma_gripper_sim.motion.prescribed_motion import evaluate, follow

SEEDS = range(120)


@pytest.fixture(scope="module", params=list(POPULATIONS))
def population(request):
    return POPULATIONS[request.param]


@pytest.fixture(scope="module")
def drawn(population):
    return [population.draw(seed) for seed in SEEDS]


def test_a_seed_gives_the_same_scene_again(population):
    first, again = population.draw(7), population.draw(7)
    assert first.scene == again.scene
    assert (first.kind, first.as_function, first.duration) == (
        again.kind,
        again.as_function,
        again.duration,
    )
    assert population.draw(8).scene != first.scene


def test_everything_occurs(population, drawn):
    kinds = {one.kind for one in drawn}
    assert kinds == set(NATURAL if population.key == "picks" else MOTIONS)
    contours = {type(one.scene.contour) for one in drawn}
    assert contours >= {Circle, RoundedBox}
    assert {one.scene.offset == 0.0 for one in drawn} == {True, False}
    assert {one.as_function for one in drawn} == {True, False}


def test_the_general_population_varies_the_model_and_the_design():
    drawn = [POPULATIONS["general"].draw(seed).scene for seed in SEEDS]
    assert {scene.contact for scene in drawn} == {"continuous", "sampled"}
    assert {scene.discretisation for scene in drawn} == {"thesis", "midpoint", "gauss"}
    assert any(isinstance(scene.contour, Polygon) for scene in drawn)
    thesis = GripperDesign.thesis_2013()
    assert 0.3 < np.mean([scene.design == thesis for scene in drawn]) < 0.7


def test_an_accuracy_leaves_the_model_open():
    drawn = POPULATIONS["accuracy"].draw(3)
    scene, tolerance = drawn.asking(0.01)
    assert (scene.accuracy, scene.discretisation, tolerance) == (0.01, None, None)
    assert drawn.converged.resolution.elements_beam > scene.resolution.elements_beam


def test_a_motion_leads_onto_the_object_however_it_is_handed_over(drawn):
    # Unless it was cut off before; vibrations may only come near.
    for one in drawn[:40]:
        motion = follow(one.velocity, 0.0, 0.0, one.duration)
        time = np.linspace(0.0, one.duration, 4001)
        travel, velocity, _ = evaluate(motion, time)
        assert one.duration <= LONGEST
        if one.duration < LONGEST:
            assert travel.max() > 0.999 * one.scene.clearance
        assert np.abs(velocity).max() < 0.5


def test_a_function_is_the_declared_motion(drawn):
    for one in drawn[:40]:
        declared = follow(one.motion, 0.0, 0.0, one.duration).travel[-1]
        handed = follow(one.velocity, 0.0, 0.0, one.duration).travel[-1]
        # Jumps that are searched for are located to rounding.
        assert handed == pytest.approx(declared, abs=1e-9)


def test_minimum_jerk_covers_its_way_in_rest_to_rest():
    way = Way(clearance=0.004, depth=0.006, speed=0.01)
    motion, duration = MOTIONS["minimum jerk"](np.random.default_rng(1), way)
    travel = follow(motion, 0.0, 0.0, duration).travel
    assert travel.max() == pytest.approx(way.length, rel=1e-12)
    assert travel[-1] == pytest.approx(0.0, abs=1e-15)


def test_tasks_have_phases_that_are_whole_sample_periods():
    for task in islice(plain_tasks(5.0, lambda scene: scene.contact == "sampled"), 20):
        assert task.scene.contact == "sampled"
        assert task.scene.discretisation != "gauss"
        periods = np.array([duration for duration, _ in task.parts]) / SAMPLE_PERIOD
        np.testing.assert_allclose(periods, np.round(periods), atol=1e-9)
        assert 0.0 < task.duration <= 5.0 + 1e-9
