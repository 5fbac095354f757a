"""Contact forces on the tip at a pose and twist, and their differentials.

Each contact follows the law (`kernels.contact_law`) in its present modes.  Where a flat face meets
the capsule's flank, the force acts at the centre of pressure that a bed of springs would have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import (
    CREEP_TOLERANCE,
    GRAZING,
    OPEN,
    SLIP_LEFT,
    SLIP_RIGHT,
    STICK,
    STICK_STIFFNESS,
    STICK_TOLERANCE,
    ContactLaw,
    ContactModes,
    contact_modes,
    normal_mode,
)
from hma_gripper_sim.kernels.proximity import Obstacle, is_outside, pressure_centre
from hma_gripper_sim.kernels.touch import Fingertip, Nearest, nearest_point, push_direction

Array = NDArray[np.float64]


class ContactWorkspace(NamedTuple):
    """Contact forces, their sum and its tangent; one row per contact candidate."""

    modes: ContactModes
    wanted: ContactModes  # what the last evaluation shows the modes should be
    normal_force: Array  # [N], shape (k,)
    friction_force: Array  # along the tangent, 90 degrees left of the normal [N], shape (k,)
    slip: Array  # tangential velocity [m/s], shape (k,)
    place: Array  # where the force acts, on the axis of a capsule [m], shape (k, 2)
    wrench: Array  # on the tip about the last joint: fx, fz, m; shape (3,)
    tangent: Array  # of the wrench to the pose, twist following with s; shape (3, 3)
    by_pose: Array  # of the wrench to the pose alone, shape (3, 3)
    by_twist: Array  # and to the twist alone, shape (3, 3)
    rigidity: Array  # of the forces to the tip's position [N/m] and speed [N s/m], shape (2,)
    noise: Array  # of the forces by rounding [N], slip that passes for none [m/s]; shape (2,)
    gap: Array  # of closed contacts, negative: depth [m], shape (k,)
    slip_row: Array  # of the slip to the twist, shape (k, 3)
    slip_drift: Array  # rate of the slip at a constant twist [m/s^2], shape (k,)
    row: Array  # scratch: differentials of normal and friction force by the pose, shape (2, 3)
    twist_row: Array  # scratch: and by the twist, shape (2, 3)
    pose: Array  # of the tip: where forces are evaluated, shape (3,)
    turn: Array  # cosine and sine of its angle, shape (2,)
    twist: Array  # and the twist there, shape (3,)
    increment: Array  # scratch: trial increment of the pose, shape (3,)
    residual: Array  # scratch: what it lacks to the chain's answer, shape (3,)
    correction: Array  # scratch, shape (3,)
    matrix: Array  # scratch, shape (3, 3)


class Lever(NamedTuple):
    """Where a contact force acts on the tip, and in which directions."""

    lx: float  # from the last joint, x [m]; of a capsule to its axis
    lz: float  # and z [m]
    ex: float  # direction of the normal force, x
    ez: float  # and z; the tangent is 90 degrees to the left of it
    shift: float  # along the capsule's axis from the closest point [m]
    shift_pose: float  # of that by a displacement into the object
    shift_turn: float  # by a turn of the tip [m]
    shift_swing: float  # and by one of the normal [m]


def contact_workspace(fingertip: Fingertip) -> ContactWorkspace:
    """Allocate the buffers for a fingertip."""
    k = 1 if fingertip.capsule else len(fingertip.points)
    return ContactWorkspace(
        contact_modes(k),
        contact_modes(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros((k, 2)),
        np.zeros(3),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros(2),
        np.zeros(2),
        np.zeros(k),
        np.zeros((k, 3)),
        np.zeros(k),
        np.zeros((2, 3)),
        np.zeros((2, 3)),
        np.zeros(3),
        np.array([1.0, 0.0]),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros((3, 3)),
    )


@kernel
def hold_along(compliance: Array, row: Array) -> float:
    """Stiffness that holds a stick, stiffer by far than the tip's answer along its slip [N/m].

    `row`, shape (3,), is of the slip to the tip's twist, `compliance`, shape (3, 3), the tip's.
    """
    answer = 0.0
    for i in range(3):
        for j in range(3):
            answer += row[i] * compliance[i, j] * row[j]
    return float(STICK_STIFFNESS / answer)


@kernel
def _rub(
    law: ContactLaw,
    s: float,
    compliance: Array,
    k: int,
    fresh: bool,
    workspace: ContactWorkspace,
) -> bool:
    """Friction of contact `k` in its present mode, into `workspace`, with its differential.

    Returns whether a stick force has settled.
    """
    modes, row, twist_row = workspace.modes, workspace.row, workspace.twist_row
    normal, slip, slip_row = workspace.normal_force[k], workspace.slip[k], workspace.slip_row[k]
    limit = law.friction * normal
    workspace.friction_force[k] = 0.0
    row[1, :] = 0.0
    twist_row[1, :] = 0.0
    if law.friction == 0.0 or s == 0.0:
        return True
    mode = modes.friction[k]
    if mode != STICK:
        workspace.friction_force[k] = mode * limit
        for j in range(3):
            row[1, j] = mode * law.friction * row[0, j]
            twist_row[1, j] = mode * law.friction * twist_row[0, j]
        if mode * slip > -law.slip_velocity:
            workspace.wanted.friction[k] = STICK
        return True
    if law.slip_velocity > 0.0:
        grip = law.friction * abs(normal) / law.slip_velocity
        friction = held = -grip * slip
        settled = not fresh and abs(friction - modes.stick_force[k]) <= CREEP_TOLERANCE * abs(limit)
        modes.stick_force[k] = friction
        if normal != 0.0:
            for j in range(3):
                row[1, j] = friction / normal * row[0, j]
                twist_row[1, j] = friction / normal * twist_row[0, j]
    else:
        grip = hold_along(compliance, slip_row) / s
        if not fresh:
            modes.stick_force[k] -= grip * slip
        held = modes.stick_force[k]
        friction = held - grip * slip
        still = abs(grip * slip) <= STICK_TOLERANCE * abs(limit) or abs(slip) <= workspace.noise[1]
        settled = still and not fresh
    workspace.rigidity[1] += grip
    for j in range(3):
        twist_row[1, j] -= grip * slip_row[j]
    workspace.friction_force[k] = friction
    if normal > 0.0 and not fresh and abs(held) > limit * (1.0 + 1e-9):
        workspace.wanted.friction[k] = SLIP_LEFT if held > 0.0 else SLIP_RIGHT
    return settled


@kernel
def _push(
    law: ContactLaw,
    at: Nearest,
    ex: float,
    ez: float,
    approach: float,
    k: int,
    workspace: ContactWorkspace,
) -> None:
    """Normal force of the contact `k`, which is not open, into `workspace`, with its differential.

    (ex, ez) is its direction.  In the layer where damping sets in the force grows with the depth.
    """
    row, twist_row = workspace.row, workspace.twist_row
    stiffness, damping = law.stiffness, law.damping
    workspace.normal_force[k] = -stiffness * at.gap - damping * approach
    if workspace.modes.normal[k] == GRAZING:
        stiffness += max(0.0, -law.damping * approach) / law.graze
        workspace.normal_force[k], damping = -stiffness * at.gap, 0.0
    workspace.rigidity[0] += stiffness
    workspace.rigidity[1] += law.damping
    row[0, 0] = -stiffness * at.nx
    row[0, 1] = -stiffness * at.nz
    row[0, 2] = -stiffness * (at.nz * at.lx - at.nx * at.lz)
    twist_row[0, 0] = -damping * ex
    twist_row[0, 1] = -damping * ez
    twist_row[0, 2] = -damping * (ez * at.lx - ex * at.lz)


@kernel
def _lever(at: Nearest, ex: float, ez: float) -> Lever:
    """Where the force acts: at the closest point, or on a flat overlap at its pressure centre."""
    if not (at.gap < 0.0 and at.ahead + at.behind > 0.0):
        return Lever(at.lx, at.lz, ex, ez, 0.0, 0.0, 0.0, 0.0)
    shift, to_depth, to_turn = pressure_centre(
        -at.gap, at.ahead, at.rise_ahead, at.behind, at.rise_behind
    )
    # A turn of the tip raises the segment ahead of, or behind, the deepest point.
    forward = -ez * at.ux + ex * at.uz
    turn = -to_turn * forward - to_depth * (at.nz * at.lx - at.nx * at.lz)
    swing = 0.0
    if at.curvature > 0.0:  # so does a swing of the normal, and it raises the face too
        drop = at.rise_ahead - at.nx * at.ux - at.nz * at.uz
        if at.behind > 0.0:
            drop = at.rise_behind + at.nx * at.ux + at.nz * at.uz
        along_face = np.sqrt(max(0.0, 1.0 - drop * drop))
        swing = to_turn * (forward - np.copysign(along_face, forward))
    lx, lz = at.lx + shift * at.ux, at.lz + shift * at.uz
    return Lever(lx, lz, ex, ez, shift, to_depth, turn, swing)


@kernel
def _swing(fingertip: Fingertip, at: Nearest, lever: Lever, j: int) -> float:
    """How far the force's direction turns with pose coordinate `j` [rad/m or 1]."""
    if at.curvature < 0.0 or fingertip.along_tip_normal:  # with the tip
        return 1.0 if j == 2 else 0.0
    if j == 0:
        return -at.curvature * lever.ez
    if j == 1:
        return at.curvature * lever.ex
    return at.curvature * (lever.ex * lever.lx + lever.ez * lever.lz)


