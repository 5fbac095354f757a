"""The independently written equations, and that the package's solver solves the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hma_gripper_benchmarks import this_package
from hma_gripper_benchmarks.dense import equations, jacobian, rates
from hma_gripper_benchmarks.peers import scipy_gripper
from hma_gripper_benchmarks.scenes import tasks
from hma_gripper_benchmarks.series import deviation

DATA = Path(__file__).parents[1] / "data"


def in_contact(key):
    """Equations and a moving state of a task in touch, and the base's height."""
    task = tasks()[key]
    system = equations(task.scene, 1e-4)
    candidate = scipy_gripper.candidate(
        replace(task, parts=((1.5, 0.004),)), "Radau", 1e-5, sample_period=0.5
    )
    _, states, _ = candidate.run()
    return system, states[-1], -0.006


def test_the_static_equilibrium_is_a_rest_of_the_equations():
    task = tasks()["cylinder_sampled"]
    system = equations(task.scene, 1e-4)
    angles = np.cumsum(task.scene.start_states[0].q + system.rest)
    acceleration = rates(system, 0.0, 0.0, np.concatenate([angles, np.zeros(31)]))[31:]
    # Of the tip's free fall in a tenth of its length: 1e3 rad/s^2.
    assert np.abs(acceleration).max() < 1e-5


@pytest.mark.parametrize("key", ["cylinder_sampled", "box_sampled", "cylinder_continuous"])
def test_the_jacobian_is_that_of_the_rates(key):
    system, state, height = in_contact(key)
    step = 1e-7
    found = jacobian(system, height, -0.004, state)
    for column in range(state.size):
        change = np.zeros_like(state)
        change[column] = step
        more = rates(system, height, -0.004, state + change)
        less = rates(system, height, -0.004, state - change)
        expected = (more - less) / (2.0 * step)
        # Central differences lose the square of the step and the rounding over the step.
        np.testing.assert_allclose(
            found[:, column], expected, rtol=1e-5, atol=1e-7 * np.abs(found).max()
        )


@pytest.mark.parametrize("key", ["cylinder_sampled", "box_sampled", "cylinder_continuous"])
def test_both_solvers_agree(key):
    # Radau's error at 1e-5 is below 1e-5 of the largest force, ours at 1e-6 below 2e-5.
    task = tasks()[key]
    candidate = scipy_gripper.candidate(task, "Radau", 1e-5)
    mine = this_package.reference_of(task, task.scene, 1e-6)
    found = deviation(candidate.series(candidate.run()), mine)
    assert found.force_rms < 3e-5
    assert found.phi_max < 1e-3
    assert found.moment_rms < 1e-4  # of monotone cubics between the steps, of third order


@pytest.mark.parametrize("key", ["cylinder_sampled", "box_sampled"])
def test_the_reference_is_the_certified_series(key):
    time, force, *_ = np.loadtxt(DATA / f"{key}.csv", delimiter=",", skiprows=1).T
    series = this_package.reference(tasks()[key], full=False)
    error = np.interp(time, series.time, series.force) - force
    # The certified errors are below 1e-6 N; the rest is the solver at tolerance 1e-7 and the
    # interpolation between samples.
    assert np.sqrt(np.mean(error[time > 0.1] ** 2)) < 1e-5 * force.max()
