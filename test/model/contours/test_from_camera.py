"""Outlines as cameras see them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.model.contours.base import face_normals
from hma_gripper_sim.model.contours.from_camera import MAX_CORNERS, polygon_from_outline

SQUARE = np.array([[-0.01, 0.0], [0.01, 0.0], [0.01, 0.02], [-0.01, 0.02]])


def circle(count, radius=0.015):
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("points", [SQUARE, SQUARE[::-1], np.roll(SQUARE, 3, axis=0)])
def test_a_square_stays_a_square_either_way_round(points):
    corners = polygon_from_outline(points).core
    assert {tuple(corner) for corner in corners} == {tuple(corner) for corner in SQUARE}


def test_single_precision_on_straight_edges_is_no_dent():
    edge = np.linspace(0.0, 1.0, 37)[:-1, None]
    points = np.vstack(
        [a + edge * (b - a) for a, b in zip(SQUARE, np.roll(SQUARE, -1, axis=0), strict=True)]
    )
    polygon = polygon_from_outline(np.float32(points + 0.1))
    area = 0.02**2
    assert abs(shoelace(polygon.core) - area) < 1e-5 * area


def shoelace(corners):
    x, z = corners.T
    return 0.5 * abs(np.dot(x, np.roll(z, -1)) - np.dot(z, np.roll(x, -1)))


def test_noise_is_taken_for_noise_and_a_real_dent_is_refused():
    rng = np.random.default_rng(1)
    noisy = circle(200) * (1.0 + 0.004 * rng.uniform(-1.0, 1.0, (200, 1)))
    polygon = polygon_from_outline(noisy)
    assert abs(shoelace(polygon.core) / (math.pi * 0.015**2) - 1.0) < 0.02
    dented = circle(100)
    dented[10] *= 0.9
    with pytest.raises(InputError, match="not convex"):
        polygon_from_outline(dented)


def test_too_many_points_become_few_close_to_the_outline():
    polygon = polygon_from_outline(circle(1000))
    corners = polygon.core
    assert len(corners) == MAX_CORNERS
    # Every edge of a regular polygon of n corners comes as near as r cos(pi / n); those of a
    # greedy one differ by up to a factor of two in length.
    distance = np.einsum("ij,ij->i", face_normals(corners), corners)
    assert distance.min() >= 0.015 * math.cos(2.0 * math.pi / MAX_CORNERS)
    assert np.linalg.norm(corners, axis=1).max() <= 0.015 * (1 + 1e-12)


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (SQUARE[:2], "at least three"),
        ([[0.0, 0.0], [0.01, 0.0], [0.0, math.nan]], "finite"),
        ([[0.0, 0.0], [0.01, 0.0], [0.0, math.inf]], "finite"),
        (1e3 * SQUARE, "in metres"),
        (1e-3 * SQUARE, "in metres"),
        ([[0.0, 0.0], [0.01, 0.0], [0.02, 0.0]], "no area"),
        (SQUARE[[0, 2, 1, 3]], "crosses itself"),
        (np.vstack([circle(40)[::2], circle(40)[1::2]]), "crosses itself"),
        ([[-0.01, 0.0], [0.01, 0.0], [0.0, 0.005], [0.0, 0.02]], "not convex"),
    ],
)
def test_what_shows_no_object_is_refused(points, reason):
    with pytest.raises(InputError, match=reason):
        polygon_from_outline(points)
