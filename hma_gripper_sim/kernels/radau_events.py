"""Events in a step of Radau IIA(5) whose contact modes are held: where one of them would change.

The collocation polynomial says how far each contact is from a change of its modes at any share of
the step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import GRAZING, OPEN, STICK, ContactLaw, ContactModes
from hma_gripper_sim.kernels.radau import powers
from hma_gripper_sim.kernels.radau_contact import StageContacts
from hma_gripper_sim.kernels.radau_method import NODES
from hma_gripper_sim.kernels.stage import Model
from hma_gripper_sim.kernels.touch import touched_part

Array = NDArray[np.float64]

ROUNDING = 1e-12  # of a margin
KINK_HALVINGS = 40


@kernel
def event_margins(
    law: ContactLaw,
    modes: ContactModes,
    k: int,
    normal: float,
    friction: float,
    slip: float,
    apart: float,
    margin: Array,
) -> None:
    """How far contact `k` is from a change of its modes, into `margin`, shape (2,).

    An open contact closes when it overlaps and would push [m]; a closed one opens when it no
    longer pushes [N] or overlaps, and a grazing one may not leave its layer [m]; a stick slips
    beyond the friction limit [N], a slip ends at rest [m/s].
    """
    margin[1] = np.inf
    if modes.normal[k] == OPEN:
        margin[0] = apart
        return
    if modes.normal[k] == GRAZING:
        margin[0] = min(-apart, apart + law.graze)
    else:
        margin[0] = min(normal, -law.stiffness * apart)
    if law.friction == 0.0:
        return
    mode = modes.friction[k]
    if mode == STICK:
        margin[1] = law.friction * normal - abs(friction)
    else:
        margin[1] = -mode * slip - law.slip_velocity


@kernel
def stage_margins(
    law: ContactLaw, modes: ContactModes, found: StageContacts, margin: Array
) -> None:
    """Event functions of the stages of a step, into rows 1 to 3 of `margin`, shape (4, k, 2)."""
    for i in range(3):
        for k in range(modes.normal.size):
            event_margins(
                law,
                modes,
                k,
                found.normal_force[i, k],
                found.friction_force[i, k],
                found.slip[i, k],
                found.apart[i, k],
                margin[1 + i, k],
            )


@kernel
def _first_zero(f: float, f0: float, f1: float, f2: float) -> float:
    """Share of the step at which an event function, positive at its start, first vanishes; or inf.

    On the cubic through its values at the start, `f`, and at the stages.
    """
    a, b, c = powers(f0 - f, f1 - f, f2 - f)
    # It first vanishes on one of the stretches between its turning points.
    first, second = 1.0, 1.0
    square = b * b - 3.0 * a * c
    if square > 0.0:
        q = -(b + np.copysign(np.sqrt(square), b))
        one = q / (3.0 * c) if c != 0.0 else 1.0
        two = a / q if q != 0.0 else 1.0
        first = min(one, two) if min(one, two) > 0.0 else 1.0
        second = max(one, two) if max(one, two) > 0.0 else 1.0
    low = 0.0
    for high in (min(first, 1.0), min(second, 1.0), 1.0):
        if f + high * (a + high * (b + high * c)) < 0.0:
            while high - low > 1e-15:
                middle = 0.5 * (low + high)
                if middle in (low, high):
                    break
                if f + middle * (a + middle * (b + middle * c)) < 0.0:
                    high = middle
                else:
                    low = middle
            return float(high)
        low = high
    return np.inf


@kernel
def first_event(margin: Array) -> float:
    """Share of the step at which the first contact would change its modes, or inf."""
    first = np.inf
    for k in range(margin.shape[1]):
        for event in range(2):
            f = margin[0, k, event]
            if np.isfinite(f):
                f0, f1, f2 = margin[1, k, event], margin[2, k, event], margin[3, k, event]
                # Contacts that share a force may be beyond their own margins: then what counts
                # is whether they go further.
                low = min(0.0, f) - ROUNDING * max(abs(f), abs(f0), abs(f1), abs(f2))
                first = min(first, _first_zero(f - low, f0 - low, f1 - low, f2 - low))
    return first


@kernel
def _part_at(model: Model, theta: float, k: int, stage_pose: Array, pose: Array) -> int:
    """What contact `k` meets at a share `theta` of a step (`touched_part`).

    `stage_pose`, shape (3, 3), is that of the tip at the stages; `pose`, shape (2, 3), holds the
    one at the start, and a scratch row.
    """
    for j in range(3):
        f = pose[0, j]
        a, b, c = powers(stage_pose[0, j] - f, stage_pose[1, j] - f, stage_pose[2, j] - f)
        pose[1, j] = f + theta * (a + theta * (b + theta * c))
    part: int = touched_part(model.fingertip, model.obstacle, pose[1], k)
    return part


@kernel
def first_kink(model: Model, modes: ContactModes, stage_pose: Array, pose: Array) -> float:
    """Share of the step at which a contact first meets another part of the object, or inf."""
    first = np.inf
    for k in range(modes.normal.size):
        if modes.normal[k] == OPEN:
            continue
        part = _part_at(model, 0.0, k, stage_pose, pose)
        low, high = 0.0, np.inf
        for i in range(3):
            if high == np.inf:
                if _part_at(model, NODES[i], k, stage_pose, pose) == part:
                    low = NODES[i]
                else:
                    high = NODES[i]
        if high < np.inf:
            for _ in range(KINK_HALVINGS):
                middle = 0.5 * (low + high)
                if _part_at(model, middle, k, stage_pose, pose) == part:
                    low = middle
                else:
                    high = middle
        first = min(first, high)
    return first
