"""Bending moments of sections."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation, simulate
from hma_gripper_sim.results.bending_moments import section_moments


def hanging(scene: Scene) -> np.ndarray:
    """Moments of all sections of the right half of the hanging gripper [N m]."""
    state = Simulation(scene).snapshot().halves[0]
    q, v, a, wrench = (row[None] for row in (state.q, state.v, state.a, state.wrench))
    return section_moments(scene, q, v, a, wrench, np.zeros(1))[0]


def test_sections_of_the_thesis_are_its_joints(design: GripperDesign) -> None:
    """M = -(k q + b q') at every joint."""
    trace = simulate(Scene(design, Circle(0.015)), 0.004, 3.0)
    assert trace.max_bending_moment == np.abs(trace.joint_effort[:, 1:]).max()


def test_moment_in_the_middle_of_the_hanging_gripper(design: GripperDesign) -> None:
    """At the middle of the top beam: the weight of one half times its lever.

    By hand for the stress-free shape: 0.3 % more than where gravity has bent it to.
    """
    line, along = design.line_density, np.exp(1j * np.radians(-83.0))
    corner = 9.55e-3 - 2e-3j
    tip = corner + (43e-3 + 8.808687272e-3 - 2.331376882e-3j) * along
    lever = line * 11.55e-3 * 5.775e-3
    lever += line * 43e-3 * (corner + 21.5e-3 * along).real
    lever += design.tip_mass * tip.real
    scene = Scene(
        design, Circle(0.015), discretisation="midpoint", elements_top=20, elements_beam=80
    )
    assert abs(hanging(scene)[0]) == pytest.approx(9.81 * lever, rel=2e-2)
    stiff = Scene(
        design,
        Circle(0.015),
        discretisation="midpoint",
        elements_top=20,
        elements_beam=80,
        gravity=1e-3,
    )
    assert abs(hanging(stiff)[0]) == pytest.approx(1e-3 * lever, rel=1e-3)


def test_midpoint_moments_are_of_second_order(design: GripperDesign) -> None:
    """Hanging: moments in the middle of the top beam and at the corner for 1 + 4 to 8 + 32 GBEs.

    Against 64 + 256 GBEs; observed order at least 1.9.  The joints themselves stand half a GBE
    away from these sections: their moments would converge at first order only.
    """

    def moments(top: int) -> np.ndarray:
        scene = Scene(
            design,
            Circle(0.015),
            discretisation="midpoint",
            elements_top=top,
            elements_beam=4 * top,
        )
        sections = hanging(scene)
        return np.array([sections[0], sections[1], sections[1 + top]])

    exact = moments(64)
    errors = np.array([np.abs(moments(top) - exact) for top in (1, 2, 4, 8)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders.min() > 1.9
    assert errors[1].max() < 0.01 * np.abs(exact).max()


def test_pressed_moments_converge(design: GripperDesign) -> None:
    """Pressed on the cylinder (contact and inertia included): changes fall by four per doubling."""
    largest = [
        simulate(
            Scene(
                design,
                Circle(0.015),
                discretisation="midpoint",
                elements_top=top,
                elements_beam=4 * top,
            ),
            0.004,
            2.5,
            tolerance=1e-6,
        ).max_bending_moment
        for top in (2, 4, 8)
    ]
    assert (largest[0] - largest[1]) / (largest[1] - largest[2]) > 3.5


def test_an_accelerated_gripper_is_a_heavier_or_lighter_one(design: GripperDesign) -> None:
    """A base that falls with g leaves nothing to carry: moments of a gripper without weight.

    Rigid apart from that: of one pose, so that the accelerations relative to the base are 0.
    """
    scene = Scene(design, Circle(0.015), discretisation="midpoint")
    n = len(scene.half.joints)
    still = (np.zeros((2, n)), np.zeros((2, n)), np.zeros((2, n)), np.zeros((2, 3)))
    moments = section_moments(scene, *still, np.array([0.0, 0.5 * scene.gravity]))
    np.testing.assert_allclose(moments[1], 0.5 * moments[0], rtol=1e-12)
    assert np.abs(moments[0]).max() > 1e-5
