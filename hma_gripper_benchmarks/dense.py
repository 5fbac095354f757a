"""The equations of one half, written down independently of the package's solver.

Lagrange's equations in the absolute angles of the bodies: with complex vectors
``p_i = root + sum_j B_ij exp(i theta_j)`` for the centres of gravity, where ``B_ij`` is the
link of every body before i and the centre of body i, all inertial terms follow from the
constant matrix ``G_jk = sum_i m_i conj(B_ij) B_ik``:

    M_jk = Re(G_jk exp(i (theta_k - theta_j))),    Coriolis_j = -sum_k Im(...) omega_k^2.

Dense and O(n^3), explicit in the contact forces, friction regularised: what anyone would
hand to a library of ODE solvers.  Their results certify those of the package's own solver.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.compiled import COMPILED
from hma_gripper_sim.mechanics.scene import Scene

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

Function = TypeVar("Function", bound=Callable[..., Any])

RIGHT, LEFT = 0, 1
PROBE = 1e-8  # m, rad, m/s and rad/s; differences of the contact wrench


def compiled(function: Function) -> Function:
    """Compile a function that, unlike a kernel of the simulation, may allocate."""
    if not COMPILED:
        return function
    import numba

    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))


class Equations(NamedTuple):
    """Constants of one half; complex numbers are x + i z."""

    coupling: ComplexArray  # G [kg m^2], shape (n, n)
    inertia: Array  # [kg m^2], shape (n,)
    moment: ComplexArray  # sum_i m_i B_ij [kg m], shape (n,)
    link: ComplexArray  # [m], shape (n,); the last is 0
    root: complex
    mass: float  # of the half [kg]
    rest: Array  # [rad], shape (n,)
    stiffness: Array
    damping: Array
    gravity: float
    points: ComplexArray  # of the tip [m], shape (k,)
    normals: ComplexArray  # of sampled points, shape (k,)
    radius: float  # of the capsule [m]
    capsule: bool
    along_tip_normal: bool
    vertices: ComplexArray  # of the object's core [m], shape (m,)
    rounding: float  # of the core [m]
    law: Array  # stiffness, damping, friction, slip velocity


def equations(scene: Scene, slip_velocity: float, side: int = RIGHT) -> Equations:
    """Write down the equations of one half of a scene, the left one in its mirror image."""
    half, model = scene.half, scene.models[side]
    chain = half.chain
    n = len(chain.rest)
    link, centre = _complex(chain.link), _complex(chain.centre)
    link[-1] = 0.0
    arms = np.tril(np.broadcast_to(link, (n, n)), -1) + np.diag(centre)
    return Equations(
        np.ascontiguousarray(arms.conj().T @ (chain.mass[:, None] * arms)),
        chain.inertia.copy(),
        np.ascontiguousarray(chain.mass @ arms),
        link,
        complex(*chain.root),
        float(chain.mass.sum()),
        chain.rest.copy(),
        chain.stiffness.copy(),
        chain.damping.copy(),
        scene.gravity,
        _complex(model.fingertip.points),
        _complex(model.fingertip.normals),
        model.fingertip.radius,
        bool(model.fingertip.capsule),
        bool(model.fingertip.along_tip_normal),
        _complex(model.obstacle.vertices),
        model.obstacle.radius,
        np.array([scene.normal_stiffness, scene.normal_damping, scene.friction, slip_velocity]),
    )


def _complex(rows: Array) -> ComplexArray:
    return np.ascontiguousarray(rows[:, 0] + 1j * rows[:, 1])


@compiled
def _closest(vertices: ComplexArray, point: complex) -> tuple[float, complex]:
    """Signed distance of a point to a convex polygon, and the outward direction."""
    m = vertices.size
    if m == 1:
        away = point - vertices[0]
        return abs(away), away / abs(away)
    deepest, inside = -np.inf, 0j
    nearest, outside = np.inf, 0j
    for i in range(m):
        start = vertices[i]
        edge = vertices[(i + 1) % m] - start
        along = edge / abs(edge)
        normal = -1j * along
        relative = (point - start) * along.conjugate()
        height = -relative.imag
        if height > deepest:
            deepest, inside = height, normal
        share = min(abs(edge), max(0.0, relative.real))
        away = point - start - share * along
        if abs(away) < nearest:
            nearest, outside = abs(away), away
    if deepest <= 0.0:
        return deepest, inside
    return nearest, outside / nearest


@compiled
def _closest_on_segment(
    vertices: ComplexArray, start: complex, end: complex
) -> tuple[float, complex, complex]:
    """Distance of a segment to a convex polygon, direction from it, point of the segment."""
    distance, normal = _closest(vertices, start)
    place = start
    other, other_normal = _closest(vertices, end)
    if other < distance:
        distance, normal, place = other, other_normal, end
    along = (end - start) / abs(end - start)
    for i in range(vertices.size):
        share = ((vertices[i] - start) * along.conjugate()).real
        if 0.0 < share < abs(end - start):
            foot = start + share * along
            away = foot - vertices[i]
            if abs(away) < distance:
                distance, normal, place = abs(away), away / abs(away), foot
    return distance, normal, place


@compiled
def contact_wrench(system: Equations, pose: Array, twist: Array, wrench: Array) -> None:
    """Wrench on the tip about the last joint (fx, fz, m), from its pose and twist (3,)."""
    joint = complex(pose[0], pose[1])
    turn = complex(np.cos(pose[2]), np.sin(pose[2]))
    velocity, spin = complex(twist[0], twist[1]), twist[2]
    stiffness, damping, friction, slip_velocity = system.law
    wrench[:] = 0.0
    count = 1 if system.capsule else system.points.size
    for k in range(count):
        arm = turn * system.points[k]
        if system.capsule:
            distance, normal, place = _closest_on_segment(
                system.vertices, joint + arm, joint + turn * system.points[1]
            )
            arm = place - joint
        else:
            distance, normal = _closest(system.vertices, joint + arm)
        gap = distance - system.rounding - system.radius
        if gap >= 0.0:
            continue
        if system.along_tip_normal:
            normal = -turn * system.normals[k]
        arm -= system.radius * normal
        rate = (velocity + 1j * spin * arm) * normal.conjugate()
        push = max(0.0, -stiffness * gap - damping * rate.real)
        slip = min(1.0, max(-1.0, rate.imag / slip_velocity))
        force = (push - 1j * friction * push * slip) * normal
        wrench[0] += force.real
        wrench[1] += force.imag
        wrench[2] += (arm.conjugate() * force).imag


@compiled
def _tip(
    system: Equations, height: float, climb: float, state: Array, pose: Array, twist: Array
) -> None:
    n = system.rest.size
    place = system.root + 1j * height
    velocity = 1j * climb
    for j in range(n - 1):
        link = system.link[j] * complex(np.cos(state[j]), np.sin(state[j]))
        place += link
        velocity += 1j * state[n + j] * link
    pose[0], pose[1], pose[2] = place.real, place.imag, state[n - 1]
    twist[0], twist[1], twist[2] = velocity.real, velocity.imag, state[2 * n - 1]


@compiled
def _mass_and_forces(
    system: Equations, height: float, climb: float, state: Array, mass: Array, forces: Array
) -> float:
    """Mass matrix and generalised forces; returns the vertical contact force."""
    n = system.rest.size
    angle, rate = state[:n], state[n:]
    turn = np.exp(1j * angle)
    pose, twist, wrench = np.empty(3), np.empty(3), np.empty(3)
    _tip(system, height, climb, state, pose, twist)
    contact_wrench(system, pose, twist, wrench)
    contact = complex(wrench[0], wrench[1])
    for j in range(n):
        forces[j] = -system.gravity * (system.moment[j] * turn[j]).real
        arm = 1j * system.link[j] * turn[j]
        forces[j] += (arm.conjugate() * contact).real
        for k in range(n):
            inertial = system.coupling[j, k] * turn[k] * turn[j].conjugate()
            mass[j, k] = inertial.real
            forces[j] += inertial.imag * rate[k] * rate[k]
        mass[j, j] += system.inertia[j]
        before, rate_before = (angle[j - 1], rate[j - 1]) if j > 0 else (0.0, 0.0)
        torque = -system.stiffness[j] * (angle[j] - before - system.rest[j])
        torque -= system.damping[j] * (rate[j] - rate_before)
        forces[j] += torque
        if j > 0:
            forces[j - 1] -= torque
    forces[n - 1] += wrench[2]
    return float(wrench[1])


@compiled
def rates(system: Equations, height: float, climb: float, state: Array) -> Array:
    """Time derivative of ``state = (angles, their rates)``, shape (2 n,)."""
    n = system.rest.size
    mass, forces = np.empty((n, n)), np.empty(n)
    _mass_and_forces(system, height, climb, state, mass, forces)
    return np.concatenate((state[n:], np.linalg.solve(mass, forces)))


@compiled
def base_load(system: Equations, height: float, climb: float, state: Array) -> float:
    """Vertical load on the base [N], positive when it is pushed up."""
    n = system.rest.size
    mass, forces = np.empty((n, n)), np.empty(n)
    contact = _mass_and_forces(system, height, climb, state, mass, forces)
    acceleration = np.linalg.solve(mass, forces)
    load = contact - system.mass * system.gravity
    for j in range(n):
        arm = system.moment[j] * complex(np.cos(state[j]), np.sin(state[j]))
        load -= (arm * complex(-(state[n + j] ** 2), acceleration[j])).imag
    return load


@compiled
def jacobian(system: Equations, height: float, climb: float, state: Array) -> Array:
    """Derivative of `rates` to the state, analytic but for the contact wrench, (2 n, 2 n)."""
    n = system.rest.size
    mass, forces = np.empty((n, n)), np.empty(n)
    _mass_and_forces(system, height, climb, state, mass, forces)
    acceleration = np.linalg.solve(mass, forces)
    turn = np.exp(1j * state[:n])
    change = np.zeros((n, 2 * n))
    for j in range(n):
        change[j, j] += system.gravity * (system.moment[j] * turn[j]).imag
        for k in range(n):
            z = system.coupling[j, k] * turn[k] * turn[j].conjugate()
            rate = state[n + k]
            own = z.imag * acceleration[k] + z.real * rate * rate
            change[j, k] += own
            change[j, j] -= own
            change[j, n + k] += 2.0 * z.imag * rate
        for row, sign in ((j, 1.0), (j - 1, -1.0)):
            if row < 0:
                continue
            for column, part in ((j, 1.0), (j - 1, -1.0)):
                if column >= 0:
                    change[row, column] -= sign * part * system.stiffness[j]
                    change[row, n + column] -= sign * part * system.damping[j]
    _add_contact(system, height, climb, state, turn, change)
    result = np.zeros((2 * n, 2 * n))
    for j in range(n):
        result[j, n + j] = 1.0
    result[n:] = np.linalg.solve(mass, change)
    return result


@compiled
def _add_contact(
    system: Equations, height: float, climb: float, state: Array, turn: ComplexArray, change: Array
) -> None:
    n = system.rest.size
    pose, twist, wrench = np.empty(3), np.empty(3), np.empty(3)
    _tip(system, height, climb, state, pose, twist)
    contact_wrench(system, pose, twist, wrench)
    if wrench[0] == 0.0 and wrench[1] == 0.0:
        return
    contact = complex(wrench[0], wrench[1])
    by_pose, by_twist = np.empty((3, 3)), np.empty((3, 3))
    less, more = np.empty(3), np.empty(3)
    for i in range(3):
        for values, table in ((pose, by_pose), (twist, by_twist)):
            kept = values[i]
            values[i] = kept - PROBE
            contact_wrench(system, pose, twist, less)
            values[i] = kept + PROBE
            contact_wrench(system, pose, twist, more)
            values[i] = kept
            for row in range(3):
                table[row, i] = (more[row] - less[row]) / (2.0 * PROBE)
    # Rows of the tip's Jacobian: its velocity for a rate of each angle.
    arms = np.zeros((3, n))
    for j in range(n):
        arm = 1j * system.link[j] * turn[j]
        arms[0, j], arms[1, j] = arm.real, arm.imag
        change[j, j] += ((1j * arm).conjugate() * contact).real
    arms[2, n - 1] = 1.0
    # The twist follows the angles too.
    drift = np.zeros((3, n))
    for j in range(n):
        bend = -system.link[j] * turn[j] * state[n + j]
        drift[0, j], drift[1, j] = bend.real, bend.imag
    change[:, :n] += arms.T @ (by_pose @ arms + by_twist @ drift)
    change[:, n:] += arms.T @ (by_twist @ arms)
