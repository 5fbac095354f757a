"""The start pose, above all of grippers so soft that they rest on the object at travel 0."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from hma_gripper_sim import Circle, Contour, GripperDesign, Polygon, RoundedBox, Scene, simulate

DISCRETISATIONS = (
    ("gauss", 2, 4),
    ("gauss", 4, 10),
    ("gauss", 6, 16),
    ("midpoint", 10, 50),
    ("thesis", 5, 25),
)
FINE = 2  # which of them is nearest to the continuum


def soft(modulus: float, **sizes: Any) -> GripperDesign:
    """The thesis' design of another modulus [Pa] and other sizes."""
    design = GripperDesign.thesis_2013()
    material = dataclasses.replace(design.material, youngs_modulus=modulus)
    return dataclasses.replace(design, material=material, **sizes)


def tip_angles(scene: Scene) -> list[float]:
    """Angle of each tip in its own half's frame at the start [rad]."""
    return [float((scene.half.chain.rest + state.q).sum()) for state in scene.start_states]


def test_start_does_not_depend_on_the_discretisation() -> None:
    """A tip that could rest on the object's top or beside it starts where lowering leads."""
    design = soft(377243.3, beam_length=0.0540494, width=0.00463317, beam_angle=0.3143036)
    for name, top, beam in (*DISCRETISATIONS, ("gauss", 10, 30), ("midpoint", 30, 150)):
        scene = Scene(
            design,
            Circle(0.0180692758),
            friction=0.235,
            clearance=0.00522711932,
            discretisation=name,
            elements_top=top,
            elements_beam=beam,
        )
        assert tip_angles(scene)[0] == pytest.approx(-1.2477, abs=1e-3)


@pytest.mark.filterwarnings("ignore::hma_gripper_sim.simulation.trace.UnmodelledContactWarning")
@pytest.mark.parametrize("seed", range(24))
def test_soft_grippers_start_alike_in_all_discretisations(seed: int) -> None:
    """Moduli of 1e5 to 1e6 Pa, circles, boxes and polygons: found, and the same to 0.03 rad.

    That is what the coarser ones differ by from the finest where nothing is touched.  The
    start is an equilibrium: with nothing commanded nothing moves.
    """
    rng = np.random.default_rng(seed)
    design = soft(
        10.0 ** rng.uniform(5.0, 6.0),
        beam_length=rng.uniform(0.02, 0.08),
        width=rng.uniform(0.002, 0.006),
        beam_angle=rng.uniform(0.0, 0.35),
    )
    count = int(rng.integers(3, 8))
    angles = rng.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * np.arange(count) / count
    corners = rng.uniform(0.006, 0.025) * np.column_stack([np.cos(angles), np.sin(angles)])
    contour: Contour = (
        Circle(rng.uniform(0.006, 0.03)),
        RoundedBox(rng.uniform(0.01, 0.06), rng.uniform(0.01, 0.06), 0.0),
        Polygon(corners, 0.0),
    )[seed % 3]
    clearance, offset = rng.uniform(0.001, 0.01), (seed % 2) * rng.uniform(-0.006, 0.006)
    starts, moved = [], []
    for name, top, beam in DISCRETISATIONS:
        scene = Scene(
            design,
            contour,
            clearance=clearance,
            offset=offset,
            contact="sampled" if seed % 4 < 2 else "continuous",
            discretisation=name,
            elements_top=top,
            elements_beam=beam,
        )
        starts.append(tip_angles(scene))
        trace = simulate(scene, 0.0, 0.02)
        assert trace.stats.converged
        moved.append(np.ptp(trace.joint_position, axis=0).max())
    np.testing.assert_allclose(starts, np.broadcast_to(starts[FINE], np.shape(starts)), atol=0.03)
    assert max(moved) < 1e-6
