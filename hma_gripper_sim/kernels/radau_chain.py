"""Sweeps over a chain whose tangent is kept: factorised once, solved for many right sides.

The three stages of a Radau step share the linearised chain ``c_m M + c_d D + c_e K`` of one
pose.  For an eigenvalue ``s`` of the method, real or complex, its coefficients are ``s^2``, ``s``
and 1; with 1, 0 and 0 the mass matrix is left, which yields accelerations.  A complex tangent is
symmetric, not Hermitian, and needs no pivoting: divided by `s` its real part is positive
definite as long as the chain is stable.
"""

from __future__ import annotations

from typing import Any, NamedTuple

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
from hma_gripper_sim.kernels.chain import Chain, ChainWorkspace
from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]
Field = NDArray[Any]  # of float64 or complex128


class Factor(NamedTuple):
    """A factorised tangent; all arrays real, or all complex."""

    coupling: Field  # tangent row of each joint's moment to motions before it, shape (n, 3)
    give: Field  # inverse pivots, shape (n,)
    lever: Field  # joint moment from unit wrenches on the tip, shape (n, 3)
    compliance: Field  # of the tip: pose for unit wrenches, shape (3, 3)
    root: Field  # vertical load on the base from unit wrenches on the tip, shape (3,)


class Solution(NamedTuple):
    """Buffers of one right side; the type is that of the factor."""

    moment: Field  # joint moments to be balanced, then eliminated, shape (n,)
    free: Field  # pose of the tip under them, shape (3,)
    root: Field  # vertical load on the base that they shift, shape (1,)
    change: Field  # wrench on the tip that comes on top, shape (3,)
    increment: Field  # of the joints, shape (n,)


def factor(n: int, dtype: type) -> Factor:
    """Allocate the factor of a chain of `n` joints."""
    return Factor(
        np.zeros((n, 3), dtype),
        np.zeros(n, dtype),
        np.zeros((n, 3), dtype),
        np.zeros((3, 3), dtype),
        np.zeros(3, dtype),
    )


def solution(n: int, dtype: type) -> Solution:
    """Allocate the buffers of a right side for a chain of `n` joints."""
    return Solution(
        np.zeros(n, dtype),
        np.zeros(3, dtype),
        np.zeros(1, dtype),
        np.zeros(3, dtype),
        np.zeros(n, dtype),
    )


@kernel
def copy_chain(source: ChainWorkspace, target: ChainWorkspace) -> None:
    """Copy where the bodies are and what loads them."""
    for i in range(source.arm.shape[0]):
        for j in range(2):
            target.link[i, j] = source.link[i, j]
            target.shortening[i, j] = source.shortening[i, j]
            target.swerve[i, j] = source.swerve[i, j]
            target.arm[i, j] = source.arm[i, j]
        for j in range(3):
            target.load[i, j] = source.load[i, j]


@kernel
def imbalances(
    chain: Chain, q: Array, v: Array, wrench: Array, workspace: ChainWorkspace, imbalance: Array
) -> float:
    """Inward sweep: joint moments that are not balanced, into `imbalance`, shape (n,).

    `workspace` holds the chain as `kernels.chain.place` left it, `wrench` acts on the tip.  Returns
    the vertical load on the base.
    """
    n = q.size
    fx, fz, m = wrench[0], wrench[1], wrench[2]
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            m += workspace.link[i, 0] * fz - workspace.link[i, 1] * fx
        cx, cz = workspace.arm[i, 0], workspace.arm[i, 1]
        gx, gz = workspace.load[i, 0], workspace.load[i, 1]
        fx += gx
        fz += gz
        m += cx * gz - cz * gx + workspace.load[i, 2]
        lack = m - chain.stiffness[i] * q[i] - chain.damping[i] * v[i]
        if chain.straightening[i] > 0.0:
            lack += workspace.shortening[i, 0] * fx + workspace.shortening[i, 1] * fz
        imbalance[i] = lack
    return float(fz)


