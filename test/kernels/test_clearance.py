"""Distances of all parts of the gripper against sampled ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene
from hma_gripper_sim.kernels.clearance import (
    PARTS,
    SIDE_BEAM,
    TIP_FLANK,
    TIP_SHANK,
    TOP_BEAM,
    Recorded,
    clearance_workspace,
    first_touches,
    part_gaps,
    place_segments,
)


def place(scene: Scene, q: np.ndarray, height: float) -> np.ndarray:
    half = scene.half
    placed = np.empty((len(half.segments.body), 4))
    place_segments(half.chain, height, q, half.segments, placed)
    return placed


@pytest.mark.parametrize("discretisation", ["thesis", "midpoint"])
def test_pieces_hang_together(design: GripperDesign, discretisation: str) -> None:
    """In a random pose each piece of a beam starts where the one before ends.

    Together they are as long as the beams: 10.5 + 1.05 mm less the first half GBE, and 43 mm.
    """
    scene = Scene(design, Circle(0.015), discretisation=discretisation)
    q = np.random.default_rng(0).normal(size=len(scene.half.chain.rest)) * 0.05
    placed = place(scene, q, -0.01)
    part = scene.half.segments.part
    for kind, length in ((TOP_BEAM, 11.55e-3 - scene.half.chain.root[0]), (SIDE_BEAM, 43e-3)):
        rows = placed[part == kind]
        np.testing.assert_allclose(rows[1:, :2], rows[:-1, 2:], rtol=0.0, atol=1e-15)
        pieces = np.hypot(rows[:, 2] - rows[:, 0], rows[:, 3] - rows[:, 1])
        assert pieces.sum() == pytest.approx(length, rel=1e-12)
    beam, shank, flank = (
        placed[part == SIDE_BEAM][-1],
        placed[part == TIP_SHANK],
        placed[part == TIP_FLANK],
    )
    np.testing.assert_allclose(shank[0, :2], beam[2:], atol=1e-15)
    np.testing.assert_allclose(shank[0, 2:], flank[0, 2:], atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_gaps_to_a_circle(design: GripperDesign, seed: int) -> None:
    """Gap of each part = distance of its axis to the centre, less both radii.

    Reference: 2001 samples of every axis; their spacing of some micrometres leaves 1e-7 m.
    """
    rng = np.random.default_rng(seed)
    scene = Scene(design, Circle(0.015), clearance=0.01, offset=0.002)
    half, obstacle = scene.half, scene.models[0].obstacle
    placed = place(scene, rng.normal(size=31) * 0.02, -rng.uniform(0.0, 0.005))
    gaps, places = np.empty(PARTS), np.empty((PARTS, 2))
    part_gaps(half.segments, placed, obstacle, gaps, places)
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    for part in (TOP_BEAM, SIDE_BEAM, TIP_FLANK):
        smallest = math.inf
        for k in np.flatnonzero(half.segments.part == part):
            axis = placed[k, :2] + share * (placed[k, 2:] - placed[k, :2])
            distance = np.linalg.norm(axis - scene.object_position, axis=1)
            smallest = min(smallest, float(distance.min()) - 0.015 - half.segments.radius[k])
        assert gaps[part] == pytest.approx(smallest, abs=1e-7)
        from_centre = np.linalg.norm(places[part] - scene.object_position)
        radius = half.segments.radius[half.segments.part == part][0]
        assert from_centre == pytest.approx(gaps[part] + 0.015 + radius, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_no_touch_is_passed_over(design: GripperDesign, seed: int) -> None:
    """States that cannot have closed a gap are skipped: the same touches as measuring all.

    An infinite reach of the bodies forbids to skip any.
    """
    rng = np.random.default_rng(seed)
    scene = Scene(design, Circle(0.015), clearance=0.005, offset=0.001 * seed)
    half, obstacle = scene.half, scene.models[0].obstacle
    rows = 400
    # Both halves wander off until parts of them meet the object, or each other.
    q, other = 0.004 * np.cumsum(rng.normal(size=(2, rows, len(half.chain.rest))), axis=1)
    travel = np.linspace(0.0, 0.03, rows)
    states = Recorded(np.linspace(0.0, 7.0, rows), travel, q, other)
    found, every = np.empty((2, PARTS, 3))
    for segments, result in (
        (half.segments, found),
        (half.segments._replace(reach=np.full(len(q[0]), np.inf)), every),
    ):
        first_touches(half.chain, segments, obstacle, states, clearance_workspace(segments), result)
    assert np.isfinite(every[:, 0]).any()
    touched = np.isfinite(every[:, 0])
    np.testing.assert_array_equal(found[:, 0], every[:, 0])
    np.testing.assert_array_equal(found[touched], every[touched])
