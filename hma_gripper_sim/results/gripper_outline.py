"""Outline of the gripper in a given pose, for drawing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.clearance import TIP_SHANK, place_segments
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.joint_names import SIDES, joint_name

Array = NDArray[np.float64]

ARC_POINTS = 13  # of a half circle


@dataclass(frozen=True)
class GripperOutline:
    """Closed polygons, one for each rigid piece, in world coordinates [m], each shape (m, 2)."""

    bodies: list[Array]


def gripper_outline(scene: Scene, joint_position: ArrayLike) -> GripperOutline:
    """Outline of the gripper of a scene.

    Parameters
    ----------
    joint_position
        In the order of ``scene.joint_names``: travel [m], angles [rad], shape (n_joints,).

    Raises
    ------
    InputError
        The number of joints differs from the scene's.
    """
    half = scene.half
    position = np.asarray(joint_position, dtype=float)
    if position.shape != (len(scene.joint_names),):
        raise InputError(
            f"expected {len(scene.joint_names)} joints, got shape {position.shape}",
            field="joint_position",
        )
    index = {name: i for i, name in enumerate(scene.joint_names)}
    width, middle = scene.design.width, half.chain.root[0]
    bodies = [_bar(np.array([-middle, -position[0]]), np.array([middle, -position[0]]), width)]
    placed = np.empty((len(half.segments.body), 4))
    for side, mirror in zip(SIDES, (1.0, -1.0), strict=True):
        names = [joint_name(part, side, number) for part, number in half.joints]
        q = mirror * position[[index[name] for name in names]]
        place_segments(half.chain, -position[0], q, half.segments, placed)
        for part, radius, (ax, az, bx, bz) in zip(
            half.segments.part, half.segments.radius, placed, strict=True
        ):
            a, b = np.array([mirror * ax, az]), np.array([mirror * bx, bz])
            bodies.append(_bar(a, b, 2.0 * radius) if part < TIP_SHANK else _capsule(a, b, radius))
    return GripperOutline(bodies)


def _bar(a: Array, b: Array, width: float) -> Array:
    along = (b - a) / np.linalg.norm(b - a)
    across = 0.5 * width * np.array([-along[1], along[0]])
    return np.array([a + across, b + across, b - across, a - across, a + across])


def _capsule(a: Array, b: Array, radius: float) -> Array:
    heading = np.arctan2(b[1] - a[1], b[0] - a[0])
    turn = heading + np.linspace(-0.5 * np.pi, 0.5 * np.pi, ARC_POINTS)
    arc = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.vstack([b + arc, a - arc, (b + arc)[:1]])
