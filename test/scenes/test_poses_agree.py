"""Whatever says where the gripper is says the same as the solver, in every discretisation."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.kernels.chain import chain_workspace, place, tip_response
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.results.contact_forces import contact_forces
from hma_gripper_sim.results.gripper_outline import gripper_outline
from hma_gripper_sim.results.observation import observe_instant
from hma_gripper_sim.simulation.simulation import deepest_overlap
from hma_gripper_sim.simulation.trace import beam_chord

SAME = 1e-9  # m
RADIUS = 0.015


@pytest.fixture(scope="module", params=DISCRETISATIONS)
def pressed(design: GripperDesign, request: pytest.FixtureRequest) -> Simulation:
    """Pressed at 8 mm/s from 1 mm above a rough cylinder, until the beams bend far."""
    scene = Scene(
        design,
        Circle(RADIUS),
        friction=1.0,
        clearance=0.001,
        discretisation=request.param,
        accuracy=0.01 if request.param == "gauss" else None,
    )
    simulation = Simulation(scene)
    for _ in range(100):
        simulation.step(0.01, 0.008)
    return simulation


def solved_axis(simulation: Simulation) -> tuple[np.ndarray, complex]:
    """Ends of the right tip's capsule and the last joint (x + i z) [m], by the solver's sweep."""
    scene, state = simulation.scene, simulation.snapshot().halves[0]
    n = len(state.q)
    workspace, tip = chain_workspace(n), tip_response()
    chain = scene.half.chain
    base = np.array([-simulation.travel, -simulation.velocity, 0.0])
    place(chain, base, scene.gravity, state.q, state.v, state.a, workspace, tip)
    capsule = np.array([scene.design.tip.capsule_start, scene.design.tip.capsule_end])
    joint = complex(*tip.pose[:2])
    along = (capsule + scene.half.tip_origin) @ (1.0, 1j)
    return joint + along * np.exp(1j * tip.pose[2]), joint


def distance(point: complex, axis: np.ndarray) -> float:
    """Distance of a point to a segment [m]."""
    start, end = axis
    share = ((point - start) * np.conj(end - start)).real / abs(end - start) ** 2
    return abs(point - start - min(max(share, 0.0), 1.0) * (end - start))


def test_gaps_and_overlaps(pressed: Simulation) -> None:
    """The tip presses into the cylinder by its force over the stiffness; both checks see that."""
    scene, snapshot = pressed.scene, pressed.snapshot()
    axis, _ = solved_axis(pressed)
    radii = RADIUS + scene.design.tip.radius
    depth = radii - distance(complex(*scene.object_position), axis)
    assert depth > 1e-6
    q = snapshot.halves[0].q
    assert deepest_overlap(scene, pressed.travel, q, q) == pytest.approx(depth, abs=SAME)
    assert -observe_instant(scene, snapshot).nearest == pytest.approx(depth, abs=SAME)


def test_contact_forces_act_along_the_solvers_line_of_thrust(pressed: Simulation) -> None:
    """About the last joint they have the moment of the solver's wrench."""
    wrench = pressed.snapshot().halves[0].wrench
    axis, joint = solved_axis(pressed)
    right = contact_forces(pressed.scene, pressed.snapshot())[0]
    place = complex(*right.place)
    assert distance(place, axis) < SAME
    arm, force = place - joint, complex(*right.force)
    lever = (np.conj(arm) * force).imag - wrench[2]
    assert abs(lever) / abs(force) < SAME


def test_outlines_are_drawn_around_the_solvers_axis(pressed: Simulation) -> None:
    scene = pressed.scene
    axis, _ = solved_axis(pressed)
    bodies = gripper_outline(scene, pressed.state().joint_position).bodies
    flank = bodies[len(scene.half.segments.body)] @ (1.0, 1j)
    radius = scene.design.tip.radius
    assert max(abs(distance(point, axis) - radius) for point in flank) < SAME


def test_the_chord_is_between_the_solvers_ends_of_the_beam(pressed: Simulation) -> None:
    """From the corner to the tip's joint, which the solver's sweep has a tip's frame further."""
    scene, state = pressed.scene, pressed.snapshot().halves[0]
    half, chain = scene.half, scene.half.chain
    n = len(state.q)
    workspace, tip = chain_workspace(n), tip_response()
    place(chain, np.zeros(3), scene.gravity, state.q, state.v, state.a, workspace, tip)
    angles = np.cumsum(state.q + chain.rest)
    body, point = half.beam_start
    steps = workspace.link[body : n - 1] @ (1.0, 1j)  # slides of the joints they lead to included
    start = complex(*tip.pose[:2]) - steps.sum() + complex(*point) * np.exp(1j * angles[body])
    end = complex(*tip.pose[:2]) + complex(*half.beam_end[1]) * np.exp(1j * tip.pose[2])
    chord = np.pi + np.angle(end - start)
    found = float(beam_chord(half, state.q))
    assert abs(found - chord) * abs(end - start) < SAME
