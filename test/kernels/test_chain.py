"""The chain's dynamics and statics against formulations written independently of the kernels."""

from __future__ import annotations

import cmath
import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.kernels.chain import (
    Chain,
    chain_workspace,
    eliminate,
    place,
    substitute,
    tip_response,
)

G = 9.81
LINE = 980.0 * 4e-3 * 7e-3  # kg/m
STIFFNESS = 8.9e6 * 7e-3 * 4e-3**3 / 12.0  # E I, N m^2
TIP_MASS, TIP_CENTRE, TIP_INERTIA = 0.76832e-3, (8.808687272 - 2.331376882j) * 1e-3, 2.0395151e-8
CAPSULE = (6.564971157e-3 - 8.606601718e-3j, 15.185795662e-3 + 0.014222786e-3j)


def bar(length: float) -> tuple[float, float]:
    """Mass and inertia of a piece of beam."""
    mass = LINE * length
    return mass, mass * (length**2 + 4e-3**2) / 12.0


@dataclass
class Lagrange:
    """Half a gripper in absolute angles: M(t) t'' = generalised forces, dense and plain.

    Complex numbers are vectors (x + i z).  Body i turns about its joint; joints follow each
    other by `link`, turned with the body before.
    """

    root: complex
    mass: np.ndarray
    inertia: np.ndarray
    centre: np.ndarray
    link: np.ndarray
    rest: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray

    def directions(self, theta: np.ndarray) -> np.ndarray:
        """d(centre of gravity i)/d(theta j) / i, shape (n, n)."""
        n = len(theta)
        turn = np.exp(1j * theta)
        rows = np.tril(np.tile(self.link * turn, (n, 1)), -1)
        rows[np.diag_indices(n)] = self.centre * turn
        return rows

    def acceleration(
        self, theta: np.ndarray, omega: np.ndarray, base: float
    ) -> tuple[np.ndarray, float]:
        """Angular accelerations and the vertical force of the half on the base, base'' upwards."""
        arms = self.directions(theta)
        jacobian = 1j * arms
        mass_matrix = np.real(jacobian.conj().T @ (self.mass[:, None] * jacobian))
        mass_matrix += np.diag(self.inertia)
        bias = -arms @ omega**2 + 1j * base
        torque = -self.stiffness * (np.diff(theta, prepend=0.0) - self.rest)
        torque -= self.damping * np.diff(omega, prepend=0.0)
        generalised = torque - np.append(torque[1:], 0.0)
        generalised -= np.real(jacobian.conj().T @ (self.mass * (bias + 1j * G)))
        alpha = np.linalg.solve(mass_matrix, generalised)
        vertical = (jacobian @ alpha + bias).imag
        return alpha, -float(self.mass @ (vertical + G))

    def energy_gradient(self, theta: np.ndarray) -> np.ndarray:
        """Gradient of spring and gravity energy to the absolute angles."""
        torque = self.stiffness * (np.diff(theta, prepend=0.0) - self.rest)
        lift = np.real((1j * self.directions(theta)).conj().T @ (self.mass * 1j * G))
        return np.asarray(torque - np.append(torque[1:], 0.0) + lift)


def thesis_half(top: int, beam: int, damping: float = 0.01) -> Lagrange:
    """The right half of thesis 3.2 with any number of GBEs, from its text."""
    first, second = 10.5e-3 / top, 43e-3 / beam
    pieces = [bar(first)] * top + [bar(second)] * beam + [(TIP_MASS, TIP_INERTIA)]
    centre = [first / 2 + 0j] * top + [second / 2 + 0j] * beam + [TIP_CENTRE]
    link = [first + 0j] * (top - 1) + [first - 2e-3 - 2e-3j] + [second + 0j] * beam + [0j]
    rest = np.zeros(top + beam + 1)
    rest[top] = -math.radians(83.0)
    lengths = np.array([first] * top + [second] * (beam + 1))
    return Lagrange(
        first / 2 + 0j,
        np.array([mass for mass, _ in pieces]),
        np.array([inertia for _, inertia in pieces]),
        np.array(centre),
        np.array(link),
        rest,
        STIFFNESS / lengths,
        np.full(len(rest), damping),
    )


