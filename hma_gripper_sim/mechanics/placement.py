"""Placement of the object: where it has to stand to leave a clearance under the gripper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.proximity import Obstacle, point_distance, segment_distance
from hma_gripper_sim.kernels.touch import Fingertip
from hma_gripper_sim.model.contours.base import face_normals
from hma_gripper_sim.model.joint_names import SIDES
from hma_gripper_sim.model.scene import SceneDescription

Array = NDArray[np.float64]

TOUCH = 5e-5  # way in which a touch is looked for step by step, relative to the tip's radius


def fingertip(scene: SceneDescription, tip_origin: Array) -> Fingertip:
    """Return the contact surface of a tip whose frame starts there in that of the last body."""
    tip = scene.design.tip
    if scene.contact == "continuous":
        points = np.array([tip.capsule_start, tip.capsule_end])
        normals, radius = np.zeros((2, 2)), tip.radius
    else:
        points = np.array(tip.points)
        angles = np.array(tip.normal_angles)
        normals, radius = np.column_stack([np.cos(angles), np.sin(angles)]), 0.0
    sampled = scene.contact == "sampled"
    return Fingertip(
        points + tip_origin,
        normals,
        radius,
        not sampled,
        sampled and scene.sampled_normal == "tip",
    )


def obstacle(scene: SceneDescription, side: str, position: tuple[float, float]) -> Obstacle:
    """Return the object with its origin at a position (x, z) [m], in the frame of a half."""
    core = scene.contour.core + position
    own_image = scene.offset == 0.0 and scene.contour.is_symmetric
    if side == "left" and not own_image:
        core = (core * (-1.0, 1.0))[::-1]
    return Obstacle(
        np.ascontiguousarray(core),
        face_normals(core),
        core.mean(axis=0),
        scene.contour.core_radius,
    )


def height_of_first_touch(scene: SceneDescription, chain: Chain, tip: Fingertip) -> float:
    """Height of the contour's origin at which it touches the stress-free gripper [m].

    An object that passes between the tips has its top at the height of their lowest points.
    """
    x, z, angle = place_tip(chain, 0.0, np.zeros(len(chain.rest)))
    points = np.array((x, z)) + _rotate(tip.points, angle)
    lowest = points[:, 1].min() - tip.radius
    highest = points[:, 1].max() + tip.radius
    core, core_radius = scene.contour.core, scene.contour.core_radius
    top = core[:, 1].max() + core_radius
    size = np.ptp(core[:, 1]) + 2.0 * core_radius

    def gap(height: float) -> float:
        smallest = np.inf
        for side in SIDES:
            placed = obstacle(scene, side, (scene.offset, height))
            if tip.capsule:
                distance = segment_distance(placed, *points[0], *points[1])[0]
            else:
                distance = min(point_distance(placed, x, z)[0] for x, z in points)
            smallest = min(smallest, distance)
        return smallest - core_radius - tip.radius

    # Rise by the gap, which cannot pass a touch, until there is one or none is left.
    near = TOUCH * scene.design.tip.radius
    start = lowest - top
    height = start
    while height < highest - top + size:
        free = gap(height)
        if free < near:
            beyond = height
            while gap(beyond) > 0.0 and beyond < height + 100.0 * near:
                beyond += 10.0 * near
            if gap(beyond) <= 0.0:
                return float(brentq(gap, height - near, beyond, xtol=1e-8 * near))
        height += max(free, near)
    return float(start)


def _rotate(vectors: Array, angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[cos, sin], [-sin, cos]]))
