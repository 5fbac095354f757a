"""One half of the gripper as a planar chain: implicit articulated-body sweeps, O(n).

An implicit stage asks for joint angles `q` that balance every joint, with velocities and
accelerations tied to them by ``v = s (q - q0)`` and ``a = s (v - v0)`` (`s` in 1/s; ``s = 0``
is statics).  One Newton iteration is a sweep from the tip to the base that carries the
loads of the subtree and their 3x3 tangent and eliminates one joint angle at a time, and a
sweep back for the increments.  The contact wrench on the tip is left open: the inward sweep
takes an estimate of it (whose line of thrust stiffens or softens the chain) and also returns
how the tip answers to a change of it, so that contact is a problem in three unknowns
(`kernels.contact`).

The tangent leaves out the change of Coriolis terms (relative size: rotation during one
stage), so Newton converges linearly there with that small factor, and to the exact balance.
Vectors are (x, z); angles are counter-clockwise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.articulated_body import (
    add_body,
    add_compliance,
    carry_rigidity,
    carry_wrenches,
    eliminate_rigidity,
    eliminate_wrenches,
    hinge_moments,
    hinge_row,
    mirror_upper_half,
    no_rigidity,
    shortening_moments,
    shortening_row,
    unit_wrenches,
)
from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


class Chain(NamedTuple):
    """A planar chain of rigid bodies, ordered from the base to the tip."""

    root: Array  # first joint, in the base frame [m], shape (2,)
    link: Array  # from a body's joint to the next one, body frame [m], shape (n, 2)
    centre: Array  # from a body's joint to its centre of gravity, body frame [m], shape (n, 2)
    rest: Array  # stress-free relative angle [rad], shape (n,)
    mass: Array  # [kg], shape (n,)
    inertia: Array  # about the centre of gravity [kg m^2], shape (n,)
    stiffness: Array  # [N m/rad], shape (n,)
    damping: Array  # [N m s/rad], shape (n,)
    # A hinged beam is shorter than a bent one: on top of its angle q a joint slides by
    # `straightening` q^2 along the beam [m/rad^2], shape (n,); 0: a plain hinge.
    straightening: Array


class ChainWorkspace(NamedTuple):
    """What the two sweeps of one Newton iteration leave for each other."""

    link: Array  # from a body's joint to the next one, world frame, shape (n, 2)
    shortening: Array  # what a joint moves by per angle beside turning, world frame, shape (n, 2)
    swerve: Array  # and the change of that per angle, shape (n, 2)
    arm: Array  # from a body's joint to its centre of gravity, world frame, shape (n, 2)
    load: Array  # gravity and inertia at the centre of gravity: fx, fz, moment; shape (n, 3)
    coupling: Array  # tangent row of the joint moment, shape (n, 3)
    give: Array  # inverse tangent of the joint moment to its own angle, shape (n,)
    imbalance: Array  # joint moment still to be balanced, shape (n,)
    lever: Array  # joint moment from unit wrenches on the tip, shape (n, 3)


class TipResponse(NamedTuple):
    """Where the tip is, and how the linearised chain lets it move."""

    pose: Array  # x, z of the last joint and the last body's angle, shape (3,)
    turn: Array  # cosine and sine of that angle, shape (2,)
    twist: Array  # their rates, shape (3,)
    acceleration: Array  # and the rates of those, shape (3,)
    wrench: Array  # estimated contact wrench about the last joint: fx, fz, m; shape (3,)
    free: Array  # increment of the pose under the estimated wrench, shape (3,)
    compliance: Array  # increment for unit changes of the wrench, shape (3, 3)
    root_force: Array  # linearised vertical load on the base: [0], and per unit change [1:4]


def chain_workspace(n: int) -> ChainWorkspace:
    """Allocate the buffers for a chain of `n` joints."""
    return ChainWorkspace(
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros(n),
        np.zeros(n),
        np.zeros((n, 3)),
    )


def tip_response() -> TipResponse:
    """Allocate the buffers of a tip."""
    return TipResponse(
        np.zeros(3),
        np.array([1.0, 0.0]),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros(3),
        np.zeros((3, 3)),
        np.zeros(4),
    )


@kernel
def rotation(angle: float) -> tuple[float, float]:
    """Cosine and sine; by their series, to rounding, for the small angles of most joints."""
    if abs(angle) > 0.35:
        return np.cos(angle), np.sin(angle)
    y = angle * angle
    cos = y * (1 / 24 - y * (1 / 720 - y * (1 / 40320 - y * (1 / 3628800 - y / 479001600))))
    sin = y * (1 / 120 - y * (1 / 5040 - y * (1 / 362880 - y / 39916800)))
    return 1.0 - y * (0.5 - cos), angle * (1.0 - y * (1 / 6 - sin))


@kernel
def _shorten(
    straightening: float, q: float, tx: float, tz: float, i: int, workspace: ChainWorkspace
) -> tuple[float, float]:
    """How far joint `i` has slid; what that changes by per angle goes into `workspace`.

    (tx, tz) is the beam's direction there: half-way between the bodies before and after it.
    """
    along, across = 2.0 * straightening * q, 0.5 * straightening * q * q
    workspace.shortening[i, 0] = along * tx - across * tz
    workspace.shortening[i, 1] = along * tz + across * tx
    bend = 2.0 * straightening - 0.5 * across
    workspace.swerve[i, 0] = bend * tx - along * tz
    workspace.swerve[i, 1] = bend * tz + along * tx
    slid = straightening * q * q
    return slid * tx, slid * tz


@kernel
def place(
    chain: Chain,
    base: Array,
    gravity: float,
    q: Array,
    v: Array,
    a: Array,
    workspace: ChainWorkspace,
    tip: TipResponse,
) -> None:
    """Outward sweep: place the bodies and load them with gravity and inertia.

    `base` holds height, vertical velocity and vertical acceleration of the base.
    """
    n = q.size
    angle, omega, alpha = 0.0, 0.0, 0.0
    cos, sin = 1.0, 0.0
    x, z = chain.root[0], base[0] + chain.root[1]
    vx, vz = 0.0, base[1]
    ax, az = 0.0, base[2]
    for i in range(n):
        angle += chain.rest[i] + q[i]
        omega += v[i]
        alpha += a[i]
        if chain.straightening[i] > 0.0:
            half_cos, half_sin = rotation(0.5 * q[i])
            if chain.rest[i] != 0.0:
                rest_cos, rest_sin = rotation(chain.rest[i])
                cos, sin = cos * rest_cos - sin * rest_sin, sin * rest_cos + cos * rest_sin
            tx, tz = cos * half_cos - sin * half_sin, sin * half_cos + cos * half_sin
            cos, sin = tx * half_cos - tz * half_sin, tz * half_cos + tx * half_sin
            sx, sz = _shorten(chain.straightening[i], q[i], tx, tz, i, workspace)
            gx, gz = workspace.shortening[i, 0], workspace.shortening[i, 1]
            hx, hz = workspace.swerve[i, 0], workspace.swerve[i, 1]
            before = omega - v[i]
            x += sx
            z += sz
            vx += v[i] * gx - before * sz
            vz += v[i] * gz + before * sx
            turned = alpha - a[i]
            ax += a[i] * gx + v[i] * (v[i] * hx - 2.0 * before * gz)
            az += a[i] * gz + v[i] * (v[i] * hz + 2.0 * before * gx)
            ax -= turned * sz + before * before * sx
            az += turned * sx - before * before * sz
            if i > 0:
                workspace.link[i - 1, 0] += sx
                workspace.link[i - 1, 1] += sz
        else:
            turn_cos, turn_sin = rotation(chain.rest[i] + q[i])
            cos, sin = cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin
        cx = cos * chain.centre[i, 0] - sin * chain.centre[i, 1]
        cz = sin * chain.centre[i, 0] + cos * chain.centre[i, 1]
        workspace.arm[i, 0] = cx
        workspace.arm[i, 1] = cz
        mass = chain.mass[i]
        workspace.load[i, 0] = -mass * (ax - alpha * cz - omega * omega * cx)
        workspace.load[i, 1] = -mass * (az + alpha * cx - omega * omega * cz + gravity)
        workspace.load[i, 2] = -chain.inertia[i] * alpha
        if i == n - 1:
            break
        rx = cos * chain.link[i, 0] - sin * chain.link[i, 1]
        rz = sin * chain.link[i, 0] + cos * chain.link[i, 1]
        workspace.link[i, 0] = rx
        workspace.link[i, 1] = rz
        x += rx
        z += rz
        vx -= omega * rz
        vz += omega * rx
        ax += -alpha * rz - omega * omega * rx
        az += alpha * rx - omega * omega * rz
    tip.pose[0] = x
    tip.pose[1] = z
    tip.pose[2] = angle
    tip.turn[0] = cos
    tip.turn[1] = sin
    tip.twist[0] = vx
    tip.twist[1] = vz
    tip.twist[2] = omega
    tip.acceleration[0] = ax
    tip.acceleration[1] = az
    tip.acceleration[2] = alpha


@kernel
def eliminate(
    chain: Chain, s: float, q: Array, v: Array, workspace: ChainWorkspace, tip: TipResponse
) -> bool:
    """Inward sweep: eliminate the joints from the tip to the base.

    Returns False when a pivot is not positive: the linearised chain is unstable (buckling
    faster than the stage can follow) and its solution would mean nothing.
    """
    n = q.size
    inertial = s * s
    fx, fz, m = tip.wrench[0], tip.wrench[1], tip.wrench[2]  # of the subtree about its joint
    k, u = no_rigidity(0.0), unit_wrenches(0.0)
    tip.free[:] = 0.0
    tip.compliance[:, :] = 0.0
    for i in range(n - 1, -1, -1):
        if i < n - 1:  # carry everything from joint i + 1 to joint i
            rx, rz = workspace.link[i, 0], workspace.link[i, 1]
            k = carry_rigidity(k, rx, rz, fx, fz)
            u = carry_wrenches(u, rx, rz)
            m += rx * fz - rz * fx
        cx, cz = workspace.arm[i, 0], workspace.arm[i, 1]
        gx, gz = workspace.load[i, 0], workspace.load[i, 1]
        fx += gx
        fz += gz
        m += cx * gz - cz * gx + workspace.load[i, 2]
        k = add_body(k, chain.mass[i] * inertial, chain.inertia[i] * inertial, cx, cz, gx, gz)
        row, imbalance = hinge_row(k), m
        ax, az, at = hinge_moments(u)
        if chain.straightening[i] > 0.0:
            sx, sz = workspace.shortening[i, 0], workspace.shortening[i, 1]
            row = shortening_row(k, fx, fz, sx, sz, workspace.swerve[i, 0], workspace.swerve[i, 1])
            ax, az, at = shortening_moments(u, sx, sz)
            imbalance += sx * fx + sz * fz
        pivot = row.own + chain.stiffness[i] + chain.damping[i] * s
        if not pivot > 0.0:
            return False
        imbalance -= chain.stiffness[i] * q[i] + chain.damping[i] * v[i]
        inverse = 1.0 / pivot
        workspace.imbalance[i] = imbalance
        workspace.give[i] = inverse
        workspace.coupling[i, 0], workspace.coupling[i, 1], workspace.coupling[i, 2] = (
            row.x,
            row.z,
            row.t,
        )
        workspace.lever[i, 0], workspace.lever[i, 1], workspace.lever[i, 2] = ax, az, at
        tip.free[0] += ax * imbalance * inverse
        tip.free[1] += az * imbalance * inverse
        tip.free[2] += at * imbalance * inverse
        add_compliance(tip.compliance, ax, az, at, inverse)
        ux, uz, ut = row.x * inverse, row.z * inverse, row.t * inverse
        fx -= ux * imbalance
        fz -= uz * imbalance
        m -= ut * imbalance
        u = eliminate_wrenches(u, ax, az, at, ux, uz, ut)
        k = eliminate_rigidity(k, row, ux, uz, ut)
    mirror_upper_half(tip.compliance)
    tip.root_force[0] = fz
    tip.root_force[1] = u.xz
    tip.root_force[2] = u.zz
    tip.root_force[3] = u.mz
    return True


@kernel
def substitute(workspace: ChainWorkspace, change: Array, dq: Array) -> float:
    """Outward sweep: joint increments `dq` for a `change` of the contact wrench on the tip.

    Returns the largest rotation of any body [rad].
    """
    dx, dz, turn, largest = 0.0, 0.0, 0.0, 0.0
    for i in range(dq.size):
        moment = (
            workspace.imbalance[i]
            + workspace.lever[i, 0] * change[0]
            + workspace.lever[i, 1] * change[1]
            + workspace.lever[i, 2] * change[2]
            - workspace.coupling[i, 0] * dx
            - workspace.coupling[i, 1] * dz
            - workspace.coupling[i, 2] * turn
        )
        dq[i] = moment * workspace.give[i]
        dx += workspace.shortening[i, 0] * dq[i]
        dz += workspace.shortening[i, 1] * dq[i]
        turn += dq[i]
        largest = max(largest, abs(turn))
        dx -= workspace.link[i, 1] * turn
        dz += workspace.link[i, 0] * turn
    return largest
