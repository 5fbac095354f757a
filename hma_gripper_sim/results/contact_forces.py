"""Contact forces of a state, with the place where each acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.clearance import place_segments
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.states import Snapshot
from hma_gripper_sim.model.joint_names import SIDES

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactForce:
    """Resultant of what the object does to one tip, in world coordinates (x, z).

    Attributes
    ----------
    side
        ``right`` or ``left``.
    force
        On the gripper [N], shape (2,).
    place
        On the axis of the tip's capsule, where the force's line of action crosses it [m],
        shape (2,).
    """

    side: str
    force: Array
    place: Array


def contact_forces(scene: Scene, snapshot: Snapshot) -> list[ContactForce]:
    """Return the contact force of each side that touches the object."""
    half = scene.half
    placed = np.empty((len(half.segments.body), 4))
    forces = []
    for side, mirror, state in zip(
        SIDES, (1.0, -1.0), (snapshot.halves[0], snapshot.halves[-1]), strict=True
    ):
        force, moment = state.wrench[:2], state.wrench[2]
        if not force.any():
            continue
        place_segments(half.chain, -snapshot.travel, state.q, half.segments, placed)
        start, end = placed[-1, :2], placed[-1, 2:]
        joint = np.array(place_tip(half.chain, snapshot.travel, state.q)[:2])
        # The force at start + s (end - start) has this moment about the last joint.
        share = (moment - _cross(start - joint, force)) / _cross(end - start, force)
        place = start + np.clip(share, 0.0, 1.0) * (end - start)
        forces.append(ContactForce(side, force * (mirror, 1.0), place * (mirror, 1.0)))
    return forces


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
