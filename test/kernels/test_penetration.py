"""Where the tip is and how deep it overlaps with the object."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.penetration import deepest_penetration, tip_gap

DISCRETISATIONS = ("thesis", "midpoint", "gauss")
CONTACTS = ("continuous", "sampled")


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
def test_the_stress_free_gripper_touches_at_the_clearance(
    design: GripperDesign, discretisation: str, contact: str
) -> None:
    """The gap is positive before, 0 there, negative beyond: that is how a clearance is defined."""
    scene = Scene(
        design, Circle(0.015), clearance=0.004, discretisation=discretisation, contact=contact
    )
    model = scene.models[0]
    rest = np.zeros(len(model.chain.rest))
    gaps = [
        tip_gap(model.chain, model.fingertip, model.obstacle, travel, rest)
        for travel in (0.003, 0.004, 0.005)
    ]
    assert gaps[0] > 1e-4
    assert gaps[1] == pytest.approx(0.0, abs=1e-9)
    assert gaps[2] < -1e-4


@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
def test_a_resting_contact_is_as_deep_as_its_force(
    design: GripperDesign, discretisation: str, contact: str
) -> None:
    """Held without friction until nothing moves, F = k depth, to a millionth of a millimetre.

    The beams are bent by then, and the joints of ``gauss`` have slid along them.
    """
    scene = Scene(
        design,
        Circle(0.015),
        friction=0.0,
        clearance=0.001,
        discretisation=discretisation,
        contact=contact,
    )
    simulation = Simulation(scene, 1e-6)
    simulation.advance(0.5, 0.02)
    simulation.advance(5.0, 0.0)
    snapshot, model = simulation.snapshot(), scene.models[0]
    state = snapshot.halves[0]
    force = np.hypot(*state.wrench[:2])
    assert force > 0.02
    assert np.abs(state.q).sum() > 0.1
    gap = tip_gap(model.chain, model.fingertip, model.obstacle, snapshot.travel, state.q)
    if contact == "continuous":
        assert -gap == pytest.approx(force / scene.normal_stiffness, abs=1e-9)
    else:  # several points may press; the deepest carries no more than all of them
        assert 0.3 * force / scene.normal_stiffness < -gap < 1.01 * force / scene.normal_stiffness


def test_the_deepest_of_the_rows_under_force(design: GripperDesign) -> None:
    """Rows without a contact force are passed over, whatever their pose."""
    model = Scene(design, Circle(0.015), clearance=0.004).models[0]
    travel = np.array([0.0041, 0.0043, 0.0042, 0.0049])
    q, wrench = np.zeros((4, len(model.chain.rest))), np.zeros((4, 3))
    none = deepest_penetration(model.chain, model.fingertip, model.obstacle, travel, q, wrench)
    assert none == (0.0, -1)
    wrench[:3, 1] = 1.0
    depth, row = deepest_penetration(
        model.chain, model.fingertip, model.obstacle, travel, q, wrench
    )
    assert row == 1
    assert depth == -tip_gap(model.chain, model.fingertip, model.obstacle, travel[1], q[1])


def test_the_place_of_the_stress_free_tip(design: GripperDesign) -> None:
    """The side beam starts 9.55 mm from the middle, 2 mm down, and goes 43 mm at -83 degrees."""
    chain = Scene(design, Circle(0.015)).models[0].chain
    x, z, angle = place_tip(chain, 0.01, np.zeros(len(chain.rest)))
    slant = np.radians(-83.0)
    assert angle == pytest.approx(slant)
    assert x == pytest.approx(9.55e-3 + 0.043 * np.cos(slant))
    assert z == pytest.approx(-2e-3 + 0.043 * np.sin(slant) - 0.01)