def midpoint_half(damping: float = 0.01) -> Lagrange:
    """Right half with joints in the middle of 1 + 2 GBEs, from its definition.

    Top beam: joint at 5.25 mm, then rigid to its end at 11.55 mm and round the corner at
    9.55 mm, 2 mm below, down the first quarter of the beam; joints at 1/4 and 3/4 of it.
    """
    quarter = 43e-3 / 4
    down = cmath.exp(-1j * math.radians(83.0))
    flange, flange_inertia = bar(6.3e-3)
    stub, stub_inertia = bar(quarter)
    stub_centre = 4.3e-3 - 2e-3j + 0.5 * quarter * down
    corner = flange + stub
    corner_centre = (flange * 3.15e-3 + stub * stub_centre) / corner
    corner_inertia = flange_inertia + flange * abs(3.15e-3 - corner_centre) ** 2
    corner_inertia += stub_inertia + stub * abs(stub_centre - corner_centre) ** 2
    half, half_inertia = bar(2 * quarter)
    end = stub + TIP_MASS
    tip_centre = quarter + TIP_CENTRE
    end_centre = (stub * 0.5 * quarter + TIP_MASS * tip_centre) / end
    end_inertia = stub_inertia + stub * abs(0.5 * quarter - end_centre) ** 2
    end_inertia += TIP_INERTIA + TIP_MASS * abs(tip_centre - end_centre) ** 2
    lengths = np.array([10.5e-3, 2 * quarter, 2 * quarter])
    return Lagrange(
        5.25e-3 + 0j,
        np.array([corner, half, end]),
        np.array([corner_inertia, half_inertia, end_inertia]),
        np.array([corner_centre, quarter, end_centre]),
        np.array([4.3e-3 - 2e-3j + quarter * down, 2 * quarter, 0]),
        np.array([0.0, -math.radians(83.0), 0.0]),
        STIFFNESS / lengths,
        damping * 1.72e-3 / lengths,
    )


def far_away(design: GripperDesign, **options: object) -> Scene:
    """A scene whose object is out of reach."""
    return Scene(design, Circle(0.001), clearance=0.5, **options)  # type: ignore[arg-type]


def small_designs(damping: float) -> list[tuple[Scene, Lagrange, float]]:
    """Scenes of 3 to 5 bodies per half, their independent models and middle masses [kg]."""
    thesis = GripperDesign.thesis_2013()
    cases = []
    for top, beam in ((1, 1), (2, 2)):
        design = dataclasses.replace(
            thesis, top_elements=top, beam_elements=beam, joint_damping=damping
        )
        cases.append((far_away(design), thesis_half(top, beam, damping), LINE * 10.5e-3 / top))
    # The corner stays where 5 GBEs put it: the discretisation does not change the gripper.
    design = dataclasses.replace(thesis, joint_damping=damping)
    scene = far_away(design, discretisation="midpoint", elements_top=1, elements_beam=2)
    cases.append((scene, midpoint_half(damping), LINE * 10.5e-3))
    return cases


def right_angles(scene: Scene, values: np.ndarray) -> np.ndarray:
    """Right half's joints of a joint array, in the order of the chain."""
    index = {name: i for i, name in enumerate(scene.joint_names)}
    names = [
        "tip_right" if part == "tip" else f"{part}_right_{number}"
        for part, number in scene.half.joints
    ]
    return values[[index[name] for name in names]]


