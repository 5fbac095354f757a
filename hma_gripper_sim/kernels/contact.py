"""Contact of the rigid tip with a rigid convex object: a problem in three unknowns.

The object is a convex polygon (its core; a circle's is one vertex) rounded by a radius.  The
tip touches it either with a capsule (one closest-point query) or with the sampled points of
the thesis' Parameters.m.  `solve_contact` finds the wrench for which the contact law and the
linearised chain agree: Newton's method on the pose of the tip with a mode for each contact
(open, grazing or closed; sticking or sliding either way), revised whenever it has converged.
Where that goes round in circles, friction is softened and hardened again.

Law (thesis 4.3): ``F_N = max(0, -k n - b n')`` for ``n <= 0`` and Coulomb friction, either
set-valued (a stick force is a multiplier that holds the slip at zero) or regularised with a
slip velocity.  Where a flat face meets the capsule's flank, the force acts at the centre of
pressure that a bed of springs would have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import TipResponse, rotation
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.proximity import (
    Obstacle,
    is_outside,
    point_distance,
    pressure_centre,
    segment_distance,
)

Array = NDArray[np.float64]
Modes = NDArray[np.int64]

OPEN, GRAZING, CLOSED = 0, 1, 2
STICK, SLIP_LEFT, SLIP_RIGHT = 0, 1, -1  # sliding: sign of the friction along the tangent

STICK_STIFFNESS = 1e4  # that holds a sticking contact, relative to the tip's own stiffness
STICK_TOLERANCE = 1e-6  # of a stick force, relative to the friction limit
CREEP_TOLERANCE = 1e-4  # of a regularised one, which rounding of the slip limits
ROUNDING = 1e-15  # of a gap or a slip, relative to the numbers that it is computed from
JUDGED = 1e-3  # error relative to the contact force at which the modes can be judged
MAX_ITERATIONS, CAREFUL_ITERATIONS = 30, 80
BLOCK_REVISIONS = 8  # of the modes of all contacts together, unless the search is careful
STILL = 1e-9  # slip that passes for none where contacts share a stick force, to the tip's speed
HARDENING = 0.2  # of the slip velocity from one softened problem to the next
LEVELS = 13  # the problem itself, softened ones, and itself again


class Fingertip(NamedTuple):
    """What of the tip can touch, in the frame of the last body."""

    points: Array  # capsule: two ends of its axis; sampled: contact points [m], shape (k, 2)
    normals: Array  # outward unit normals of sampled points, shape (k, 2)
    radius: float  # of the capsule; 0 for sampled points [m]
    capsule: bool
    along_tip_normal: bool  # sampled points push along their own normal, not the object's


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


class ContactWork(NamedTuple):
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
    pose: Array  # scratch: trial pose, shape (3,)
    twist: Array  # scratch: trial twist, shape (3,)
    increment: Array  # scratch: trial increment of the pose, shape (3,)
    residual: Array  # scratch: what it lacks to the chain's answer, shape (3,)
    correction: Array  # scratch, shape (3,)
    matrix: Array  # scratch, shape (3, 3)


def contact_modes(candidates: int) -> ContactModes:
    """All contacts open."""
    return ContactModes(
        np.zeros(candidates, dtype=np.int64),
        np.zeros(candidates, dtype=np.int64),
        np.zeros(candidates),
    )


def contact_work(fingertip: Fingertip) -> ContactWork:
    """Allocate the buffers for a fingertip."""
    k = 1 if fingertip.capsule else len(fingertip.points)
    return ContactWork(
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
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros((3, 3)),
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
    points = fingertip.points
    for k in range(modes.normal.size):
        if modes.normal[k] != OPEN:
            continue
        lx = cos * points[k, 0] - sin * points[k, 1]
        lz = sin * points[k, 0] + cos * points[k, 1]
        if fingertip.capsule:
            hx = cos * points[1, 0] - sin * points[1, 1]
            hz = sin * points[1, 0] + cos * points[1, 1]
            distance, nx, nz, along, _, _, _, _, _ = segment_distance(
                obstacle, pose[0] + lx, pose[1] + lz, pose[0] + hx, pose[1] + hz
            )
            lx += along * (hx - lx)
            lz += along * (hz - lz)
        else:
            distance, nx, nz, _ = point_distance(obstacle, pose[0] + lx, pose[1] + lz)
        gap[k, 0] = distance - obstacle.radius - fingertip.radius
        rate[k, 0] = nx * (twist[0] - twist[2] * lz) + nz * (twist[1] + twist[2] * lx)


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
    points = fingertip.points
    lx = cos * points[k, 0] - sin * points[k, 1]
    lz = sin * points[k, 0] + cos * points[k, 1]
    if fingertip.capsule:
        hx = cos * points[1, 0] - sin * points[1, 1]
        hz = sin * points[1, 0] + cos * points[1, 1]
        distance, ex, ez, along, _, _, _, _, _ = segment_distance(
            obstacle, pose[0] + lx, pose[1] + lz, pose[0] + hx, pose[1] + hz
        )
        lx += along * (hx - lx)
        lz += along * (hz - lz)
    else:
        distance, ex, ez, _ = point_distance(obstacle, pose[0] + lx, pose[1] + lz)
    if fingertip.along_tip_normal:
        ex = sin * fingertip.normals[k, 1] - cos * fingertip.normals[k, 0]
        ez = -sin * fingertip.normals[k, 0] - cos * fingertip.normals[k, 1]
    gap = distance - obstacle.radius - fingertip.radius
    approach = ex * (twist[0] - twist[2] * lz) + ez * (twist[1] + twist[2] * lx)
    return float(max(gap, gap + law.damping / law.stiffness * approach))


@kernel
def touched_part(fingertip: Fingertip, obstacle: Obstacle, pose: Array, k: int) -> int:
    """Number of the part of the object that contact `k` meets: its force is smooth on each.

    Faces have even numbers, vertices odd ones, and those that meet the capsule's flank negative
    ones.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    points = fingertip.points
    x = pose[0] + cos * points[k, 0] - sin * points[k, 1]
    z = pose[1] + sin * points[k, 0] + cos * points[k, 1]
    if fingertip.capsule:
        hx = pose[0] + cos * points[1, 0] - sin * points[1, 1]
        hz = pose[1] + sin * points[1, 0] + cos * points[1, 1]
        _, nx, nz, _, curvature, _, _, _, _ = segment_distance(obstacle, x, z, hx, hz)
    else:
        _, nx, nz, curvature = point_distance(obstacle, x, z)
    # The face that looks along the direction of the distance, or the vertex furthest along it.
    of = obstacle.normals if curvature == 0.0 else obstacle.vertices
    part, furthest = 0, -np.inf
    for i in range(of.shape[0]):
        reach = nx * of[i, 0] + nz * of[i, 1]
        if reach > furthest:
            part, furthest = i, reach
    if curvature == 0.0:
        return 2 * part
    return 2 * part + 1 if curvature > 0.0 else -1 - part


