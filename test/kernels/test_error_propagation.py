"""The error that is carried along with a run, against the difference of two runs."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hma_gripper_sim import (
    GripperDesign,
    Polygon,
    RoundedBox,
    Scene,
    ToleranceWarning,
    simulate,
)
from hma_gripper_sim.kernels.error_propagation import clear_error
from hma_gripper_sim.kernels.radau_integrator import Record, integrate_radau
from hma_gripper_sim.kernels.touch import touched_part
from hma_gripper_sim.mechanics.start_pose import copy_state
from hma_gripper_sim.motion.prescribed_motion import follow
from hma_gripper_sim.simulation.simulation import Half

THESIS = GripperDesign.thesis_2013()
LONG = dataclasses.replace(
    THESIS,
    material=dataclasses.replace(THESIS.material, youngs_modulus=8.4e5),
    width=0.0054,
    beam_length=0.0747,
    beam_angle=0.336,
    joint_damping=4.7e-4,
)
"""Long soft beams with little damping, which bounce off the object."""


def final(half, motion, tolerance, state, displaced, error):
    """State and carried error after a motion, with `displaced` added to the angles before."""
    state = copy_state(state)
    state.q[:] += displaced
    rows = 20_000
    record = Record(
        *(np.zeros((rows, *shape)) for shape in ((), *3 * (state.q.shape,), (3,), (3,), (4,)))
    )
    carried = half.run_workspace.error
    clear_error(carried, 1.0)
    carried.angle[:] = error
    half.run_workspace.going[0] = 0.0
    integrate_radau(
        half.model, motion, tolerance, state, record, 1, half.workspace, half.run_workspace
    )
    return state.q, carried.angle.copy()


@pytest.mark.parametrize(
    ("end", "accuracy"),
    [
        pytest.param(0.12, 0.05, id="in free flight"),
        pytest.param(0.13, 0.25, id="after a touch"),
        pytest.param(0.16, 0.25, id="after a bounce with friction"),
    ],
)
def test_it_is_the_difference_of_two_runs(end, accuracy):
    """To first order: what a small displacement of the start makes of the end.

    Of events only the delay of touches is followed, hence the coarser accuracy behind them.
    """
    scene = Scene(LONG, RoundedBox(0.0377, 0.014, 0.00525), friction=0.663, clearance=0.00877)
    half = Half(scene.models[0], scene.start_states[0])
    start = half.run(follow(0.0934, 0.0, 0.0, 0.05), 1e-6).state
    motion = follow(0.0934, 0.0, 0.0, end)
    moved = 1e-7 * np.random.default_rng(1).standard_normal(start.q.size)
    plain, own = final(half, motion, 1e-6, start, 0.0, 0.0)
    _, carried = final(half, motion, 1e-6, start, 0.0, moved)
    other, _ = final(half, motion, 1e-6, start, moved, 0.0)
    difference = np.cumsum(other - plain)
    assert np.abs(difference).max() > 1e-9
    np.testing.assert_allclose(
        np.cumsum(carried - own), difference, atol=accuracy * np.abs(difference).max()
    )


def test_a_stick_keeps_an_error_where_it_is():
    """A tip that sticks cannot creep, so that the error of its place neither grows nor fades."""
    scene = Scene(THESIS, RoundedBox(0.027, 0.05, 0.001), friction=1.3, clearance=0.003)
    half = Half(scene.models[0], scene.start_states[0])
    press = follow([(0.5, 0.008), (3.0, 0.0)], 0.0, 0.0, 3.5)
    state = half.run(follow([(0.5, 0.008), (1.0, 0.0)], 0.0, 0.0, 1.5), 1e-5).state
    assert state.modes.friction[0] == 0
    moved = 1e-7 * np.random.default_rng(2).standard_normal(state.q.size)
    _, own = final(half, press, 1e-5, state, 0.0, 0.0)
    _, carried = final(half, press, 1e-5, state, 0.0, moved)
    grown = np.abs(np.cumsum(carried - own)).max() / np.abs(np.cumsum(moved)).max()
    assert 1e-3 < grown < 10.0


def test_a_run_that_errors_grow_in_is_repeated():
    """A beam snaps through off a box's edge: the instant depends on all errors before."""
    scene = Scene(
        THESIS,
        RoundedBox(0.04334928, 0.04576211, 0.002),
        offset=0.00464146938,
        friction=0.83006134,
        clearance=0.00642765,
        contact="continuous",
    )
    # Up with constant acceleration and down again, all of it before the snap at 4.29 s.
    times, speed = (0.0, 0.32985725, 5.0), 0.00580521767

    def velocity(t):
        return float(np.interp(t, times, (0.0, speed, speed)))

    reference = simulate(scene, velocity, 5.0, 1e-7)
    largest = np.abs(reference.actuator_force).max()
    for tolerance in (1e-3, 1e-4):
        trace = simulate(scene, velocity, 5.0, tolerance)
        error = trace.actuator_force - reference.actuator_force
        assert np.sqrt(np.mean(error**2)) <= tolerance * largest
        assert trace.stats.estimated_error <= tolerance


def test_what_no_repetition_helps_is_said():
    """Impacts without damping multiply errors until the smallest steps do not help."""
    design = dataclasses.replace(LONG, joint_damping=0.0)
    scene = Scene(design, RoundedBox(0.03, 0.03), friction=0.0, contact="sampled")
    with pytest.warns(ToleranceWarning, match="times the tolerance") as caught:
        trace = simulate(scene, 0.05, 2.5, 1e-6)
    (warning,) = (x.message for x in caught if isinstance(x.message, ToleranceWarning))
    assert warning.excess == trace.stats.excess > 1.0
    assert "tolerance" in [finding.name for finding in trace.validity]


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_a_corner_between_two_faces_is_not_passed_over(tolerance):
    """A tip slides off a sharp edge onto the next face within one long step."""
    points = [(-8.2, 4.5), (-4.8, -6.6), (0.6, -11.5), (6.2, -12.9), (8.2, 8.8), (-0.9, 12.9)]
    design = dataclasses.replace(LONG, width=0.0053, beam_length=0.0673, joint_damping=0.07)
    scene = Scene(
        design,
        Polygon(1e-3 * np.array(points)),
        offset=0.0079,
        friction=1.24,
        clearance=0.0095,
        contact="sampled",
    )
    reference = simulate(scene, 0.0024, 11.0, 1e-6).actuator_force
    error = simulate(scene, 0.0024, 11.0, tolerance).actuator_force - reference
    assert np.sqrt(np.mean(error**2)) <= tolerance * np.abs(reference).max()


def test_every_face_and_vertex_is_a_part_of_its_own():
    """A point on a circle around a square meets four faces and four vertices, in turn."""
    scene = Scene(THESIS, RoundedBox(0.02, 0.02, 0.002), contact="sampled")
    model = scene.models[0]
    core = model.obstacle.vertices
    middle = core.mean(axis=0)
    tip = model.fingertip
    parts = []
    for angle in np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False):
        point = middle + 0.03 * np.array([np.cos(angle), np.sin(angle)])
        parts.append(touched_part(tip, model.obstacle, np.r_[point - tip.points[0], 0.0], 0))
    changes = np.count_nonzero(np.diff(np.r_[parts, parts[0]]))
    assert len(set(parts)) == changes == 8