@kernel
def factorise(
    chain: Chain,
    inertial: Any,
    viscous: Any,
    elastic: float,
    wrench: Array,
    workspace: ChainWorkspace,
    out: Factor,
) -> bool:
    """Inward sweep: factorise ``inertial M + viscous D + elastic K``.

    `K` includes what loads and the tip's `wrench` do as the chain turns.  Returns False when a
    pivot vanishes or is not a number.
    """
    n = out.give.size
    zero = 0.0 * inertial
    fx, fz = elastic * wrench[0], elastic * wrench[1]
    k, u = no_rigidity(zero), unit_wrenches(zero)
    out.compliance[:, :] = 0.0
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            rx, rz = workspace.link[i, 0], workspace.link[i, 1]
            k = carry_rigidity(k, rx, rz, fx, fz)
            u = carry_wrenches(u, rx, rz)
        cx, cz = workspace.arm[i, 0], workspace.arm[i, 1]
        gx, gz = elastic * workspace.load[i, 0], elastic * workspace.load[i, 1]
        fx += gx
        fz += gz
        k = add_body(k, chain.mass[i] * inertial, chain.inertia[i] * inertial, cx, cz, gx, gz)
        row = hinge_row(k)
        ax, az, at = hinge_moments(u)
        if chain.straightening[i] > 0.0:
            sx, sz = workspace.shortening[i, 0], workspace.shortening[i, 1]
            row = shortening_row(k, fx, fz, sx, sz, workspace.swerve[i, 0], workspace.swerve[i, 1])
            ax, az, at = shortening_moments(u, sx, sz)
        pivot = row.own + elastic * chain.stiffness[i] + chain.damping[i] * viscous
        if not abs(pivot) > 0.0:
            return False
        inverse = 1.0 / pivot
        out.give[i] = inverse
        out.coupling[i, 0], out.coupling[i, 1], out.coupling[i, 2] = row.x, row.z, row.t
        out.lever[i, 0], out.lever[i, 1], out.lever[i, 2] = ax, az, at
        add_compliance(out.compliance, ax, az, at, inverse)
        ux, uz, ut = row.x * inverse, row.z * inverse, row.t * inverse
        u = eliminate_wrenches(u, ax, az, at, ux, uz, ut)
        k = eliminate_rigidity(k, row, ux, uz, ut)
    mirror_upper_half(out.compliance)
    out.root[0] = u.xz
    out.root[1] = u.zz
    out.root[2] = u.mz
    return True


@kernel
def reduce_moments(
    chain: Chain, workspace: ChainWorkspace, tangent: Factor, right: Solution
) -> None:
    """Inward sweep: eliminate the joint moments of a right side.

    `workspace` is that of `factorise`.  Leaves what the tip and the base do without a change of the
    wrench in ``right.free`` and ``right.root``.
    """
    n = right.moment.size
    zero = 0.0 * tangent.give[0]
    fx = fz = m = zero
    free_x = free_z = free_t = zero
    for i in range(n - 1, -1, -1):
        if i < n - 1:
            m += workspace.link[i, 0] * fz - workspace.link[i, 1] * fx
        moment = right.moment[i] + m
        if chain.straightening[i] > 0.0:
            moment += workspace.shortening[i, 0] * fx + workspace.shortening[i, 1] * fz
        right.moment[i] = moment
        turn = moment * tangent.give[i]
        free_x += tangent.lever[i, 0] * turn
        free_z += tangent.lever[i, 1] * turn
        free_t += tangent.lever[i, 2] * turn
        fx -= tangent.coupling[i, 0] * turn
        fz -= tangent.coupling[i, 1] * turn
        m -= tangent.coupling[i, 2] * turn
    right.free[0] = free_x
    right.free[1] = free_z
    right.free[2] = free_t
    right.root[0] = fz


@kernel
def joint_increments(
    chain: Chain, workspace: ChainWorkspace, tangent: Factor, right: Solution
) -> None:
    """Outward sweep: increments of the joints under the moments and the change of the wrench."""
    n = right.moment.size
    zero = 0.0 * tangent.give[0]
    dx = dz = turn = zero
    fx, fz, m = right.change[0], right.change[1], right.change[2]
    for i in range(n):
        moment = (
            right.moment[i]
            + tangent.lever[i, 0] * fx
            + tangent.lever[i, 1] * fz
            + tangent.lever[i, 2] * m
            - tangent.coupling[i, 0] * dx
            - tangent.coupling[i, 1] * dz
            - tangent.coupling[i, 2] * turn
        )
        step = moment * tangent.give[i]
        right.increment[i] = step
        turn += step
        if chain.straightening[i] > 0.0:
            dx += workspace.shortening[i, 0] * step
            dz += workspace.shortening[i, 1] * step
        dx -= workspace.link[i, 1] * turn
        dz += workspace.link[i, 0] * turn