@kernel
def _lever_change(at: Nearest, lever: Lever, psi: float, j: int) -> tuple[float, float]:
    """Change of the lever with pose coordinate `j`, with which the normal turns by `psi`."""
    lx, lz = lever.lx, lever.lz
    dlx = -lz if j == 2 else 0.0
    dlz = lx if j == 2 else 0.0
    if at.curvature < 0.0:  # an object's vertex glides along the capsule's flank
        dn = at.nx if j == 0 else at.nz
        if j == 2:
            dn = at.nz * (lx - lever.shift * at.ux) - at.nx * (lz - lever.shift * at.uz)
        dlx = dn * at.nx - at.distance * psi * lever.ez - (1.0 if j == 0 else 0.0)
        dlz = dn * at.nz + at.distance * psi * lever.ex - (1.0 if j == 1 else 0.0)
        if j == 2:
            dlx -= lever.shift * at.uz
            dlz += lever.shift * at.ux
    if lever.shift != 0.0:
        dshift = lever.shift_turn if j == 2 else -lever.shift_pose * (at.nx if j == 0 else at.nz)
        dshift += lever.shift_swing * psi
        dlx += dshift * at.ux
        dlz += dshift * at.uz
    return dlx, dlz


@kernel
def _add_forces(
    fingertip: Fingertip, at: Nearest, lever: Lever, k: int, workspace: ContactWorkspace
) -> None:
    """Add contact `k`'s forces to the wrench and its differentials; note how its slip drifts."""
    row, twist_row = workspace.row, workspace.twist_row
    normal, friction = workspace.normal_force[k], workspace.friction_force[k]
    lx, lz, ex, ez = lever.lx, lever.lz, lever.ex, lever.ez
    tx, tz = -ez, ex
    radius, omega = fingertip.radius, workspace.twist[2]
    fx, fz = normal * ex + friction * tx, normal * ez + friction * tz
    rise = ex * (workspace.twist[0] - omega * lz) + ez * (workspace.twist[1] + omega * lx)
    workspace.slip_drift[k] = 0.0
    for j in range(3):
        psi = _swing(fingertip, at, lever, j)
        dfx = row[0, j] * ex + row[1, j] * tx + psi * (normal * tx - friction * ex)
        dfz = row[0, j] * ez + row[1, j] * tz + psi * (normal * tz - friction * ez)
        dlx, dlz = _lever_change(at, lever, psi, j)
        workspace.by_pose[0, j] += dfx
        workspace.by_pose[1, j] += dfz
        workspace.by_pose[2, j] += dlx * fz - dlz * fx + lx * dfz - lz * dfx - radius * row[1, j]
        slip_rate = omega * (tz * dlx - tx * dlz) - psi * rise
        workspace.slip_drift[k] += slip_rate * workspace.twist[j]
        dfx = twist_row[0, j] * ex + twist_row[1, j] * tx
        dfz = twist_row[0, j] * ez + twist_row[1, j] * tz
        workspace.by_twist[0, j] += dfx
        workspace.by_twist[1, j] += dfz
        workspace.by_twist[2, j] += lx * dfz - lz * dfx - radius * twist_row[1, j]
    workspace.wrench[0] += fx
    workspace.wrench[1] += fz
    workspace.wrench[2] += lx * fz - lz * fx - radius * friction
    workspace.gap[k] = at.gap
    workspace.place[k, 0] = workspace.pose[0] + lx
    workspace.place[k, 1] = workspace.pose[1] + lz


