"""One step of Radau IIA(5), the forces of a state, and whole runs."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from hma_gripper_benchmarks.dense import equations, rates
from hma_gripper_sim.kernels.accelerations import solve_accelerations
from hma_gripper_sim.kernels.base_motion import Motion, Stretch, base_motion
from hma_gripper_sim.kernels.contact_law import CLOSED, OPEN, SLIP_LEFT, STICK
from hma_gripper_sim.kernels.integrator import HalfState
from hma_gripper_sim.kernels.radau import (
    RadauWorkspace,
    guess_first,
    guess_next,
    powers,
    radau_step,
    radau_workspace,
)
from hma_gripper_sim.kernels.radau_contact import solve_dense
from hma_gripper_sim.kernels.radau_integrator import _judge
from hma_gripper_sim.kernels.radau_method import (
    ALPHA_BETA,
    FROM_COMPLEX,
    FROM_REAL,
    GAMMA,
    INVERSE,
    NODES,
    QUADRATURE,
    TO_COMPLEX,
    TO_REAL,
)
from hma_gripper_sim.kernels.stage import Model
from hma_gripper_sim.mechanics.outcome import Outcome
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.start_pose import copy_state
from hma_gripper_sim.model.contours.base import Contour
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.model.contours.rounded_box import RoundedBox
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.motion.prescribed_motion import follow
from hma_gripper_sim.simulation.simulation import Half, Simulation

SPEED = 0.004  # m/s
ACCURACY = 1e-11  # of the steps' iterations, far below the errors that are measured


def lively() -> GripperDesign:
    """The thesis' gripper with little damping: its vibrations take part in the motion."""
    thesis = GripperDesign.thesis_2013()
    return replace(thesis, joint_damping=0.03 * thesis.joint_damping)


def pressed(friction: float, duration: float, **options: object) -> tuple[Scene, HalfState]:
    """A scene, and its right half after it has moved down for a duration [s]."""
    scene = Scene(lively(), Circle(0.015), friction=friction, clearance=0.001, **options)  # type: ignore[arg-type]
    simulation = Simulation(scene, 1e-6)
    simulation.advance(duration, SPEED)
    return scene, copy_state(simulation.snapshot().halves[0])


def accelerate(start: float, duration: float, acceleration: float) -> Motion:
    """Constant acceleration from the speed of `pressed`."""
    travel = SPEED * start
    way = duration * (SPEED + 0.5 * acceleration * duration)
    return Motion(
        np.array([start, start + duration]),
        np.array([travel, travel + way]),
        np.array([[SPEED, acceleration]]),
        np.array([True]),
    )


class End(NamedTuple):
    """Where a sequence of steps arrives."""

    angles: np.ndarray  # of the bodies [rad]
    rates: np.ndarray  # [rad/s]
    load: float  # [N]
    stick: float  # friction force of the acceleration-level constraint [N]


def balance(model: Model, state: HalfState, workspace: RadauWorkspace) -> float:
    """Accelerations and stick forces of a state, into it; returns the load."""
    assert solve_accelerations(
        model,
        workspace.base,
        state.q,
        state.v,
        state.modes,
        state.a,
        workspace.chain,
        workspace.tip,
        workspace.tangent.real,
        workspace.tangent.real_side,
        workspace.contacts.stage,
    )
    state.modes.stick_force[:] = workspace.contacts.stage.friction_force
    return float(workspace.tip.root_force[0])


def run_steps(model: Model, motion: Motion, start: HalfState, steps: int) -> End:
    """Take steps of the same length, contact modes held."""
    state, workspace = copy_state(start), radau_workspace(model)
    h = (motion.time[1] - motion.time[0]) / steps
    base_motion(motion, 0, motion.time[0], workspace.base)
    balance(model, state, workspace)
    load = 0.0
    for i in range(steps):
        t = motion.time[0] + i * h
        if i == 0:
            wrench = workspace.contacts.stage.wrench.copy()
            guess_first(h, state.a, wrench, state.modes, workspace.stages.z, workspace.contacts)
        else:
            guess_next(1.0, workspace.stages.z, workspace.contacts)
        stretch = Stretch(motion, 0, t, h)
        assert radau_step(model, stretch, ACCURACY, 0.4, state.q, state.v, state.modes, workspace)
        state.q[:], state.v[:] = workspace.stages.q[2], workspace.stages.v[2]
        state.a[:] = workspace.stages.a[2]
        base_motion(motion, 0, t + h, workspace.base)
        load = balance(model, state, workspace)
    friction = float(workspace.contacts.stage.friction_force[0])
    return End(np.cumsum(state.q), np.cumsum(state.v), load, friction)


