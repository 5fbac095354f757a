"""The time integration: its order, its steps and how it ends."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.kernels.integrator import base_motion
from hma_gripper_sim.motion import follow, ramp


def swing(tolerance: float) -> tuple[np.ndarray, int]:
    """A lightly damped gripper of three bodies per half, shaken and left swinging: state, steps."""
    design = dataclasses.replace(
        GripperDesign.thesis_2013(), top_elements=1, beam_elements=1, joint_damping=1e-5
    )
    simulation = Simulation(Scene(design, Circle(0.001), clearance=0.5), tolerance)
    simulation.step(0.03, 0.1)
    simulation.step(0.03, 0.1)
    state = simulation.state()
    return state.joint_position[1:], int(simulation.snapshot().halves[0].counts[0])


def test_second_order() -> None:
    """Error against a run with thirty times more steps: order 2 in the number of steps."""
    exact, _ = swing(1e-9)
    errors, steps = [], []
    for tolerance in (1e-4, 1e-5, 1e-6):
        position, count = swing(tolerance)
        errors.append(np.abs(position - exact).max())
        steps.append(count)
    order = np.log(errors[0] / errors[-1]) / np.log(steps[-1] / steps[0])
    assert 1.8 < order < 2.4


@pytest.mark.parametrize("duration", [1e-9, 1e-4, 0.01, 0.3, 1.0])
def test_ends_exactly(design: GripperDesign, duration: float) -> None:
    """Whatever the duration, the last step ends on it, and time never passes it."""
    simulation = Simulation(Scene(design, Circle(0.015), clearance=0.0))
    for i in range(1, 4):
        simulation.step(duration, 0.004)
        assert simulation.time == simulation.snapshot().halves[0].clock[0]
        assert simulation.time == pytest.approx(i * duration, rel=1e-14)


def test_steps_grow_where_nothing_happens(design: GripperDesign) -> None:
    """Hanging free for 100 s takes some dozens of steps."""
    simulation = Simulation(Scene(design, Circle(0.015), clearance=0.5))
    trace = simulation.advance(100.0, 0.001, 1.0)
    assert trace.stats.converged
    assert trace.stats.steps < 60


def test_base_motion_follows_the_table() -> None:
    """Height, velocity and acceleration of the base are minus those of the travel."""
    base = np.empty(3)
    motion = ramp(1.0, 0.002, 0.5, 0.004, -0.002, True)
    base_motion(motion, 0, 1.25, base)
    travel = 0.002 + 0.25 * (0.004 - 0.5 * 0.012 * 0.25)
    np.testing.assert_allclose(base, [-travel, -(0.004 - 0.012 * 0.25), 0.012], rtol=1e-12)


def test_a_jump_is_taken_at_its_time(design: GripperDesign) -> None:
    """Travel after a command that jumps twice: exact, whatever steps the solver takes.

    Between the jumps the velocity is constant: the tables' travel is the sum of the pieces.
    """
    command = [(0.0, 0.004), (0.5, -0.002), (0.75, 0.001)]

    def velocity(t: float) -> float:
        return next(v for start, v in reversed(command) if t >= start)

    motion = follow(velocity, 0.0, 0.0, 1.0)
    assert motion.travel[-1] == pytest.approx(0.002 - 0.0005 + 0.00025, abs=1e-9)
    simulation = Simulation(Scene(design, Circle(0.015)))
    trace = simulation.advance(1.0, velocity)
    assert simulation.travel == pytest.approx(0.00175, abs=1e-9)
    assert trace.travel[-1] == pytest.approx(0.00175, abs=1e-9)