@kernel
def _clear(workspace: ContactWorkspace) -> None:
    """No contact forces."""
    workspace.wrench[:] = 0.0
    workspace.by_pose[:, :] = 0.0
    workspace.by_twist[:, :] = 0.0
    workspace.rigidity[:] = 0.0
    for k in range(workspace.slip.size):
        workspace.normal_force[k] = 0.0
        workspace.friction_force[k] = 0.0
        workspace.wanted.normal[k] = workspace.modes.normal[k]
        workspace.wanted.friction[k] = workspace.modes.friction[k]


@kernel
def evaluate_contacts(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    compliance: Array,
    fresh: bool,
    workspace: ContactWorkspace,
) -> bool:
    """Evaluate the forces of the present modes at a pose and twist, and their differentials.

    Also notes the modes that the result asks for.

    Parameters
    ----------
    s, compliance
        Rate at which the twist follows the pose [1/s], and the tip's compliance, shape (3, 3):
        they say how hard a sticking contact must be held.
    fresh
        The modes have not shaped pose and twist yet: the slip of a stick means nothing.
    work
        Holds pose, turn, twist and modes.

    Returns
    -------
    bool
        Whether all stick forces have settled.
    """
    settled = True
    _clear(workspace)
    cos, sin = workspace.turn[0], workspace.turn[1]
    vx, vz, omega = workspace.twist[0], workspace.twist[1], workspace.twist[2]
    points = fingertip.points
    for k in range(workspace.slip.size):
        mode = workspace.modes.normal[k]
        if mode == OPEN and not fingertip.capsule:
            lx = cos * points[k, 0] - sin * points[k, 1]
            lz = sin * points[k, 0] + cos * points[k, 1]
            if is_outside(obstacle, workspace.pose[0] + lx, workspace.pose[1] + lz):
                continue
        at = nearest_point(fingertip, obstacle, workspace.pose[0], workspace.pose[1], cos, sin, k)
        if at.gap > 0.0 and mode == OPEN:
            continue
        ex, ez = push_direction(fingertip, at, cos, sin, k)
        approach = ex * (vx - omega * at.lz) + ez * (vz + omega * at.lx)
        push = -law.stiffness * at.gap - law.damping * approach
        workspace.wanted.normal[k] = normal_mode(law, mode, at.gap, push, approach)
        if mode == OPEN:
            slip = ex * (vz + omega * at.lx) - ez * (vx - omega * at.lz) - fingertip.radius * omega
            workspace.wanted.friction[k] = SLIP_RIGHT if slip > 0.0 else SLIP_LEFT
            continue
        _push(law, at, ex, ez, approach, k, workspace)
        lever = _lever(at, ex, ez)
        arm = ex * lever.lx + ez * lever.lz - fingertip.radius  # slip per rotation
        workspace.slip_row[k, 0] = -ez
        workspace.slip_row[k, 1] = ex
        workspace.slip_row[k, 2] = arm
        workspace.slip[k] = ex * vz - ez * vx + arm * omega
        settled &= _rub(law, s, compliance, k, fresh, workspace)
        _add_forces(fingertip, at, lever, k, workspace)
    return settled
