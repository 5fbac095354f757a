"""What of a run its validity is judged by, also of one that was simulated in parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.clearance import Recorded
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.penetration import tip_gap
from hma_gripper_sim.mechanics.outcome import Outcome
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.states import Snapshot
from hma_gripper_sim.results.contact_warnings import UnmodelledContactWarning
from hma_gripper_sim.results.unmodelled_contacts import find_unmodelled_touches

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Observed:
    """What of a run, or of a part of it, its validity is judged by.

    Parameters
    ----------
    outcome, end
        How it ended, and when [s].
    touches
        Parts that touched although the contact model leaves them out.
    touched
        Whether a tip pressed on the object at all.
    nearest, beyond, between
        With the gripper furthest down: gap between the tips and the object [m], how far it is
        beyond the clearance [m], and whether the object is between the tips.
    penetration, penetration_time
        The deepest overlap of a tip and the object under a contact force [m], and when [s].
    stress_ratio, overstress_time
        Largest bending stress relative to the end of the material's linear range, and when that
        was first left [s]; None: never.
    excess
        Estimated error of the solver relative to the tolerance.
    """

    outcome: Outcome
    end: float
    touches: tuple[UnmodelledContactWarning, ...]
    touched: bool
    nearest: float
    beyond: float
    between: bool
    penetration: float
    penetration_time: float
    stress_ratio: float
    overstress_time: float | None
    excess: float


def join(parts: Sequence[Observed]) -> Observed:
    """Put what was observed of successive parts of a run together."""
    first_touches: dict[tuple[str, str], UnmodelledContactWarning] = {}
    for part in parts:
        for touch in part.touches:
            first_touches.setdefault((touch.part, touch.side), touch)
    lowest = max(parts, key=lambda part: part.beyond)
    deepest = max(parts, key=lambda part: part.penetration)
    over = [part.overstress_time for part in parts if part.overstress_time is not None]
    return Observed(
        parts[-1].outcome,
        parts[-1].end,
        tuple(first_touches.values()),
        any(part.touched for part in parts),
        lowest.nearest,
        lowest.beyond,
        lowest.between,
        deepest.penetration,
        deepest.penetration_time,
        max(part.stress_ratio for part in parts),
        min(over, default=None),
        max(part.excess for part in parts),
    )


def observe_instant(scene: Scene, snapshot: Snapshot) -> Observed:
    """Look at one instant; the stress of an instant is left to who keeps its peaks."""
    states = [snapshot.halves[0], snapshot.halves[-1]]
    angles = [state.q for state in states]
    nearest, between = tips_around_object(scene, snapshot.travel, angles)
    time, travel = np.array([snapshot.time]), np.array([snapshot.travel])
    halves = [
        Recorded(time, travel, own[None], other[None])
        for own, other in zip(angles, reversed(angles), strict=True)
    ]
    touched = any(bool(state.wrench.any()) for state in states)
    return Observed(
        outcome=Outcome.CONVERGED,
        end=snapshot.time,
        touches=find_unmodelled_touches(scene, halves[: len(snapshot.halves)]),
        touched=touched,
        nearest=nearest,
        beyond=snapshot.travel - scene.clearance,
        between=between,
        penetration=max(0.0, -nearest) if touched else 0.0,
        penetration_time=snapshot.time,
        stress_ratio=0.0,
        overstress_time=None,
        excess=0.0,
    )


def tips_around_object(scene: Scene, travel: float, angles: Sequence[Array]) -> tuple[float, bool]:
    """Gap between tips and object [m], and whether it is between them, in a pose of both halves."""
    gaps, places = [], []
    for model, q in zip(scene.models, angles, strict=True):
        gaps.append(tip_gap(model.chain, model.fingertip, model.obstacle, travel, q))
        places.append(place_tip(model.chain, travel, q)[0])
    middle = scene.offset + float(scene.contour.core[:, 0].mean())
    return min(gaps), -places[1] < middle < places[0]
