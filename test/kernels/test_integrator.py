"""The time integration: its order, its steps and how it ends."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.kernels.contact_law import CLOSED, OPEN, SLIP_LEFT, SLIP_RIGHT, STICK
from hma_gripper_sim.kernels.integrator import GAMMA, time_to_event
from hma_gripper_sim.mechanics.start_pose import copy_state
from hma_gripper_sim.motion.prescribed_motion import follow
from hma_gripper_sim.simulation.simulation import Half


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
    exact, _ = swing(1e-8)
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
        assert simulation.time == simulation.snapshot().halves[0].time[0]
        assert simulation.time == pytest.approx(i * duration, rel=1e-14)


def test_steps_grow_where_nothing_happens(design: GripperDesign) -> None:
    """Hanging free for 100 s takes some dozens of steps."""
    simulation = Simulation(Scene(design, Circle(0.015), clearance=0.5))
    trace = simulation.advance(100.0, 0.001, 1.0)
    assert trace.stats.converged
    assert trace.stats.steps < 60


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


EVENTS = {
    "touch": ((OPEN, STICK), (CLOSED, SLIP_LEFT), 0),
    "release": ((CLOSED, STICK), (OPEN, STICK), 0),
    "slip": ((CLOSED, STICK), (CLOSED, SLIP_RIGHT), 1),
    "arrest": ((CLOSED, SLIP_LEFT), (CLOSED, STICK), 1),
}


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("name", EVENTS)
def test_events_are_expected_where_their_margin_is_used_up(
    design: GripperDesign, name: str, known: bool
) -> None:
    """A margin that falls linearly to 0 at t = 3 ms, within a trial step of 5 ms.

    Its slope is that within the trial step, or where the inner stage is beyond the event
    already, that of the step before.
    """
    before, after, event = EVENTS[name]
    scene = Scene(design, Circle(0.015))
    half = Half(scene.models[0], copy_state(scene.start_states[0]))
    state, modes, inner = half.state, half.workspace.contact.modes, half.tick_workspace.modes
    state.modes.normal[0], state.modes.friction[0] = before
    modes.normal[0], modes.friction[0] = after
    inner.normal[0], inner.friction[0] = before if known else after
    state.margin[0, event], h = 0.6, 5e-3
    falls_known = known and name != "touch"  # the rate of a gap is known exactly
    state.drift[0, event] = -50.0 if falls_known else -200.0
    half.tick_workspace.margin[0, 0, event] = 0.6 - 200.0 * GAMMA * h
    assert time_to_event(h, state, half.workspace, half.tick_workspace) == pytest.approx(
        3e-3, rel=1e-12
    )
    modes.normal[0], modes.friction[0] = before
    assert time_to_event(h, state, half.workspace, half.tick_workspace) == np.inf
