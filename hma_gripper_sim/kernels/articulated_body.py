"""Articulated-body recursion of a planar chain (R. Featherstone, Rigid Body Dynamics Algorithms).

From the tip to the base each joint adds its body to the articulated rigidity of what follows it,
that is minus the tangent of the subtree's wrench to the motion of its joint, and is eliminated.
The same is done for unit wrenches on the tip.  Rigidities may be complex.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]
Field = NDArray[Any]  # of float64 or complex128


class Rigidity(NamedTuple):
    """Symmetric 3x3 matrix of forces (x, z) and moment by displacements (x, z) and turn."""

    xx: Any  # [N/m]
    xz: Any
    zz: Any
    xt: Any  # [N/rad]
    zt: Any
    tt: Any  # [N m/rad]


class TipWrenches(NamedTuple):
    """What unit wrenches on the tip (first letter) become at the joint at hand (second letter)."""

    xx: Any
    xz: Any
    xm: Any  # [m]
    zx: Any
    zz: Any
    zm: Any
    mx: Any  # [1/m]
    mz: Any
    mm: Any


class JointRow(NamedTuple):
    """Tangent of a joint's moment to its own angle and to motions of the body before it."""

    own: Any  # [N m/rad]
    x: Any  # [N]
    z: Any
    t: Any  # [N m/rad]


@kernel
def no_rigidity(zero: Any) -> Rigidity:
    """Rigidity behind the tip, of the type of `zero`."""
    return Rigidity(zero, zero, zero, zero, zero, zero)


@kernel
def unit_wrenches(zero: Any) -> TipWrenches:
    """Unit wrenches at the tip itself, of the type of `zero`."""
    one = zero + 1.0
    return TipWrenches(one, zero, zero, zero, one, zero, zero, zero, one)


@kernel
def carry_rigidity(k: Rigidity, rx: float, rz: float, fx: Any, fz: Any) -> Rigidity:
    """Refer a rigidity to a joint that a rigid link (rx, rz) leads from [m].

    (fx, fz) is the force that acts at the link's end [N].
    """
    tt = k.tt + (
        2.0 * (rx * k.zt - rz * k.xt) + rz * rz * k.xx - 2.0 * rx * rz * k.xz + rx * rx * k.zz
    )
    tt += rx * fx + rz * fz
    xt = k.xt + (rx * k.xz - rz * k.xx)
    zt = k.zt + (rx * k.zz - rz * k.xz)
    return Rigidity(k.xx, k.xz, k.zz, xt, zt, tt)


@kernel
def carry_wrenches(u: TipWrenches, rx: float, rz: float) -> TipWrenches:
    """Refer wrenches to a joint that a rigid link (rx, rz) leads from [m]."""
    return TipWrenches(
        u.xx,
        u.xz,
        u.xm + (rx * u.xz - rz * u.xx),
        u.zx,
        u.zz,
        u.zm + (rx * u.zz - rz * u.zx),
        u.mx,
        u.mz,
        u.mm + (rx * u.mz - rz * u.mx),
    )


@kernel
def add_body(
    k: Rigidity, heavy: Any, turning: Any, cx: float, cz: float, gx: Any, gz: Any
) -> Rigidity:
    """Add a body to the rigidity behind its joint.

    Parameters
    ----------
    heavy, turning
        Resistance of its mass [N/m] and of its moment of inertia [N m/rad].
    cx, cz
        From the joint to its centre of gravity [m].
    gx, gz
        Load there [N].
    """
    return Rigidity(
        k.xx + heavy,
        k.xz,
        k.zz + heavy,
        k.xt - heavy * cz,
        k.zt + heavy * cx,
        k.tt + (heavy * (cx * cx + cz * cz) + turning + cx * gx + cz * gz),
    )


@kernel
def hinge_row(k: Rigidity) -> JointRow:
    """Row of a joint that only turns."""
    return JointRow(k.tt, k.xt, k.zt, k.tt)


@kernel
def hinge_moments(u: TipWrenches) -> tuple[Any, Any, Any]:
    """Moments of a joint that only turns under unit wrenches on the tip."""
    return u.xm, u.zm, u.mm


@kernel
def shortening_row(
    k: Rigidity, fx: Any, fz: Any, sx: float, sz: float, swerve_x: float, swerve_z: float
) -> JointRow:
    """Row of a joint that slides as it turns.

    Parameters
    ----------
    fx, fz
        Force behind the joint [N].
    sx, sz, swerve_x, swerve_z
        By how much it slides per angle [m/rad], and the change of that per angle [m/rad^2].
    """
    own = k.tt + (
        2.0 * (sx * k.xt + sz * k.zt) + sx * sx * k.xx + 2.0 * sx * sz * k.xz + sz * sz * k.zz
    )
    own -= swerve_x * fx + swerve_z * fz
    return JointRow(
        own,
        k.xt + (sx * k.xx + sz * k.xz),
        k.zt + (sx * k.xz + sz * k.zz),
        k.tt + (sx * k.xt + sz * k.zt - sx * fz + sz * fx),
    )


@kernel
def shortening_moments(u: TipWrenches, sx: float, sz: float) -> tuple[Any, Any, Any]:
    """Moments of a joint that slides as it turns under unit wrenches on the tip."""
    return (
        u.xm + (sx * u.xx + sz * u.xz),
        u.zm + (sx * u.zx + sz * u.zz),
        u.mm + (sx * u.mx + sz * u.mz),
    )


@kernel
def eliminate_rigidity(k: Rigidity, row: JointRow, ux: Any, uz: Any, ut: Any) -> Rigidity:
    """Rigidity with a joint free to move; (ux, uz, ut) is its row divided by the pivot."""
    return Rigidity(
        k.xx - ux * row.x,
        k.xz - ux * row.z,
        k.zz - uz * row.z,
        k.xt - ux * row.t,
        k.zt - uz * row.t,
        k.tt - ut * row.t,
    )


@kernel
def eliminate_wrenches(
    u: TipWrenches, ax: Any, az: Any, at: Any, ux: Any, uz: Any, ut: Any
) -> TipWrenches:
    """Unit wrenches with a joint free to move, whose moments they are (ax, az, at)."""
    return TipWrenches(
        u.xx - ux * ax,
        u.xz - uz * ax,
        u.xm - ut * ax,
        u.zx - ux * az,
        u.zz - uz * az,
        u.zm - ut * az,
        u.mx - ux * at,
        u.mz - uz * at,
        u.mm - ut * at,
    )


@kernel
def add_compliance(compliance: Field, ax: Any, az: Any, at: Any, inverse: Any) -> None:
    """Add what a joint gives way, to the upper half of the tip's compliance, shape (3, 3)."""
    compliance[0, 0] += ax * ax * inverse
    compliance[0, 1] += ax * az * inverse
    compliance[1, 1] += az * az * inverse
    compliance[0, 2] += ax * at * inverse
    compliance[1, 2] += az * at * inverse
    compliance[2, 2] += at * at * inverse


@kernel
def mirror_upper_half(compliance: Field) -> None:
    """Complete a symmetric matrix, shape (3, 3)."""
    compliance[1, 0] = compliance[0, 1]
    compliance[2, 0] = compliance[0, 2]
    compliance[2, 1] = compliance[1, 2]
