"""How the errors that steps have made so far act on: linearised about the computed motion.

A step maps a small error of the state at its start to one at its end.  That map is solved for
like a correction of the step itself: with its factorised chain and the tangents of its contacts,
modes held.  Each step adds what its embedded solution shows of its own error.  So the growth of
errors by instabilities, as in a snap or in undamped impacts, shows while the run is under way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.accelerations import solve_accelerations
from hma_gripper_sim.kernels.base_motion import Stretch, base_in_step
from hma_gripper_sim.kernels.chain import place
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import (
    OPEN,
    ContactLaw,
    ContactModes,
    closing_margin,
    contact_modes,
    is_stuck,
)
from hma_gripper_sim.kernels.contact_wrench import hold_along
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.radau import RadauWorkspace, free_response, increments
from hma_gripper_sim.kernels.radau_chain import imbalances
from hma_gripper_sim.kernels.radau_contact import StageContacts, build_matrix, solve_dense
from hma_gripper_sim.kernels.radau_method import EMBEDDED, GAMMA, INVERSE, NODES
from hma_gripper_sim.kernels.stage import Model

Array = NDArray[np.float64]

DIFFERENCE = 1e-7  # rad; displacement by which directional derivatives are taken
LARGEST = 1.0  # rad; errors beyond mean that nothing is known any more
FLOOR = 10.0  # tolerances: errors up to which nothing needs to move
REMEMBERED = 0.8  # of what has moved lately, a step later
FIRMER = 1e3  # by which a stick is held harder than where only its force is asked for
OWN = 0.2  # share of the embedded estimate, of order 3, that stands for the error of a step


class ErrorWorkspace(NamedTuple):
    """The propagated error and buffers."""

    angle: Array  # error of the joint angles [rad], shape (n,)
    rate: Array  # error of their rates [rad/s], shape (n,)
    increment: Array  # of the stages, shape (3, n)
    moment: Array  # scratch, shape (3, n): by both displacements, and without
    moved: Array  # scratch: displaced angles and rates, shape (2, n)
    pose: Array  # scratch: of the tip, pose and twist as displaced and not, shape (6, 3)
    before: Array  # accelerations before an event [rad/s^2], shape (n,)
    modes: ContactModes  # and modes before it
    load: Array  # error of the vertical load at the stages [N], shape (3,)
    swing: Array  # how much load [N] and angles [rad] have moved lately, shape (2,)
    floor: Array  # errors relative to it, and in rad, that need no motion to be believed, (1,)
    square: Array  # integrals of the squared errors: load [N^2 s], angle [rad^2 s]; shape (2,)


def error_workspace(n: int, candidates: int) -> ErrorWorkspace:
    """Allocate the buffers for a chain of `n` joints and its contacts; no error."""
    angle, rate = np.zeros((2, n))
    return ErrorWorkspace(
        angle,
        rate,
        np.zeros((3, n)),
        np.zeros((3, n)),
        np.zeros((2, n)),
        np.zeros((6, 3)),
        np.zeros(n),
        contact_modes(candidates),
        np.zeros(3),
        np.zeros(2),
        np.zeros(1),
        np.zeros(2),
    )


def clear_error(error: ErrorWorkspace, tolerance: float) -> None:
    """Begin a run, of which `tolerance` is asked, without an error."""
    for part in (error.angle, error.rate, error.swing, error.square):
        part[:] = 0.0
    error.floor[0] = FLOOR * tolerance


@kernel
def _displace(
    model: Model, workspace: RadauWorkspace, share: float, h: float, row: int, error: ErrorWorkspace
) -> None:
    """Joint moments, pose and twist of the tip at the step's end, displaced along the error.

    By a `share` of it, and by what its rates add to the angles in the time `h`.
    """
    stages = workspace.stages
    for j in range(error.angle.size):
        error.moved[0, j] = stages.q[2, j] + share * error.angle[j] + h * error.rate[j]
        error.moved[1, j] = stages.v[2, j] + share * error.rate[j]
    q, v, wrench = error.moved[0], error.moved[1], workspace.contacts.wrench[2]
    place(
        model.chain,
        workspace.base,
        model.gravity,
        q,
        v,
        stages.a[2],
        workspace.chain,
        workspace.tip,
    )
    imbalances(model.chain, q, v, wrench, workspace.chain, error.moment[row])
    for j in range(3):
        error.pose[2 * row, j] = workspace.tip.pose[j]
        error.pose[2 * row + 1, j] = workspace.tip.twist[j]


@kernel
def propagate_error(
    model: Model,
    stretch: Stretch,
    before: float,
    scale: float,
    modes: ContactModes,
    workspace: RadauWorkspace,
    error: ErrorWorkspace,
) -> None:
    """Carry the error of the state over the step in `workspace`, and add the step's own.

    `before` is the load on the base at its start, `scale` the largest so far [N].
    """
    n, contacts, h = error.angle.size, workspace.contacts, stretch.h
    size = 0.0
    for j in range(n):
        size = max(size, abs(error.angle[j]), h * abs(error.rate[j]))
    for i in range(3):
        error.load[i] = 0.0
        for j in range(n):
            error.increment[i, j] = 0.0
    if size > 0.0:
        base_in_step(stretch, 1.0, workspace.base)
        small = DIFFERENCE / size
        _displace(model, workspace, 0.0, 0.0, 2, error)
        _displace(model, workspace, small, 0.0, 0, error)
        _displace(model, workspace, 0.0, small * h, 1, error)
        for row in range(2):
            for j in range(n):
                error.moment[row, j] = (error.moment[row, j] - error.moment[2, j]) / small
            for j in range(3):
                error.pose[2 * row, j] = (error.pose[2 * row, j] - error.pose[4, j]) / small
                error.pose[2 * row + 1, j] = (error.pose[2 * row + 1, j] - error.pose[5, j]) / small
        for i in range(3):
            for j in range(n):
                workspace.stages.imbalance[i, j] = (
                    error.moment[0, j] + NODES[i] * error.moment[1, j]
                )
        free_response(
            model.chain, workspace.tangent, workspace.stages.imbalance, error.load, contacts.free
        )
        touching = False
        for k in range(modes.normal.size):
            touching |= modes.normal[k] != OPEN
        _hold_sticks(model.law, h, modes, contacts)
        _contact_response(h, touching, workspace, error)
        increments(model.chain, workspace.tangent, contacts.change, error.increment, error.load)
    for j in range(n):
        z0, z1, z2 = error.increment[0, j], error.increment[1, j], error.increment[2, j]
        error.angle[j] += h * error.rate[j] + z2
        error.rate[j] += (INVERSE[2, 0] * z0 + INVERSE[2, 1] * z1 + INVERSE[2, 2] * z2) / h
    largest = _saturate(h, before, scale, workspace, error)
    error.square[0] += h * error.load[2] ** 2
    error.square[1] += h * largest**2
    z = workspace.stages.z
    for j in range(n):
        own = EMBEDDED[0] * z[0, j] + EMBEDDED[1] * z[1, j] + EMBEDDED[2] * z[2, j]
        own *= OWN / GAMMA
        error.angle[j] += own
        error.rate[j] += own / h


@kernel
def _saturate(
    h: float, before: float, scale: float, workspace: RadauWorkspace, error: ErrorWorkspace
) -> float:
    """Bound the error by what moves, beyond its floor; return that of the angles.

    Small errors grow by a factor in each of many small impacts that follow each other, but two
    motions that differ in these differ by no more than what each of them moves.  `before` is the
    load on the base at the step's start [N].
    """
    stages, swing = workspace.stages, error.swing
    turn, moved, largest = 0.0, 0.0, 0.0
    for j in range(error.angle.size):
        turn += error.angle[j]
        moved += stages.q[2, j] - stages.q[0, j]
        largest = max(largest, abs(turn))
        swing[1] = max(swing[1], abs(moved))
    for i in range(3):
        swing[0] = max(swing[0], abs(stages.load[i] - before))
    bound = min(LARGEST, swing[1] + error.floor[0])
    if largest > bound:
        for j in range(error.angle.size):
            error.angle[j] *= bound / largest
            error.rate[j] *= bound / largest
        largest = bound
    bound = min(scale, swing[0] + error.floor[0] * scale)
    error.load[2] = max(-bound, min(bound, error.load[2]))
    swing[0] *= REMEMBERED
    swing[1] *= REMEMBERED
    return largest


@kernel
def _contact_response(
    h: float, touching: bool, workspace: RadauWorkspace, error: ErrorWorkspace
) -> None:
    """Change of the contact wrenches at all stages by the error, into ``contacts.change``."""
    contacts = workspace.contacts
    for i in range(3):
        for j in range(3):
            contacts.change[i, j] = 0.0
    if not touching:
        return
    for i in range(3):  # by what the error itself moves the tip
        for m in range(3):
            total = 0.0
            for j in range(3):
                pose = error.pose[0, j] + NODES[i] * error.pose[2, j]
                twist = error.pose[1, j] + NODES[i] * error.pose[3, j]
                total += contacts.by_pose[i, m, j] * pose + contacts.by_twist[i, m, j] * twist
            contacts.change[i, m] = total
    for i in range(3):
        for j in range(3):
            total = contacts.free[i, j]
            for other in range(3):
                for m in range(3):
                    total += (
                        contacts.compliance[3 * i + j, 3 * other + m] * contacts.change[other, m]
                    )
            contacts.residual[3 * i + j] = total
    build_matrix(h, contacts)
    if not solve_dense(contacts.matrix, contacts.residual):
        return
    for i in range(3):
        for m in range(3):
            total = 0.0
            for j in range(3):
                total += contacts.by_pose[i, m, j] * contacts.residual[3 * i + j]
                rate = 0.0
                for other in range(3):
                    rate += INVERSE[i, other] * contacts.residual[3 * other + j]
                total += contacts.by_twist[i, m, j] * rate / h
            contacts.change[i, m] += total


@kernel
def _hold_sticks(law: ContactLaw, h: float, modes: ContactModes, contacts: StageContacts) -> None:
    """Let no error of the slip survive where set-valued friction sticks."""
    for k in range(modes.normal.size):
        if not is_stuck(law, modes, k):
            continue
        for i in range(3):
            row = contacts.slip_row[i, k]
            grip = FIRMER * h / GAMMA * hold_along(contacts.hold, row)
            for m in range(3):
                for j in range(3):
                    contacts.by_twist[i, m, j] -= grip * row[m] * row[j]


@kernel
def delay_touches(
    model: Model,
    v: Array,
    state_q: Array,
    acceleration: Array,
    modes: ContactModes,
    since: float,
    workspace: RadauWorkspace,
    error: ErrorWorkspace,
) -> None:
    """Add to the error what a touch does at another time, where it makes accelerations jump.

    `since` is the time since the event before [s]: a longer delay would merge the two, and what
    bounces differ by is bounded.  ``error.modes`` are the modes before; ``workspace.base`` and
    ``workspace.tip`` belong to the state.
    """
    touched = -1
    for k in range(modes.normal.size):
        if error.modes.normal[k] == OPEN and modes.normal[k] != OPEN:
            touched = k
    size = 0.0
    for j in range(v.size):
        size = max(size, abs(error.angle[j]))
    if touched < 0 or size == 0.0:
        return
    twist = workspace.tip.twist
    speed = max(abs(twist[0]), abs(twist[1]), abs(twist[2]))
    small, short = DIFFERENCE / size, DIFFERENCE / max(speed, DIFFERENCE)
    for j in range(v.size):
        error.moved[0, j] = state_q[j] + small * error.angle[j]
        error.before[j] = acceleration[j]
    for row in range(2):
        q = state_q if row == 0 else error.moved[0]
        x, z, angle = place_tip(model.chain, -workspace.base[0], q)
        error.pose[row, 0], error.pose[row, 1], error.pose[row, 2] = x, z, angle
    for j in range(3):
        error.pose[2, j] = error.pose[0, j] + short * twist[j]
    tip, law, at = model.fingertip, model.law, model.obstacle
    gap = closing_margin(tip, at, law, error.pose[0], twist, touched)
    away = closing_margin(tip, at, law, error.pose[1], twist, touched)
    later = closing_margin(tip, at, law, error.pose[2], twist, touched)
    if not later < gap:
        return
    if not solve_accelerations(
        model,
        workspace.base,
        state_q,
        v,
        error.modes,
        error.before,
        workspace.chain,
        workspace.tip,
        workspace.tangent.real,
        workspace.tangent.real_side,
        workspace.contacts.stage,
    ):
        return
    delay = (away - gap) / small * short / (gap - later)
    delay = min(since, max(-since, delay))
    for j in range(v.size):
        error.rate[j] += (error.before[j] - acceleration[j]) * delay
