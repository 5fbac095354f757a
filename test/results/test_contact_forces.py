"""Contact forces: what Newton's laws and the geometry say about them."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, Scene, Simulation
from hma_gripper_sim.results.contact_forces import contact_forces


@pytest.mark.parametrize("contact", ["continuous", "sampled"])
@pytest.mark.parametrize("offset", [0.0, 0.001])
def test_at_rest_they_balance_actuator_and_weight_and_act_at_the_contact(design, contact, offset):
    radius = 0.015
    scene = Scene(design, Circle(radius), clearance=0.004, contact=contact, offset=offset)
    simulation = Simulation(scene)
    assert contact_forces(scene, simulation.snapshot()) == []
    for velocity in [0.004] * 20 + [0.0] * 20:
        simulation.step(0.1, velocity)
    forces = contact_forces(scene, simulation.snapshot())
    assert [force.side for force in forces] == ["right", "left"]
    # Down: the actuator and the weight; up: the object. To the solver's tolerance of 1e-3.
    upwards = sum(force.force[1] for force in forces)
    downwards = simulation.state().actuator_force + design.mass * 9.81
    assert upwards == pytest.approx(downwards, rel=2e-3)
    for force, sign in zip(forces, (1.0, -1.0), strict=True):
        away = force.place - scene.object_position
        assert sign * away[0] > 0.0
        assert sign * force.force[0] > 0.0  # the object presses the tips apart
        # The force crosses the capsule's axis one tip radius above the object: exactly so where it
        # is normal, less far by the friction angle where the model has the force on the surface.
        assert np.linalg.norm(away) == pytest.approx(radius + design.tip.radius, rel=0.01)
