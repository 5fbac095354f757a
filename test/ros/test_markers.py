"""Pictures as messages: their places are those of the simulation."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, Scene, Simulation
from hma_gripper_sim.results.contact_forces import contact_forces
from hma_gripper_sim.results.gripper_outline import gripper_outline

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from visualization_msgs.msg import Marker

from hma_gripper_sim.ros.markers import METRES_PER_NEWTON, MarkerMessages


def places(marker):
    """Points in the drawing plane, where z is up, shape (k, 2)."""
    assert all(point.y == 0.0 for point in marker.points)
    return np.array([(point.x, -point.z) for point in marker.points])


def area(triangles):
    a, b, c = triangles.reshape(-1, 3, 2).transpose(1, 0, 2)
    u, v = b - a, c - a
    return 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()


def test_gripper_object_and_forces_are_drawn_where_they_are(design):
    scene = Scene(design, Circle(0.015), clearance=0.002, offset=0.001)
    simulation = Simulation(scene)
    markers = MarkerMessages("")
    drawn = {(m.ns, m.id): m for m in markers.message.markers}
    markers.fill(scene, simulation.state(), simulation.snapshot(), 5_000_000_007)
    assert [drawn["contact_force", i].action for i in (0, 1)] == [Marker.DELETE] * 2

    for _ in range(15):
        simulation.step(0.1, 0.004)
    state, snapshot = simulation.state(), simulation.snapshot()
    markers.fill(scene, state, snapshot, 5_000_000_007)
    for marker in drawn.values():
        assert marker.header.frame_id == "gripper_mount"
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == (5, 7)

    bodies = gripper_outline(scene, state.joint_position).bodies
    gripper = places(drawn["gripper", 0])
    corners = {tuple(np.round(corner, 9)) for body in bodies for corner in body}
    assert {tuple(np.round(place, 9)) for place in gripper} == corners
    shoelaces = [x[:-1] @ z[1:] - x[1:] @ z[:-1] for x, z in (body.T for body in bodies)]
    assert area(gripper) == pytest.approx(0.5 * np.abs(shoelaces).sum(), rel=1e-9)

    circle = places(drawn["object", 0]) - scene.object_position
    assert np.linalg.norm(circle, axis=1) == pytest.approx(0.015, abs=1e-12)
    assert area(circle) == pytest.approx(np.pi * 0.015**2, rel=0.01)

    for i, force in enumerate(contact_forces(scene, snapshot)):
        arrow = drawn["contact_force", i]
        assert arrow.action == Marker.ADD
        start, end = places(arrow)
        assert start == pytest.approx(force.place)
        assert end - start == pytest.approx(METRES_PER_NEWTON * force.force)