@kernel
def _normal_mode(law: ContactLaw, mode: int, gap: float, push: float, approach: float) -> int:
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
def _rub(
    law: ContactLaw,
    s: float,
    compliance: Array,
    k: int,
    normal: float,
    slip: float,
    tx: float,
    tz: float,
    lever: float,
    fresh: bool,
    work: ContactWork,
) -> bool:
    """Friction of contact `k` in its present mode, into `work`, with its differential.

    `lever` is the slip per rotation of the tip.  Returns whether a stick force has settled.
    """
    modes, row, twist_row = work.modes, work.row, work.twist_row
    limit = law.friction * normal
    work.friction_force[k] = 0.0
    row[1, :] = 0.0
    twist_row[1, :] = 0.0
    if law.friction == 0.0 or s == 0.0:
        return True
    regularised = law.slip_velocity > 0.0
    mode = modes.friction[k]
    if mode != STICK:
        work.friction_force[k] = mode * limit
        for j in range(3):
            row[1, j] = mode * law.friction * row[0, j]
            twist_row[1, j] = mode * law.friction * twist_row[0, j]
        if mode * slip > -law.slip_velocity:
            work.wanted.friction[k] = STICK
        return True
    if regularised:
        grip = law.friction * abs(normal) / law.slip_velocity
        friction = held = -grip * slip
        settled = not fresh and abs(friction - modes.stick_force[k]) <= CREEP_TOLERANCE * abs(limit)
        modes.stick_force[k] = friction
        if normal != 0.0:
            for j in range(3):
                row[1, j] = friction / normal * row[0, j]
                twist_row[1, j] = friction / normal * twist_row[0, j]
    else:
        c = compliance
        answer = tx * (c[0, 0] * tx + c[0, 1] * tz + c[0, 2] * lever)
        answer += tz * (c[1, 0] * tx + c[1, 1] * tz + c[1, 2] * lever)
        answer += lever * (c[2, 0] * tx + c[2, 1] * tz + c[2, 2] * lever)
        grip = STICK_STIFFNESS / (s * answer)
        if not fresh:
            modes.stick_force[k] -= grip * slip
        held = modes.stick_force[k]
        friction = held - grip * slip
        still = abs(grip * slip) <= STICK_TOLERANCE * abs(limit) or abs(slip) <= work.noise[1]
        settled = still and not fresh
    work.rigidity[1] += grip
    twist_row[1, 0] -= grip * tx
    twist_row[1, 1] -= grip * tz
    twist_row[1, 2] -= grip * lever
    work.friction_force[k] = friction
    if normal > 0.0 and not fresh and abs(held) > limit * (1.0 + 1e-9):
        work.wanted.friction[k] = SLIP_LEFT if held > 0.0 else SLIP_RIGHT
    return settled


