"""The balance of energy across velocity jumps of the base inside a run."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation, simulate

FAR = 0.2  # m; clearance of runs in free air


@pytest.mark.parametrize("jump", [0.01, 0.05, 0.2])
def test_a_jump_of_the_resting_gripper_by_hand(design: GripperDesign, jump: float) -> None:
    """The hanging gripper moves on as a rigid body: work = m v^2 / 2 - weight x travel.

    Its mass is the weight at rest over gravity.  Nothing but rounding is left: the springs do not
    move.
    """
    scene = Scene(design, Circle(0.015), clearance=FAR)
    mass = -Simulation(scene).state().actuator_force / scene.gravity
    balance = simulate(scene, lambda t: 0.0 if t < 0.1 else jump, 0.2).energy
    wanted = 0.5 * mass * jump**2 - mass * scene.gravity * 0.1 * jump
    assert balance.actuator == pytest.approx(wanted, rel=1e-6)
    assert balance.kinetic == pytest.approx(0.5 * mass * jump**2, rel=1e-6)
    assert balance.relative_residual < 1e-9


def test_a_jump_of_the_swinging_gripper_adds_its_momentum(design: GripperDesign) -> None:
    """Work of a jump = m (v2^2 - v1^2) / 2 + p (v2 - v1), p the momentum relative to the base.

    That momentum is what the force beyond the weight has given the gripper since it was at rest:
    p = integral (F + m g) dt - m v.  The jump's work is what the balance has beyond the integral
    of F over the travel.  A soft gripper swings so far that p matters.  Integrals by the
    trapezoidal rule over samples of 0.1 ms: to a thousandth of the jump's work.
    """
    at = 0.07

    def velocity(t: float) -> float:
        return 0.1 * math.sin(2.0 * math.pi * 20.0 * t) if t < at else 0.2

    material = dataclasses.replace(design.material, youngs_modulus=1e6)
    soft = dataclasses.replace(design, material=material, joint_damping=1e-4)
    scene = Scene(soft, Circle(0.015), clearance=FAR)
    mass = -Simulation(scene).state().actuator_force / scene.gravity
    trace = simulate(scene, velocity, 0.15, tolerance=1e-4, sample_period=1e-4)
    v1, v2 = velocity(at - 1e-9), 0.2
    jump = int(np.searchsorted(trace.time, at - 1e-9))
    up_to, force = trace.time[: jump + 1], trace.actuator_force
    momentum = float(np.trapezoid(force[: jump + 1] + mass * scene.gravity, up_to)) - mass * v1
    speed = np.append(trace.velocity[:jump], v1)
    smooth = float(np.trapezoid(force[: jump + 1] * speed, up_to))
    smooth += float(np.trapezoid(force[jump:] * trace.velocity[jump:], trace.time[jump:]))
    by_hand = 0.5 * mass * (v2**2 - v1**2) + momentum * (v2 - v1)
    assert abs(momentum * (v2 - v1)) > 0.05 * abs(by_hand)
    assert trace.energy.actuator - smooth == pytest.approx(by_hand, rel=1e-3)


@pytest.mark.parametrize("jump", [0.01, 0.2])
def test_the_residual_falls_with_the_tolerance(design: GripperDesign, jump: float) -> None:
    """A hundredth of the tolerance, a tenth of the residual at least: the method is second order.

    A sine sets the gripper swinging in free air; its velocity jumps twice.
    """

    def velocity(t: float) -> float:
        swing = 0.05 * math.sin(2.0 * math.pi * 8.0 * t)
        return swing + (jump if 0.1 < t < 0.25 else 0.0)

    scene = Scene(design, Circle(0.015), clearance=FAR)
    coarse, fine = (
        simulate(scene, velocity, 0.4, tolerance=tolerance).energy.relative_residual
        for tolerance in (1e-2, 1e-4)
    )
    assert coarse < 5e-3
    assert fine < 0.1 * coarse