@pytest.mark.parametrize("damping", [1e-5, 0.01])
@pytest.mark.parametrize("case", [0, 1, 2])
def test_shaken_chain_against_lagrange(case: int, damping: float) -> None:
    """A gripper shaken at 5 m/s^2: angles, rates and actuator force after every ramp.

    Reference: Lagrange's equations in absolute angles with a dense mass matrix, scipy's LSODA at
    1e-10.  At a damping of 1e-5 N m s/rad the chain swings freely and inertia and Coriolis terms
    decide; it turns by a degree or more.  Tolerance 1e-7 per step of a second-order method leaves
    about 1e-5 of the largest values after some hundred steps.
    """
    scene, model, middle = small_designs(damping)[case]
    simulation = Simulation(scene, tolerance=1e-7)
    n = len(model.mass)
    theta = np.cumsum(model.rest)
    theta = root(model.energy_gradient, theta, tol=1e-14).x
    y = np.concatenate([theta, np.zeros(n)])
    start = right_angles(scene, simulation.state().joint_position)
    np.testing.assert_allclose(np.cumsum(start + model.rest), theta, rtol=0.0, atol=1e-9)

    velocity, turned, worst_angle, worst_rate, worst_force = 0.0, 0.0, 0.0, 0.0, 0.0
    largest_rate, largest_force = 0.0, 0.0
    for target in (0.1, -0.1, 0.1, 0.0, 0.0):
        ramp = 0.04
        base = -(target - velocity) / ramp  # upwards

        def rates(_: float, y: np.ndarray, base: float = base) -> np.ndarray:
            return np.concatenate([y[n:], model.acceleration(y[:n], y[n:], base)[0]])

        y = solve_ivp(rates, (0.0, ramp), y, method="LSODA", rtol=1e-10, atol=1e-12).y[:, -1]
        simulation.step(ramp, target)
        velocity = target
        state = simulation.state()
        angles = np.cumsum(right_angles(scene, state.joint_position) + model.rest)
        omega = np.cumsum(right_angles(scene, state.joint_velocity))
        force = 2.0 * model.acceleration(y[:n], y[n:], base)[1] - middle * (base + G)
        worst_angle = max(worst_angle, np.abs(angles - y[:n]).max())
        worst_rate = max(worst_rate, np.abs(omega - y[n:]).max())
        worst_force = max(worst_force, abs(state.actuator_force - force))
        turned = max(turned, np.abs(y[:n] - theta).max())
        largest_rate = max(largest_rate, np.abs(y[n:]).max())
        largest_force = max(largest_force, abs(force))
    assert turned > math.radians(0.5 if damping < 1e-4 else 0.01)
    assert worst_angle < 1e-4 * turned
    assert worst_rate < 1e-3 * largest_rate
    assert worst_force < 1e-3 * largest_force


def test_hanging_gripper_is_in_equilibrium() -> None:
    """All 62 joint angles under gravity minimise the potential energy; the force is the weight.

    Reference: the gradient of spring and gravity energy in absolute angles, solved by scipy.
    """
    model = thesis_half(5, 25)
    theta = root(model.energy_gradient, np.cumsum(model.rest), tol=1e-14).x
    wanted = np.diff(theta, prepend=0.0) - model.rest
    scene = far_away(GripperDesign.thesis_2013())
    state = Simulation(scene).state()
    np.testing.assert_allclose(
        right_angles(scene, state.joint_position), wanted, rtol=0.0, atol=1e-12
    )
    weight = (2.0 * model.mass.sum() + LINE * 2.1e-3) * G
    assert state.actuator_force == pytest.approx(-weight, rel=1e-12)
    assert state.actuator_force == pytest.approx(-0.0444427, abs=1e-7)