@kernel
def _evaluate(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    tip: TipResponse,
    fresh: bool,
    work: ContactWork,
) -> bool:
    """Evaluate the forces of the present modes and their tangent at the trial increment.

    The twist follows the increment with the rate `s`.  Returns whether all stick forces have
    settled.
    """
    for j in range(3):
        work.pose[j] = tip.pose[j] + work.increment[j]
        work.twist[j] = tip.twist[j] + s * work.increment[j]
    turn_cos, turn_sin = rotation(work.increment[2])
    cos = tip.turn[0] * turn_cos - tip.turn[1] * turn_sin
    sin = tip.turn[1] * turn_cos + tip.turn[0] * turn_sin
    settled = evaluate_contacts(fingertip, obstacle, law, s, tip.compliance, cos, sin, fresh, work)
    for i in range(3):
        for j in range(3):
            work.tangent[i, j] = work.by_pose[i, j] + s * work.by_twist[i, j]
    return settled


@kernel
def evaluate_contacts(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    compliance: Array,
    cos: float,
    sin: float,
    fresh: bool,
    work: ContactWork,
) -> bool:
    """Evaluate the forces of the present modes at a pose and twist, and their differentials.

    Pose and twist are in `work`, (cos, sin) are of the pose's angle.  `s` and the tip's
    `compliance`, shape (3, 3), say how hard a sticking contact must be held.  Also notes the
    modes that the result asks for.  `fresh` says that the modes have not shaped pose and twist
    yet: then the slip of a sticking contact means nothing.

    Returns whether all stick forces have settled.
    """
    modes, wanted = work.modes, work.wanted
    settled = True
    work.wrench[:] = 0.0
    work.by_pose[:, :] = 0.0
    work.by_twist[:, :] = 0.0
    work.rigidity[:] = 0.0
    vx, vz, omega = work.twist[0], work.twist[1], work.twist[2]
    points, radius = fingertip.points, fingertip.radius
    for k in range(modes.normal.size):
        work.normal_force[k] = 0.0
        work.friction_force[k] = 0.0
        mode = modes.normal[k]
        wanted.normal[k] = mode
        wanted.friction[k] = modes.friction[k]
        # Lever from the last joint to the point of the tip that is closest to the object.
        lx = cos * points[k, 0] - sin * points[k, 1]
        lz = sin * points[k, 0] + cos * points[k, 1]
        gliding = False  # an object's vertex meets the capsule's flank
        ahead, rise_ahead, behind, rise_behind, ux, uz = 0.0, 1.0, 0.0, 1.0, 0.0, 0.0
        if fingertip.capsule:
            hx = cos * points[1, 0] - sin * points[1, 1]
            hz = sin * points[1, 0] + cos * points[1, 1]
            distance, nx, nz, along, curvature, ahead, rise_ahead, behind, rise_behind = (
                segment_distance(
                    obstacle,
                    work.pose[0] + lx,
                    work.pose[1] + lz,
                    work.pose[0] + hx,
                    work.pose[1] + hz,
                )
            )
            length = np.sqrt((hx - lx) ** 2 + (hz - lz) ** 2)
            ux, uz = (hx - lx) / length, (hz - lz) / length
            lx += along * length * ux
            lz += along * length * uz
            gliding = curvature < 0.0
        else:
            x, z = work.pose[0] + lx, work.pose[1] + lz
            if mode == OPEN and is_outside(obstacle, x, z):
                continue
            distance, nx, nz, curvature = point_distance(obstacle, x, z)
        turning = gliding or fingertip.along_tip_normal  # the force's direction turns with the tip
        gap = distance - obstacle.radius - radius
        if gap > 0.0 and mode == OPEN:
            continue
        ex, ez = nx, nz
        if fingertip.along_tip_normal:
            ex = sin * fingertip.normals[k, 1] - cos * fingertip.normals[k, 0]
            ez = -sin * fingertip.normals[k, 0] - cos * fingertip.normals[k, 1]
        tx, tz = -ez, ex
        approach = ex * (vx - omega * lz) + ez * (vz + omega * lx)
        push = -law.stiffness * gap - law.damping * approach

        wanted.normal[k] = _normal_mode(law, mode, gap, push, approach)
        if mode == OPEN:
            slip = tx * (vx - omega * lz) + tz * (vz + omega * lx) - radius * omega
            wanted.friction[k] = SLIP_RIGHT if slip > 0.0 else SLIP_LEFT
            continue
        row, twist_row = work.row, work.twist_row
        normal, stiffness, damping = push, law.stiffness, law.damping
        if mode == GRAZING:
            stiffness += max(0.0, -law.damping * approach) / law.graze
            normal, damping = -stiffness * gap, 0.0
        work.rigidity[0] += stiffness
        work.rigidity[1] += law.damping
        row[0, 0] = -stiffness * nx
        row[0, 1] = -stiffness * nz
        row[0, 2] = -stiffness * (nz * lx - nx * lz)
        twist_row[0, 0] = -damping * ex
        twist_row[0, 1] = -damping * ez
        twist_row[0, 2] = -damping * (ez * lx - ex * lz)

        shift, shift_turn, shift_swing, to_depth = 0.0, 0.0, 0.0, 0.0
        if gap < 0.0 and ahead + behind > 0.0:
            shift, to_depth, to_turn = pressure_centre(-gap, ahead, rise_ahead, behind, rise_behind)
            # A turn of the tip raises the segment ahead of, or behind, the deepest point.
            forward = tx * ux + tz * uz
            shift_turn = -to_turn * forward - to_depth * (nz * lx - nx * lz)
            if curvature > 0.0:  # so does a swing of the normal, and it raises the face too
                drop = rise_ahead - nx * ux - nz * uz
                if behind > 0.0:
                    drop = rise_behind + nx * ux + nz * uz
                along_face = np.sqrt(max(0.0, 1.0 - drop * drop))
                shift_swing = to_turn * (forward - np.copysign(along_face, forward))
            lx += shift * ux
            lz += shift * uz

        lever = tz * lx - tx * lz - radius  # slip per rotation
        slip = tx * vx + tz * vz + lever * omega
        settled &= _rub(law, s, compliance, k, normal, slip, tx, tz, lever, fresh, work)
        friction = work.friction_force[k]

        fx, fz = normal * ex + friction * tx, normal * ez + friction * tz
        work.slip_row[k, 0] = tx
        work.slip_row[k, 1] = tz
        work.slip_row[k, 2] = lever
        work.slip_drift[k] = 0.0
        rise = ex * (vx - omega * lz) + ez * (vz + omega * lx)
        for j in range(3):
            if turning:
                psi = 1.0 if j == 2 else 0.0
            elif j == 0:
                psi = curvature * tx
            elif j == 1:
                psi = curvature * tz
            else:
                psi = curvature * (lever + radius)
            dfx = row[0, j] * ex + row[1, j] * tx + psi * (normal * tx - friction * ex)
            dfz = row[0, j] * ez + row[1, j] * tz + psi * (normal * tz - friction * ez)
            dlx = -lz if j == 2 else 0.0
            dlz = lx if j == 2 else 0.0
            if gliding:
                dn = nx if j == 0 else nz
                if j == 2:
                    dn = nz * (lx - shift * ux) - nx * (lz - shift * uz)
                dlx = dn * nx + distance * psi * tx - (1.0 if j == 0 else 0.0)
                dlz = dn * nz + distance * psi * tz - (1.0 if j == 1 else 0.0)
                if j == 2:
                    dlx -= shift * uz
                    dlz += shift * ux
            if shift != 0.0:
                dshift = shift_turn if j == 2 else -to_depth * (nx if j == 0 else nz)
                dshift += shift_swing * psi
                dlx += dshift * ux
                dlz += dshift * uz
            work.by_pose[0, j] += dfx
            work.by_pose[1, j] += dfz
            work.by_pose[2, j] += dlx * fz - dlz * fx + lx * dfz - lz * dfx - radius * row[1, j]
            slip_rate = omega * (tz * dlx - tx * dlz) - psi * rise
            work.slip_drift[k] += slip_rate * work.twist[j]
            dfx = twist_row[0, j] * ex + twist_row[1, j] * tx
            dfz = twist_row[0, j] * ez + twist_row[1, j] * tz
            work.by_twist[0, j] += dfx
            work.by_twist[1, j] += dfz
            work.by_twist[2, j] += lx * dfz - lz * dfx - radius * twist_row[1, j]
        work.wrench[0] += fx
        work.wrench[1] += fz
        work.wrench[2] += lx * fz - lz * fx - radius * friction
        work.normal_force[k] = normal
        work.slip[k] = slip
        work.gap[k] = gap
        work.place[k, 0] = work.pose[0] + lx
        work.place[k, 1] = work.pose[1] + lz
    return settled


