"""The drawn gripper is the simulated one."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, InputError, Scene, Simulation
from hma_gripper_sim.results.gripper_outline import gripper_outline


def area(polygon: np.ndarray) -> float:
    x, z = polygon[:, 0], polygon[:, 1]
    return abs(0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z)))


def pose(simulation: Simulation) -> list[np.ndarray]:
    """The gripper as it is drawn now."""
    return gripper_outline(simulation.scene, simulation.state().joint_position).bodies


@pytest.mark.parametrize("discretisation", ["thesis", "midpoint"])
def test_stress_free_outline(design: GripperDesign, discretisation: str) -> None:
    """Closed polygons of the right size, mirror images of each other, at the right place.

    From the tips' lowest point to the top beam's upper side, 4 mm thick everywhere but the tips.
    """
    scene = Scene(design, Circle(0.015), discretisation=discretisation)
    bodies = gripper_outline(scene, np.zeros(len(scene.joint_names))).bodies
    points = np.vstack(bodies)
    for body in bodies:
        np.testing.assert_array_equal(body[0], body[-1])
        assert area(body) > 0.0
    assert points[:, 1].max() == pytest.approx(2e-3)
    mirrored = points * (-1.0, 1.0)
    for point in mirrored[:: max(1, len(mirrored) // 50)]:
        assert np.linalg.norm(points - point, axis=1).min() < 1e-12
    along = np.exp(-1j * np.radians(83.0))
    origin = 9.55e-3 - 2e-3j + 43e-3 * along
    start = origin + complex(*design.tip.capsule_start) * along
    end = origin + complex(*design.tip.capsule_end) * along
    lowest = min(start.imag, end.imag) - 2e-3
    assert points[:, 1].min() == pytest.approx(lowest, abs=2e-5)  # arcs are polygons
    straight = sum(area(body) for body in bodies if len(body) == 5)
    assert straight == pytest.approx(4e-3 * 2.0 * (11.55e-3 + 43e-3), rel=1e-2)


def test_outline_moves_with_the_gripper(design: GripperDesign) -> None:
    """Lowered by the travel, the hanging shape otherwise unchanged."""
    simulation = Simulation(Scene(design, Circle(0.015), clearance=0.1))
    before = pose(simulation)
    simulation.advance(1.0, 0.004)
    after = pose(simulation)
    for one, two in zip(before, after, strict=True):
        np.testing.assert_allclose(two, one - (0.0, 0.004), rtol=0.0, atol=1e-12)


def test_pressed_tips_touch_the_object(design: GripperDesign) -> None:
    """On the cylinder, the outline's tips come within the drawing's accuracy of its surface."""
    scene = Scene(design, Circle(0.015), offset=0.002)
    simulation = Simulation(scene)
    simulation.advance(2.0, 0.004)
    centre = np.array(scene.object_position)
    for side in (1.0, -1.0):
        edges = [body for body in pose(simulation) if side * body[:, 0].mean() > 0.0]
        gaps = []
        for body in edges:
            share = np.linspace(0.0, 1.0, 200)[:, None, None]
            dense = (body[:-1] + share * np.diff(body, axis=0)).reshape(-1, 2)
            gaps.append(np.linalg.norm(dense - centre, axis=1).min() - 0.015)
        assert min(gaps) == pytest.approx(0.0, abs=5e-5)


@pytest.mark.parametrize("shape", [(62,), (64,), (1, 63), ()])
def test_wrong_number_of_joints(design: GripperDesign, shape: tuple[int, ...]) -> None:
    """Not the joints of this scene."""
    with pytest.raises(InputError, match="expected 63 joints") as refusal:
        gripper_outline(Scene(design, Circle(0.015)), np.zeros(shape))
    assert refusal.value.field == "joint_position"
