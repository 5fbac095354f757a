"""Touches of parts that the contact model leaves out: everything but the tips' contours."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hma_gripper_sim.kernels.clearance import (
    OTHER_TIP,
    PARTS,
    SIDE_BEAM,
    TIP_SHANK,
    TOP_BEAM,
    Recorded,
    clearance_workspace,
    first_touches,
)
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.joint_names import SIDES
from hma_gripper_sim.results.contact_warnings import OTHER_TIP_NAME, UnmodelledContactWarning

PART_NAMES = {
    TOP_BEAM: "top beam",
    SIDE_BEAM: "side beam",
    TIP_SHANK: "outer side of the tip",
    OTHER_TIP: OTHER_TIP_NAME,
}


def find_unmodelled_touches(
    scene: Scene, halves: Sequence[Recorded]
) -> tuple[UnmodelledContactWarning, ...]:
    """First touch of each part that the contact model leaves out, in order of time.

    Parameters
    ----------
    halves
        States of both halves, or of the one that the other mirrors.
    """
    half = scene.half
    touches = []
    found = np.empty((PARTS, 3))
    workspace = clearance_workspace(half.segments)
    mirrored = len(halves) == 1
    for i, states in enumerate(halves):
        model = scene.models[i]
        first_touches(model.chain, half.segments, model.obstacle, states, workspace, found)
        for part, (time, x, z) in enumerate(found.tolist()):
            if math.isinf(time):
                continue
            for side in SIDES if mirrored else SIDES[i : i + 1]:
                if part != OTHER_TIP or side == "right":
                    place = (x if side == "right" else -x, z)
                    touch = UnmodelledContactWarning(PART_NAMES[part], side, time, place)
                    touches.append(touch)
    return tuple(sorted(touches, key=lambda touch: touch.time))