MODES = {
    "rolling in a stick": (3.0, 0.4, 2.0, (CLOSED, STICK)),
    "sliding": (0.3, 0.4, 2.0, (CLOSED, SLIP_LEFT)),
    "free": (0.6, 0.1, -1.0, (OPEN, STICK)),
}


@pytest.mark.parametrize("discretisation", ["thesis", "gauss"])
@pytest.mark.parametrize("name", MODES)
def test_order_of_a_step(name: str, discretisation: str) -> None:
    """Angles, rates, load and stick force at the end of 12 ms of constant acceleration: order 5.

    The vibrations that it excites are followed with the contact's modes held.  From 16 to 64
    steps errors must fall by more than order 4 gives, down to rounding (1e-13 rad and N); an
    index-2 stick force of stage order 3 would fall by 64 only.  `gauss` has hinges that slide.
    """
    friction, duration, acceleration, modes = MODES[name]
    options = {} if discretisation == "thesis" else {"elements_top": 2, "elements_beam": 4}
    scene, state = pressed(friction, duration, discretisation=discretisation, **options)
    assert (state.modes.normal[0], state.modes.friction[0]) == modes
    motion = accelerate(duration, 0.012, acceleration)
    coarse, fine, exact = (run_steps(scene.models[0], motion, state, n) for n in (16, 64, 512))
    for field in End._fields:
        before, after, true = (np.asarray(getattr(end, field)) for end in (coarse, fine, exact))
        error, smaller = np.abs(before - true).max(), np.abs(after - true).max()
        assert smaller <= max(error / 4.0**4, 1e-12), field
    assert np.abs(coarse.rates - exact.rates).max() > 1e-9  # there is something to be seen


@pytest.mark.parametrize("duration", [0.1, 0.4], ids=["free", "in contact"])
def test_accelerations_of_a_state(duration: float) -> None:
    """Against Lagrange's equations in absolute angles, dense; friction regularised.

    Both are exact; the differences are rounding, larger by the condition of the mass matrix.
    """
    scene, state = pressed(0.6, duration, slip_velocity=1e-3)
    assert state.modes.normal[0] == (OPEN if duration < 0.2 else CLOSED)
    model, workspace = scene.models[0], radau_workspace(scene.models[0])
    workspace.base[:] = -SPEED * duration, -SPEED, 0.0
    state.v[:] += np.random.default_rng(1).normal(scale=1e-3, size=len(state.v))  # rad/s
    state.a[:] = 0.0
    balance(model, state, workspace)
    angles = np.cumsum(model.chain.rest + state.q)
    expected = rates(
        equations(scene, 1e-3),
        workspace.base[0],
        workspace.base[1],
        np.concatenate((angles, np.cumsum(state.v))),
    )[len(angles) :]
    np.testing.assert_allclose(np.cumsum(state.a), expected, atol=1e-6 * np.abs(expected).max())


def test_stick_of_a_state_does_not_start_to_slip() -> None:
    """With the accelerations of a rolling stick the slip changes with the square of time only.

    The state is moved on by dt and 2 dt; what is linear in dt must vanish against the change
    that the same state has with the contact's accelerations left out.
    """
    scene, state = pressed(3.0, 0.4)
    model, workspace = scene.models[0], radau_workspace(scene.models[0])

    def slip_after(dt: float, accelerations: np.ndarray) -> float:
        moved = copy_state(state)
        moved.q[:] += dt * state.v + 0.5 * dt * dt * accelerations
        moved.v[:] += dt * accelerations
        workspace.base[:] = -SPEED * (0.4 + dt) - dt * dt, -SPEED - 2.0 * dt, -2.0
        balance(model, moved, workspace)
        return float(workspace.contacts.stage.slip[0])

    workspace.base[:] = -SPEED * 0.4, -SPEED, -2.0
    balance(model, state, workspace)
    dt = 1e-6
    nothing = np.zeros_like(state.a)
    slopes = []
    for accelerations in (state.a, nothing):
        start, once, twice = (slip_after(x, accelerations) for x in (0.0, dt, 2.0 * dt))
        slopes.append((4.0 * once - twice - 3.0 * start) / (2.0 * dt))
    rate, still = slopes
    assert abs(rate) < 1e-5 * abs(still)