def test_pressed_gripper_is_in_equilibrium() -> None:
    """Pressed on a frictionless cylinder and held: the pose minimises the potential energy.

    Energy of springs, gravity and the contact's penalty k n^2 / 2 of a capsule on a circle, with
    its gradient in absolute angles, solved by scipy while the gripper is lowered step by step.
    The simulation lowers it by 8 mm and waits until nothing moves.
    """
    model = thesis_half(5, 25)
    radius, clearance, travel, stiffness = 0.015, 0.005, 0.008, 1e4
    scene = Scene(GripperDesign.thesis_2013(), Circle(radius), friction=0.0, clearance=clearance)
    centre = complex(*scene.object_position)

    def gradient(theta: np.ndarray, lowered: float) -> np.ndarray:
        turn = np.exp(1j * theta)
        last = model.root - 1j * lowered + (model.link * turn)[:-1].sum()
        a, b = (last + end * turn[-1] for end in CAPSULE)
        share = np.clip(((centre - a) * (b - a).conjugate()).real / abs(b - a) ** 2, 0.0, 1.0)
        point = a + share * (b - a)
        depth = radius + 2e-3 - abs(point - centre)
        force = max(0.0, stiffness * depth) * (point - centre) / abs(point - centre)
        arms = np.append((model.link * turn)[:-1], point - last)
        return model.energy_gradient(theta) - np.real((1j * arms).conj() * force)

    theta = np.cumsum(model.rest)
    for lowered in (0.0, 0.004, 0.005, 0.0055, 0.006, 0.0065, 0.007, 0.0075, travel):
        solution = root(gradient, theta, args=(lowered,), tol=1e-13)
        theta = solution.x
    assert np.abs(gradient(theta, travel)).max() < 1e-12

    simulation = Simulation(scene)
    simulation.step(0.1, 0.004)
    simulation.step(1.9, 0.004)
    simulation.step(0.1, 0.0)
    simulation.step(30.0, 0.0)
    state = simulation.state()
    assert simulation.travel == pytest.approx(travel, abs=1e-12)
    wanted = np.diff(theta, prepend=0.0) - model.rest
    np.testing.assert_allclose(
        right_angles(scene, state.joint_position), wanted, rtol=0.0, atol=1e-7
    )


def random_chain(
    rng: np.random.Generator, n: int, stiffness: np.ndarray, straightening: np.ndarray
) -> Chain:
    """Bodies of a centimetre and some ten grams, without damping."""
    return Chain(
        root=rng.normal(size=2) * 0.01,
        link=rng.normal(size=(n, 2)) * 0.01,
        centre=rng.normal(size=(n, 2)) * 0.005,
        rest=rng.normal(size=n),
        mass=rng.uniform(0.01, 0.1, size=n),
        inertia=rng.uniform(1e-6, 1e-5, size=n),
        stiffness=stiffness,
        damping=np.zeros(n),
        straightening=straightening,
    )


def test_newton_step_of_a_random_chain() -> None:
    """One sweep in and out solves the linearised balance of every joint exactly.

    For statics the balance is k q = moment of all outer loads.  Its derivative to the joint
    angles is built here by central differences and solved densely.
    """
    rng = np.random.default_rng(3)
    n = 6
    chain = random_chain(rng, n, stiffness=rng.uniform(0.5, 1.0, size=n), straightening=np.zeros(n))
    q = rng.normal(size=n) * 0.1
    wrench = rng.normal(size=3) * (0.5, 0.5, 0.005)

    def imbalance(q: np.ndarray) -> np.ndarray:
        theta = np.cumsum(chain.rest + q)
        turn = np.exp(1j * theta)
        link = turn * (chain.link[:, 0] + 1j * chain.link[:, 1])
        joints = np.concatenate([[0.0], np.cumsum(link)[:-1]])
        centres = joints + turn * (chain.centre[:, 0] + 1j * chain.centre[:, 1])
        moments = np.empty(n)
        for i in range(n):
            weight = -chain.mass[i:] @ (centres[i:] - joints[i]).real * G
            arm = joints[-1] - joints[i]
            moments[i] = weight + arm.real * wrench[1] - arm.imag * wrench[0] + wrench[2]
        return np.asarray(moments - chain.stiffness * q)

    jacobian = np.empty((n, n))
    for j in range(n):
        step = np.zeros(n)
        step[j] = 1e-6
        jacobian[:, j] = (imbalance(q + step) - imbalance(q - step)) / 2e-6
    wanted = np.linalg.solve(jacobian, -imbalance(q))

    workspace, tip, at_rest, dq = chain_workspace(n), tip_response(), np.zeros(n), np.zeros(n)
    place(chain, np.zeros(3), G, q, at_rest, at_rest, workspace, tip)
    tip.wrench[:] = wrench
    assert eliminate(chain, 0.0, q, at_rest, workspace, tip)
    substitute(workspace, np.zeros(3), dq)
    np.testing.assert_allclose(dq, wanted, rtol=1e-6, atol=1e-9)


