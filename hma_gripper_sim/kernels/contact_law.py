"""Laws of a contact between tip and object: normal force, friction, and the modes of both.

Penalty contact (thesis 4.3): ``F_N = max(0, -k n - b n')`` for ``n <= 0``, and Coulomb friction,
either set-valued (a stick force is a multiplier that holds the slip at zero) or regularised with
a slip velocity.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.proximity import Obstacle
from hma_gripper_sim.kernels.touch import Fingertip, nearest_point, push_direction

Array = NDArray[np.float64]
Modes = NDArray[np.int64]

OPEN, GRAZING, CLOSED = 0, 1, 2
STICK, SLIP_LEFT, SLIP_RIGHT = 0, 1, -1  # sliding: sign of the friction along the tangent

STICK_STIFFNESS = 1e4  # that holds a sticking contact, relative to the tip's own stiffness
STICK_TOLERANCE = 1e-6  # of a stick force, relative to the friction limit
CREEP_TOLERANCE = 1e-4  # of a regularised one, which rounding of the slip limits


class ContactLaw(NamedTuple):
    """Penalty contact with Coulomb friction."""

    stiffness: float  # N/m
    damping: float  # N s/m
    friction: float
    slip_velocity: float  # m/s; 0: set-valued friction
    graze: float  # m; depth over which damping sets in, so that the force is continuous


class ContactModes(NamedTuple):
    """What each contact candidate does; part of the state of a half."""

    normal: Modes  # OPEN, GRAZING or CLOSED, shape (k,)
    friction: Modes  # STICK, SLIP_LEFT or SLIP_RIGHT, shape (k,)
    stick_force: Array  # friction force of a sticking contact [N], shape (k,)


def contact_modes(candidates: int) -> ContactModes:
    """All contacts open."""
    return ContactModes(
        np.zeros(candidates, dtype=np.int64),
        np.zeros(candidates, dtype=np.int64),
        np.zeros(candidates),
    )


@kernel
def copy_modes(source: ContactModes, target: ContactModes) -> None:
    """Copy all modes."""
    for k in range(source.normal.size):
        target.normal[k] = source.normal[k]
        target.friction[k] = source.friction[k]
        target.stick_force[k] = source.stick_force[k]


@kernel
def measure_gaps(
    fingertip: Fingertip,
    obstacle: Obstacle,
    pose: Array,
    twist: Array,
    modes: ContactModes,
    gap: Array,
    rate: Array,
) -> None:
    """Gap of each open contact [m] and its rate [m/s], into columns 0, shape (k, ...)."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(modes.normal.size):
        if modes.normal[k] == OPEN:
            at = nearest_point(fingertip, obstacle, pose[0], pose[1], cos, sin, k)
            gap[k, 0] = at.gap
            vx, vz = twist[0] - twist[2] * at.lz, twist[1] + twist[2] * at.lx
            rate[k, 0] = at.nx * vx + at.nz * vz


@kernel
def closing_margin(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    pose: Array,
    twist: Array,
    k: int,
) -> float:
    """How far the open contact `k` is from closing [m]; negative: it overlaps and would push."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    at = nearest_point(fingertip, obstacle, pose[0], pose[1], cos, sin, k)
    ex, ez = push_direction(fingertip, at, cos, sin, k)
    approach = ex * (twist[0] - twist[2] * at.lz) + ez * (twist[1] + twist[2] * at.lx)
    return float(max(at.gap, at.gap + law.damping / law.stiffness * approach))


@kernel
def normal_mode(law: ContactLaw, mode: int, gap: float, push: float, approach: float) -> int:
    """Revise a normal mode; `push` is the force that the closed contact would have."""
    if mode == CLOSED:
        if gap > 0.0:
            return GRAZING if approach < 0.0 else OPEN
        return CLOSED if push > 0.0 else OPEN
    if mode == GRAZING:
        if gap > 0.0 or approach >= 0.0:
            return OPEN
        return CLOSED if gap < -law.graze else GRAZING
    return CLOSED if gap < 0.0 and push > 0.0 else OPEN


@kernel
def is_stuck(law: ContactLaw, modes: ContactModes, k: int) -> bool:
    """Whether the friction of contact `k` is a multiplier."""
    held = modes.normal[k] != OPEN and modes.friction[k] == STICK
    return bool(held and law.friction > 0.0 and law.slip_velocity == 0.0)
