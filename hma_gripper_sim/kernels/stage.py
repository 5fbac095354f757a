"""One implicit stage of one half: Newton's method on joints and contact together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import (
    Chain,
    ChainWorkspace,
    TipResponse,
    chain_workspace,
    eliminate,
    place,
    substitute,
    tip_response,
)
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact import solve_contact
from hma_gripper_sim.kernels.contact_law import ContactLaw
from hma_gripper_sim.kernels.contact_wrench import ContactWorkspace, contact_workspace
from hma_gripper_sim.kernels.proximity import Obstacle
from hma_gripper_sim.kernels.touch import Fingertip

Array = NDArray[np.float64]

MAX_ITERATIONS = 12
CONSISTENT = 3e-2  # of a contact's depth: how well the tip's place is known after a stage
MAX_TURN = 1.0  # rad; a larger correction of a body's angle is not believed


class Model(NamedTuple):
    """One half of a scene, in its own frame (the left half is mirrored)."""

    chain: Chain
    fingertip: Fingertip
    obstacle: Obstacle
    law: ContactLaw
    gravity: float  # m/s^2
    bending: float  # force across the end that would bend the straight chain by two radians [N]


class Workspace(NamedTuple):
    """The buffers of one half."""

    chain: ChainWorkspace
    tip: TipResponse
    contact: ContactWorkspace
    base: Array  # height, velocity, acceleration of the base, shape (3,)
    increment: Array  # joint increments, shape (n,)


def allocate(model: Model) -> Workspace:
    """Allocate the buffers for a model."""
    n = model.chain.rest.size
    return Workspace(
        chain_workspace(n),
        tip_response(),
        contact_workspace(model.fingertip),
        np.zeros(3),
        np.zeros(n),
    )


@kernel
def solve_stage(
    model: Model,
    s: float,
    accuracy: float,
    q0: Array,
    v0: Array,
    q: Array,
    v: Array,
    a: Array,
    workspace: Workspace,
) -> int:
    """Solve the balance of all joints for ``v = s (q - q0)``, ``a = s (v - v0)``.

    Parameters
    ----------
    s
        Rate of the stage [1/s]; 0 asks for static equilibrium.
    accuracy
        Accepted error of a body's angle [rad], and of the contact force relative to it.
    q, v, a
        Joint angles, rates and accelerations, shape (n,); `q` holds the first guess.

    Returns
    -------
    int
        Number of Newton iterations, or 0 when there was no convergence.  The contact wrench
        is in ``workspace.contact.wrench``, the vertical load on the base in
        ``workspace.tip.root_force[0]``.
    """
    n = q.size
    tip = workspace.tip
    for iteration in range(1, MAX_ITERATIONS + 1):
        rate = 0.0
        for i in range(n):
            v[i] = s * (q[i] - q0[i])
            a[i] = s * (v[i] - v0[i])
            rate = max(rate, abs(v[i]))
        place(model.chain, workspace.base, model.gravity, q, v, a, workspace.chain, tip)
        if not eliminate(model.chain, s, q, v, workspace.chain, tip):
            return 0
        if not solve_contact(
            model.fingertip, model.obstacle, model.law, s, 1e-3 * accuracy, tip, workspace.contact
        ):
            return 0
        for j in range(3):
            change = workspace.contact.wrench[j] - tip.wrench[j]
            workspace.contact.correction[j] = change
            tip.root_force[0] += tip.root_force[1 + j] * change
            tip.wrench[j] = workspace.contact.wrench[j]
        turn = substitute(workspace.chain, workspace.contact.correction, workspace.increment)
        if not turn < MAX_TURN:
            return 0
        for i in range(n):
            q[i] += workspace.increment[i]
        # The next correction is of the order of this one times the nonlinearity left out.
        nonlinearity = turn
        if s > 0.0:
            nonlinearity += n * rate / s
        error = turn * min(1.0, nonlinearity)
        # What it displaces the tip by must not matter against the depth of its contacts.
        force = 0.0
        for k in range(workspace.contact.normal_force.size):
            force = max(force, workspace.contact.normal_force[k])
        moved = abs(workspace.contact.increment[0]) + abs(workspace.contact.increment[1])
        deep = moved * min(1.0, nonlinearity) * model.law.stiffness <= CONSISTENT * force
        if error <= accuracy and (deep or force == 0.0):
            for i in range(n):
                v[i] = s * (q[i] - q0[i])
                a[i] = s * (v[i] - v0[i])
            return iteration
    return 0