def test_newton_step_of_a_chain_whose_joints_slide() -> None:
    """Statics of joints that slide by c q^2 along the bisector of the bodies they connect.

    The balance is the gradient of the energy of springs, gravity and a dead wrench on the last
    body, its derivative the Hessian, both here by central differences of second order.
    """
    rng = np.random.default_rng(5)
    n = 5
    chain = random_chain(
        rng,
        n,
        stiffness=rng.uniform(0.2, 0.4, size=n),
        straightening=rng.uniform(0.002, 0.01, size=n),
    )
    q = rng.normal(size=n) * 0.3
    wrench = rng.normal(size=3) * (0.5, 0.5, 0.005)

    def energy(q: np.ndarray) -> float:
        theta = np.cumsum(chain.rest + q)
        turn = np.exp(1j * theta)
        slide = chain.straightening * q**2 * np.exp(1j * (theta - 0.5 * q))
        link = turn * (chain.link[:, 0] + 1j * chain.link[:, 1])
        joints = np.cumsum(slide) + np.concatenate([[0.0], np.cumsum(link)[:-1]])
        centres = joints + turn * (chain.centre[:, 0] + 1j * chain.centre[:, 1])
        dead = wrench[0] * joints[-1].real + wrench[1] * joints[-1].imag + wrench[2] * theta[-1]
        return float(0.5 * chain.stiffness @ q**2 + G * chain.mass @ centres.imag - dead)

    def gradient(q: np.ndarray) -> np.ndarray:
        steps = 1e-4 * np.eye(n)
        return np.array([(energy(q + step) - energy(q - step)) / 2e-4 for step in steps])

    hessian = np.array([(gradient(q + s) - gradient(q - s)) / 2e-4 for s in 1e-4 * np.eye(n)])
    wanted = np.linalg.solve(hessian, -gradient(q))

    workspace, tip, at_rest, dq = chain_workspace(n), tip_response(), np.zeros(n), np.zeros(n)
    place(chain, np.zeros(3), G, q, at_rest, at_rest, workspace, tip)
    tip.wrench[:] = wrench
    assert eliminate(chain, 0.0, q, at_rest, workspace, tip)
    substitute(workspace, np.zeros(3), dq)
    np.testing.assert_allclose(dq, wanted, rtol=1e-5, atol=1e-6)


def test_motion_of_a_chain_whose_joints_slide() -> None:
    """Rate and loads of a moving chain are the time derivatives of its places."""
    rng = np.random.default_rng(7)
    n, step = 4, 1e-4
    chain = random_chain(
        rng, n, stiffness=np.ones(n), straightening=rng.uniform(0.002, 0.01, size=n)
    )
    q, v, a = rng.normal(size=(3, n))

    def sweep(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        workspace, tip = chain_workspace(n), tip_response()
        rate = v + a * t
        place(chain, np.zeros(3), 0.0, q + t * (v + 0.5 * a * t), rate, a, workspace, tip)
        joints = np.vstack([np.zeros(2), np.cumsum(workspace.link[:-1], axis=0)])
        first = tip.pose[:2] - joints[-1]
        return first + joints + workspace.arm, workspace.load.copy(), tip.twist.copy()

    before, (centres, load, twist), after = sweep(-step), sweep(0.0), sweep(step)
    second = (after[0] - 2.0 * centres + before[0]) / step**2
    np.testing.assert_allclose(load[:, :2], -chain.mass[:, None] * second, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(load[:, 2], -chain.inertia * np.cumsum(a), rtol=1e-12)
    tip_joint = [moment[0][-1] for moment in (before, after)]
    arm_rate = np.cumsum(v)[-1]
    assert twist[2] == pytest.approx(arm_rate, rel=1e-12)
    # The rate of the last centre is that of the last joint plus that of its arm.
    centre_rate = (tip_joint[1] - tip_joint[0]) / (2.0 * step)
    theta = np.cumsum(chain.rest + q)[-1]
    arm = np.exp(1j * theta) * complex(*chain.centre[-1])
    turned = 1j * arm_rate * arm
    np.testing.assert_allclose(
        centre_rate - np.array([turned.real, turned.imag]), twist[:2], rtol=1e-5, atol=1e-9
    )