def test_collocation_polynomial() -> None:
    """The slope of a step's angles is their rate at each stage."""
    scene, state = pressed(3.0, 0.4)
    model, workspace = scene.models[0], radau_workspace(scene.models[0])
    motion, h = accelerate(0.4, 0.01, 2.0), 1e-3
    guess_first(h, state.a, state.wrench, state.modes, workspace.stages.z, workspace.contacts)
    stretch = Stretch(motion, 0, 0.4, h)
    assert radau_step(model, stretch, 1e-9, 0.4, state.q, state.v, state.modes, workspace)
    for j, before in enumerate(state.v):
        angle = Polynomial([0.0, *powers(*workspace.stages.z[:, j])])  # beyond going on at `before`
        np.testing.assert_allclose(angle(NODES), workspace.stages.z[:, j], atol=1e-14)
        slope = before + angle.deriv()(NODES) / h
        np.testing.assert_allclose(slope, workspace.stages.v[:, j], atol=1e-11)


def test_no_step_is_too_short_for_an_absurd_force() -> None:
    """One whose load is off by more than the largest force so far is refused, whatever its share.

    The error of a short step counts little; a flip at a corner once left 26 kN in one of 40 ns.
    """
    scene, state = pressed(0.3, 0.4)
    stages = radau_workspace(scene.models[0]).stages
    before = float(state.load[0])
    stages.load[:] = before
    error, _ = _judge(scene.models[0], 4e-8, 1e-2, state, stages)
    assert error < 1.0
    stages.load[:] = before - 2.0, before - 0.1, before - 3.0  # N; the largest so far is below 1 N
    assert state.force_scale[0] < 1.0
    error, _ = _judge(scene.models[0], 4e-8, 1e-2, state, stages)
    assert error == np.inf


def test_coefficients() -> None:
    """Collocation is exact for polynomials of the stage order, the quadrature to degree 4.

    And the eigenvectors split the method's matrix into one real and one complex equation.
    """
    for power in (1, 2, 3):
        np.testing.assert_allclose(INVERSE @ NODES**power, power * NODES ** (power - 1), atol=1e-13)
    for power in range(5):
        assert QUADRATURE @ NODES**power == pytest.approx(1.0 / (power + 1), abs=1e-14)
    vector = np.array([0.3, -1.1, 0.7])
    split = FROM_REAL * GAMMA * (TO_REAL @ vector)
    split = split + (FROM_COMPLEX * ALPHA_BETA * (TO_COMPLEX @ vector)).real
    np.testing.assert_allclose(split, INVERSE @ vector, atol=1e-13)


def test_dense_solution() -> None:
    """Against numpy, with pivots that must be searched for; a singular matrix is noticed."""
    rng = np.random.default_rng(1)
    matrix, vector = rng.normal(size=(9, 9)), rng.normal(size=9)
    matrix[0, 0] = 0.0
    expected = np.linalg.solve(matrix, vector)
    assert solve_dense(matrix.copy(), vector)
    np.testing.assert_allclose(vector, expected, rtol=1e-10)
    assert not solve_dense(np.zeros((2, 2)), np.ones(2))


@pytest.mark.parametrize(
    ("contour", "contact"),
    [
        (Circle(0.015), "continuous"),
        (Circle(0.015), "sampled"),
        (RoundedBox(0.028, 0.028), "sampled"),
    ],
    ids=["circle", "circle, sampled", "box, sampled along the tip's normals"],
)
def test_run_against_the_second_order_method(contour: Contour, contact: str) -> None:
    """Approach, touch, slide and hold: angles, load and work of both integrators agree.

    SDIRK2 at 1e-6 is good to about 1e-6 of the largest force, Radau at 1e-6 much better.
    """
    scene = Scene(
        GripperDesign.thesis_2013(),
        contour,
        clearance=0.001,
        contact=contact,
        discretisation="thesis" if contact == "sampled" else "gauss",
    )
    motion = follow(lambda t: SPEED if t < 0.4 else 0.0, 0.0, 0.0, 0.5)
    ticking, running = (Half(scene.models[0], scene.start_states[0]) for _ in range(2))
    assert ticking.tick(motion, 1e-6) is Outcome.CONVERGED
    assert running.run(motion, 1e-6).outcome is Outcome.CONVERGED
    old, new = ticking.state, running.state
    assert new.counts[0] < old.counts[0] / 2
    assert new.modes.normal.tolist() == old.modes.normal.tolist()
    assert max(old.modes.normal) == CLOSED
    np.testing.assert_allclose(new.load, old.load, atol=1e-5 * old.force_scale[0])
    np.testing.assert_allclose(np.cumsum(new.q), np.cumsum(old.q), atol=1e-6)
    np.testing.assert_allclose(new.work, old.work, atol=1e-4 * np.abs(old.work).max())