@kernel
def _solve3(matrix: Array, vector: Array, solution: Array) -> bool:
    """Solve a 3x3 system by Cramer's rule with one step of iterative refinement."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 0], matrix[1, 1], matrix[1, 2]
    g, h, i = matrix[2, 0], matrix[2, 1], matrix[2, 2]
    ei, fg, dh = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * ei + b * fg + c * dh
    if det == 0.0 or not np.isfinite(det):
        return False
    inverse = 1.0 / det
    rx, ry, rz = vector[0], vector[1], vector[2]
    x = (ei * rx + (c * h - b * i) * ry + (b * f - c * e) * rz) * inverse
    y = (fg * rx + (a * i - c * g) * ry + (c * d - a * f) * rz) * inverse
    z = (dh * rx + (b * g - a * h) * ry + (a * e - b * d) * rz) * inverse
    rx -= a * x + b * y + c * z
    ry -= d * x + e * y + f * z
    rz -= g * x + h * y + i * z
    solution[0] = x + (ei * rx + (c * h - b * i) * ry + (b * f - c * e) * rz) * inverse
    solution[1] = y + (fg * rx + (a * i - c * g) * ry + (c * d - a * f) * rz) * inverse
    solution[2] = z + (dh * rx + (b * g - a * h) * ry + (a * e - b * d) * rz) * inverse
    return True


@kernel
def _revise_modes(work: ContactWork, revision: int, block: int) -> bool:
    """Take over the wanted modes; return whether any changed.

    The first revision only closes contacts, those after `block` ones change one contact each.
    A contact that closes slides as it moves; if that has been tried, it sticks: one of both has
    a solution unless the step is too long.
    """
    modes, wanted = work.modes, work.wanted
    changed = False
    for k in range(modes.normal.size):
        if wanted.normal[k] != modes.normal[k]:
            if modes.normal[k] == OPEN:
                modes.friction[k] = wanted.friction[k] if revision % 2 == 0 else STICK
                modes.stick_force[k] = 0.0
            elif revision == 0:
                continue
            modes.normal[k] = wanted.normal[k]
        elif wanted.friction[k] != modes.friction[k] and revision > 0 and modes.normal[k] != OPEN:
            modes.stick_force[k] = work.friction_force[k]
            modes.friction[k] = wanted.friction[k]
        else:
            continue
        changed = True
        if revision > block:
            break
    return changed


@kernel
def _measure_noise(s: float, reach: float, tip: TipResponse, work: ContactWork) -> None:
    """Note what rounding makes of the contact forces, and the slip that passes for none.

    `reach` [m] makes an angle comparable to a way.
    """
    moved, speed = 0.0, 0.0
    for j in range(3):
        length = reach if j == 2 else 1.0
        moved += length * (abs(work.increment[j]) + abs(tip.free[j]))
        speed += length * (abs(tip.twist[j]) + s * abs(work.increment[j]))
    place = abs(tip.pose[0]) + abs(tip.pose[1])
    noise = work.rigidity[0] * place + work.rigidity[1] * speed
    noise += moved / (tip.compliance[0, 0] + tip.compliance[1, 1])
    work.noise[0] = ROUNDING * noise
    work.noise[1] = STILL * speed


@kernel
def _search(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    precision: float,
    careful: bool,
    tip: TipResponse,
    work: ContactWork,
) -> bool:
    """`solve_contact` from the present modes and trial increment.

    A `careful` search lets only one contact change its mode at a time, as Murty's least-index
    method does (K. G. Murty, Opsearch 11, 1974), which cannot go round in circles where there
    is one solution for all loads.
    """
    compliance = tip.compliance[0, 0] + tip.compliance[1, 1]
    reach = np.sqrt(compliance / tip.compliance[2, 2])  # makes an angle comparable to a way
    work.noise[:] = 0.0
    revisions = -1
    fresh = revisions < 0  # not a literal True: numba would compile everything for that, too
    block = 0 if careful else BLOCK_REVISIONS
    for _ in range(CAREFUL_ITERATIONS if careful else MAX_ITERATIONS):
        settled = _evaluate(fingertip, obstacle, law, s, tip, fresh, work)
        if revisions < 0:
            revisions = 0
            if _revise_modes(work, 0, block):
                continue
        square = 0.0
        for i in range(3):
            r = work.increment[i] - tip.free[i]
            for j in range(3):
                r -= tip.compliance[i, j] * (work.wrench[j] - tip.wrench[j])
            work.residual[i] = r
            weight = reach if i == 2 else 1.0
            square += (weight * r) ** 2
        lack = np.sqrt(square) / compliance  # as a force
        pressed = 0.0
        for k in range(work.normal_force.size):
            pressed += abs(work.normal_force[k])
        _measure_noise(s, reach, tip, work)
        noise = work.noise[0] + ROUNDING * pressed
        if lack <= noise + JUDGED * pressed:
            revisions += 1
            if _revise_modes(work, revisions, block):
                fresh = True
                continue
            if settled and lack <= noise + precision * pressed:
                return True
        for i in range(3):
            for j in range(3):
                entry = 1.0 if i == j else 0.0
                for k in range(3):
                    entry -= tip.compliance[i, k] * work.tangent[k, j]
                work.matrix[i, j] = entry
        if not _solve3(work.matrix, work.residual, work.correction):
            return False
        for j in range(3):
            work.increment[j] -= work.correction[j]
        fresh = False
    return False


@kernel
def _soften(law: ContactLaw, s: float, level: int, tip: TipResponse) -> ContactLaw:
    """The law with a slip velocity that falls from the tip's speed from level to level."""
    speed = abs(tip.twist[0] + s * tip.free[0]) + abs(tip.twist[1] + s * tip.free[1])
    slip_velocity = max(law.slip_velocity, speed * HARDENING ** (level - 1))
    return ContactLaw(law.stiffness, law.damping, law.friction, slip_velocity, law.graze)


@kernel
def solve_contact(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    precision: float,
    tip: TipResponse,
    work: ContactWork,
) -> bool:
    """Find the contact wrench for which contact law and linearised chain agree.

    The search starts from the present modes.  Where they have nothing to do with the solution,
    as after a jump of the velocity, and several contacts share the friction, it can go round
    in circles.  Then friction is softened until all contacts creep, which has one solution that
    Newton's method finds from anywhere, and hardened again.

    Leaves the wrench and the modes in `work`; returns False when there was no agreement
    within `precision` of the contact force or rounding.
    """
    level = 0
    while True:
        softened = 0 < level < LEVELS
        eased = _soften(law, s, level, tip) if softened else law
        if level <= 1:
            for j in range(3):
                work.increment[j] = tip.free[j]
        if level == 1:
            work.modes.normal[:] = OPEN
            work.modes.friction[:] = STICK
        accuracy = JUDGED if softened else precision
        found = _search(fingertip, obstacle, eased, s, accuracy, level > 0, tip, work)
        if level == LEVELS or (level == 0 and (found or law.friction == 0.0 or s == 0.0)):
            return found
        # Rounding may end the softened problems early.
        level = level + 1 if found or level == 0 else LEVELS
