"""Accelerations and forces of a state: as good as the state, whatever method found it.

A set-valued stick is a constraint on the slip, and an implicit method finds its force at a lower
order than angles and rates.  The stick force of a state is the one that keeps the slip from
changing: one sweep with the mass matrix.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import ChainWorkspace, TipResponse, place
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import (
    ContactLaw,
    ContactModes,
    copy_modes,
    is_stuck,
)
from hma_gripper_sim.kernels.contact_wrench import ContactWorkspace, evaluate_contacts, hold_along
from hma_gripper_sim.kernels.radau_chain import (
    Factor,
    Solution,
    factorise,
    imbalances,
    joint_increments,
    reduce_moments,
)
from hma_gripper_sim.kernels.radau_contact import solve_dense
from hma_gripper_sim.kernels.stage import Model

Array = NDArray[np.float64]

SHARING_ROUNDS = 3  # in which sticking contacts of one tip settle who carries how much


@kernel
def solve_accelerations(
    model: Model,
    base: Array,
    q: Array,
    v: Array,
    modes: ContactModes,
    a: Array,
    chain_workspace: ChainWorkspace,
    tip: TipResponse,
    mass: Factor,
    side: Solution,
    contact: ContactWorkspace,
) -> bool:
    """Accelerations, contact forces and load on the base of a state.

    Where set-valued friction sticks, its force is the one at which the slip does not change.

    Parameters
    ----------
    base
        Height, velocity and acceleration of the base, shape (3,).
    a
        Holds any guess, receives the accelerations [rad/s^2], shape (n,).
    tip
        Receives pose, twist, the contact wrench and, in ``root_force[0]``, the load.
    mass, side
        Scratch, real.
    contact
        Receives the contacts' forces.
    """
    law = model.law
    place(model.chain, base, model.gravity, q, v, a, chain_workspace, tip)
    copy_modes(modes, contact.modes)
    for j in range(3):
        contact.pose[j] = tip.pose[j]
        contact.twist[j] = tip.twist[j]
    contact.turn[0], contact.turn[1] = tip.turn[0], tip.turn[1]
    if not factorise(model.chain, 1.0, 0.0, 0.0, tip.wrench, chain_workspace, mass):
        return False
    fresh = side.moment.size > 0  # not a literal True: numba would compile everything for that, too
    evaluate_contacts(
        model.fingertip,
        model.obstacle,
        law,
        1.0,
        mass.compliance,
        fresh,
        contact,
    )
    for k in range(modes.normal.size):
        if is_stuck(law, modes, k):
            lack = modes.stick_force[k] - contact.friction_force[k]
            for j in range(3):
                contact.wrench[j] += lack * contact.slip_row[k, j]
            contact.friction_force[k] += lack
    load = imbalances(model.chain, q, v, contact.wrench, chain_workspace, side.moment)
    reduce_moments(model.chain, chain_workspace, mass, side)
    load += side.root[0]
    if not _share_sticks(law, modes, mass.compliance, tip.acceleration, side, contact):
        return False
    joint_increments(model.chain, chain_workspace, mass, side)
    for j in range(3):
        contact.wrench[j] += side.change[j]
        load += mass.root[j] * side.change[j]
        tip.wrench[j] = contact.wrench[j]
    tip.root_force[0] = load
    for i in range(q.size):
        a[i] += side.increment[i]
    return True


@kernel
def _share_sticks(
    law: ContactLaw,
    modes: ContactModes,
    compliance: Array,
    acceleration: Array,
    side: Solution,
    contact: ContactWorkspace,
) -> bool:
    """Find the change of the wrench by which no stick starts to slip.

    Several sticking contacts of one rigid tip may hold it more than once: each is a stiff
    spring to its slip's rate whose force is carried over, so that they share the load as they did.
    """
    matrix, vector = contact.matrix, contact.correction
    for j in range(3):
        side.change[j] = 0.0
    stuck = False
    for k in range(modes.normal.size):
        stuck |= is_stuck(law, modes, k)
    if not stuck:
        return True
    for _ in range(SHARING_ROUNDS):
        # Change of the tip's acceleration: free + compliance (change + springs).
        for i in range(3):
            total = side.free[i]
            for j in range(3):
                total += compliance[i, j] * side.change[j]
                matrix[i, j] = 1.0 if i == j else 0.0
            vector[i] = total
        for k in range(modes.normal.size):
            if not is_stuck(law, modes, k):
                continue
            row = contact.slip_row[k]
            grip, lack = hold_along(compliance, row), contact.slip_drift[k]
            for j in range(3):
                lack += row[j] * acceleration[j]
            for i in range(3):
                answer = 0.0
                for j in range(3):
                    answer += compliance[i, j] * row[j]
                vector[i] -= grip * lack * answer
                for j in range(3):
                    matrix[i, j] += grip * answer * row[j]
        if not solve_dense(matrix, vector):
            return False
        for k in range(modes.normal.size):
            if not is_stuck(law, modes, k):
                continue
            row = contact.slip_row[k]
            lack = contact.slip_drift[k]
            for j in range(3):
                lack += row[j] * (acceleration[j] + vector[j])
            force = -hold_along(compliance, row) * lack
            contact.friction_force[k] += force
            for j in range(3):
                side.change[j] += force * row[j]
    return True
