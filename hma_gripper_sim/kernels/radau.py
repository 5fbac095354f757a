"""One step of Radau IIA(5) for one half, contact modes held.

All three stages are implicit.  The unknowns are the angles `z` by which the joints deviate from
going on at the rates `v0` of the start: then rates are ``v0 + INVERSE z / h`` and accelerations
``INVERSE INVERSE z / h^2``, which short steps do not drown in rounding.
Simplified Newton: the linearised chain of one pose serves all stages and iterations; the
method's eigenvalues part it into one real and one complex sweep.  Contact is solved exactly in
each iteration, in nine unknowns.

A stick is a constraint on the slip.  Its force at a stage is of order 3 only in general, whereas
angles and rates at the step's end are of order 5: `kernels.accelerations` finds forces as good
as these.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.base_motion import Stretch, base_in_step
from hma_gripper_sim.kernels.chain import (
    Chain,
    ChainWorkspace,
    TipResponse,
    chain_workspace,
    place,
    tip_response,
)
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import OPEN, STICK, ContactModes, copy_modes
from hma_gripper_sim.kernels.radau_chain import (
    Factor,
    Solution,
    copy_chain,
    factor,
    factorise,
    imbalances,
    joint_increments,
    reduce_moments,
    solution,
)
from hma_gripper_sim.kernels.radau_contact import (
    StageContacts,
    measure_stages,
    solve_stage_contacts,
    stage_contacts,
)
from hma_gripper_sim.kernels.radau_method import (
    ALPHA_BETA,
    EMBEDDED,
    FROM_COMPLEX,
    FROM_REAL,
    GAMMA,
    INVERSE,
    NODES,
    POLYNOMIAL,
    TO_COMPLEX,
    TO_REAL,
)
from hma_gripper_sim.kernels.stage import CONSISTENT, MAX_TURN, Model

Array = NDArray[np.float64]

MAX_ITERATIONS = 12
AT_ONCE = 0.1  # of the accuracy: a first correction this small needs no second one
# By which a single stick is held softer than in `kernels.contact`: rounding of its slip would
# else show in its force.  Several hold the tip against each other, which takes the full hold.
SOFT_HOLD = 100.0
ROUNDING = 1e-10  # rad, and of the scale of forces: corrections this small need not fall further
CONTACT_ACCURACY = 0.01  # of the accuracy of forces: that of the contacts within an iteration


class Stages(NamedTuple):
    """The three stages, in rows."""

    z: Array  # what the angles add to going on at the start's rates [rad], shape (3, n)
    q: Array  # angles [rad], shape (3, n)
    v: Array  # rates [rad/s], shape (3, n)
    a: Array  # accelerations [rad/s^2], shape (3, n)
    load: Array  # vertical load on the base [N], shape (3,)
    imbalance: Array  # scratch: joint moments [N m], shape (3, n)


class Tangent(NamedTuple):
    """The linearised chain, for the method's real eigenvalue and for a complex one."""

    chain: ChainWorkspace  # where it is linearised
    real: Factor
    pair: Factor
    real_side: Solution
    pair_side: Solution


class RadauWorkspace(NamedTuple):
    """Buffers and results of a step."""

    stages: Stages
    tangent: Tangent
    contacts: StageContacts
    chain: ChainWorkspace  # of the stage at hand
    tip: TipResponse
    base: Array  # height, velocity, acceleration of the base, shape (3,)
    q: Array  # scratch: a state beside the stages, shape (n,)
    v: Array
    a: Array
    power: Array  # scratch: rates of `HalfState.work` [W], shape (4,)


def radau_workspace(model: Model) -> RadauWorkspace:
    """Allocate the buffers for a model."""
    n = model.chain.rest.size
    z, q, v, a, imbalance = np.zeros((5, 3, n))
    return RadauWorkspace(
        Stages(z, q, v, a, np.zeros(3), imbalance),
        Tangent(
            chain_workspace(n),
            factor(n, np.float64),
            factor(n, np.complex128),
            solution(n, np.float64),
            solution(n, np.complex128),
        ),
        stage_contacts(model.fingertip),
        chain_workspace(n),
        tip_response(),
        np.zeros(3),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(4),
    )


@kernel
def guess_first(
    h: float, a0: Array, tip_wrench: Array, modes: ContactModes, z: Array, contacts: StageContacts
) -> None:
    """First guess of a step from a state alone: constant accelerations and contact forces.

    Into `z`, shape (3, n), and `contacts`.
    """
    for i in range(3):
        t = NODES[i] * h
        for j in range(a0.size):
            z[i, j] = 0.5 * t * t * a0[j]
        for j in range(3):
            contacts.wrench[i, j] = tip_wrench[j]
        for k in range(modes.normal.size):
            contacts.stick_force[i, k] = modes.stick_force[k]


@kernel
def guess_next(ratio: float, z: Array, contacts: StageContacts) -> None:
    """First guess of a step by going on along the last one's polynomials, in place.

    `ratio` is the next step's length, relative to the last.
    """
    for j in range(z.shape[1]):
        _, second, third = powers(z[0, j], z[1, j], z[2, j])
        for i in range(3):
            t = NODES[i] * ratio
            z[i, j] = t * t * (second + 3.0 * third + t * third)
    _move_stages(1.0, ratio, contacts.wrench)
    _move_stages(1.0, ratio, contacts.stick_force)


@kernel
def guess_again(ratio: float, z: Array, contacts: StageContacts) -> None:
    """First guess of a step that is repeated at `ratio` times its length, in place."""
    for j in range(z.shape[1]):
        first, second, third = powers(z[0, j], z[1, j], z[2, j])
        for i in range(3):
            t = NODES[i] * ratio
            z[i, j] = t * (first + t * (second + t * third))
    _move_stages(0.0, ratio, contacts.wrench)
    _move_stages(0.0, ratio, contacts.stick_force)


@kernel
def _move_stages(start: float, ratio: float, values: Array) -> None:
    """Move values of the stages, in rows, along their parabola to a step that begins elsewhere."""
    for j in range(values.shape[1]):
        f0, f1, f2 = values[0, j], values[1, j], values[2, j]
        for i in range(3):
            values[i, j] = parabola(start + NODES[i] * ratio, f0, f1, f2)


@kernel
def parabola(theta: float, f0: float, f1: float, f2: float) -> float:
    """Value at a share `theta` of the step of the parabola through those of the stages."""
    slope = (f1 - f0) / (NODES[1] - NODES[0])
    bend = ((f2 - f1) / (1.0 - NODES[1]) - slope) / (1.0 - NODES[0])
    value: float = f0 + (theta - NODES[0]) * (slope + (theta - NODES[1]) * bend)
    return value


@kernel
def powers(f0: float, f1: float, f2: float) -> tuple[float, float, float]:
    """Coefficients of a step's cubic that is 0 at its start, from its values at the stages."""
    return (
        POLYNOMIAL[0, 0] * f0 + POLYNOMIAL[0, 1] * f1 + POLYNOMIAL[0, 2] * f2,
        POLYNOMIAL[1, 0] * f0 + POLYNOMIAL[1, 1] * f1 + POLYNOMIAL[1, 2] * f2,
        POLYNOMIAL[2, 0] * f0 + POLYNOMIAL[2, 1] * f1 + POLYNOMIAL[2, 2] * f2,
    )


@kernel
def angle_error(z: Array) -> float:
    """Difference of a step's angles to its embedded solution of order 3: largest of a body."""
    turn, largest = 0.0, 0.0
    for j in range(z.shape[1]):
        turn += (EMBEDDED[0] * z[0, j] + EMBEDDED[1] * z[1, j] + EMBEDDED[2] * z[2, j]) / GAMMA
        largest = max(largest, abs(turn))
    return largest


@kernel
def load_error(before: float, load: Array) -> float:
    """How far the loads of the stages, shape (3,), continued back, miss the one `before`."""
    return float(abs(parabola(0.0, load[0], load[1], load[2]) - before))


@kernel
def _place_stages(h: float, q0: Array, v0: Array, stages: Stages) -> None:
    """Angles, rates and accelerations of the stages."""
    z, q, v, a = stages.z, stages.q, stages.v, stages.a
    for j in range(v0.size):
        first, second, third = z[0, j] / h, z[1, j] / h, z[2, j] / h
        rise0 = INVERSE[0, 0] * first + INVERSE[0, 1] * second + INVERSE[0, 2] * third
        rise1 = INVERSE[1, 0] * first + INVERSE[1, 1] * second + INVERSE[1, 2] * third
        rise2 = INVERSE[2, 0] * first + INVERSE[2, 1] * second + INVERSE[2, 2] * third
        v[0, j] = v0[j] + rise0
        v[1, j] = v0[j] + rise1
        v[2, j] = v0[j] + rise2
        for i in range(3):
            rate = INVERSE[i, 0] * rise0 + INVERSE[i, 1] * rise1 + INVERSE[i, 2] * rise2
            a[i, j] = rate / h
            q[i, j] = q0[j] + (NODES[i] * h * v0[j] + z[i, j])


@kernel
def _factorise(
    chain: Chain,
    h: float,
    wrench: Array,
    softer: float,
    tangent: Tangent,
    hold: Array,
    compliance: Array,
) -> bool:
    """Factorise the chain placed in ``tangent.chain``, the tip under a `wrench`, shape (3,).

    Leaves the tip's compliance between all stages in `compliance`, shape (9, 9), and one that
    says how hard to hold a stick in `hold`, shape (3, 3): `softer` than `kernels.contact` does.
    """
    s, pair = GAMMA / h, ALPHA_BETA / h
    if not factorise(chain, s * s, s, 1.0, wrench, tangent.chain, tangent.real):
        return False
    if not factorise(chain, pair * pair, pair, 1.0, wrench, tangent.chain, tangent.pair):
        return False
    for i in range(3):
        for j in range(3):
            one, two = tangent.real.compliance[i, j], tangent.pair.compliance[i, j]
            hold[i, j] = softer * one
            for row in range(3):
                for column in range(3):
                    entry = FROM_REAL[row] * TO_REAL[column] * one
                    entry += (FROM_COMPLEX[row] * TO_COMPLEX[column] * two).real
                    compliance[3 * row + i, 3 * column + j] = entry
    return True


@kernel
def free_response(
    chain: Chain, tangent: Tangent, imbalance: Array, load: Array, free: Array
) -> None:
    """Inward sweeps: how tip and base answer to the imbalances alone.

    Adds to the `load` on the base, shape (3,); the tip's increments go into `free`, (3, 3).
    """
    real, pair = tangent.real_side, tangent.pair_side
    for j in range(imbalance.shape[1]):
        one, two = 0.0, 0j
        for i in range(3):
            one += TO_REAL[i] * imbalance[i, j]
            two += TO_COMPLEX[i] * imbalance[i, j]
        real.moment[j] = one
        pair.moment[j] = two
    reduce_moments(chain, tangent.chain, tangent.real, real)
    reduce_moments(chain, tangent.chain, tangent.pair, pair)
    for i in range(3):
        load[i] += FROM_REAL[i] * real.root[0] + (FROM_COMPLEX[i] * pair.root[0]).real
        for j in range(3):
            free[i, j] = FROM_REAL[i] * real.free[j] + (FROM_COMPLEX[i] * pair.free[j]).real


@kernel
def increments(chain: Chain, tangent: Tangent, change: Array, z: Array, load: Array) -> float:
    """Outward sweeps: correct the joint increments `z` and the `load` on the base.

    `change` is that of the contact wrenches, shape (3, 3).  Returns the largest rotation of a
    body by the correction.
    """
    real, pair = tangent.real_side, tangent.pair_side
    real_load, pair_load = 0.0, 0j
    for j in range(3):
        one, two = 0.0, 0j
        for i in range(3):
            one += TO_REAL[i] * change[i, j]
            two += TO_COMPLEX[i] * change[i, j]
        real.change[j] = one
        pair.change[j] = two
        real_load += tangent.real.root[j] * one
        pair_load += tangent.pair.root[j] * two
    joint_increments(chain, tangent.chain, tangent.real, real)
    joint_increments(chain, tangent.chain, tangent.pair, pair)
    largest = 0.0
    for i in range(3):
        load[i] += FROM_REAL[i] * real_load + (FROM_COMPLEX[i] * pair_load).real
        turn = 0.0
        for j in range(z.shape[1]):
            dz = FROM_REAL[i] * real.increment[j] + (FROM_COMPLEX[i] * pair.increment[j]).real
            z[i, j] += dz
            turn += dz
            largest = max(largest, abs(turn))
    return largest


@kernel
def _release(wrench: Array, change: Array, free: Array, compliance: Array, moved: Array) -> None:
    """The answer of a tip that touches nothing: the guessed wrenches vanish."""
    for i in range(3):
        for j in range(3):
            change[i, j] = -wrench[i, j]
            wrench[i, j] = 0.0
    for i in range(3):
        for j in range(3):
            total = free[i, j]
            for other in range(3):
                for m in range(3):
                    total += compliance[3 * i + j, 3 * other + m] * change[other, m]
            moved[i, j] = total


@kernel
def radau_step(
    model: Model,
    stretch: Stretch,
    accuracy: float,
    scale: float,
    q0: Array,
    v0: Array,
    modes: ContactModes,
    workspace: RadauWorkspace,
) -> int:
    """Take one step from the state (`q0`, `v0`).

    Parameters
    ----------
    accuracy
        Accepted error of the iteration: of a body's angle [rad], and of forces relative to
        `scale` [N].
    modes
        Of the contacts, held in all stages.
    work
        Holds the first guess (`guess_first`, `guess_next`) and receives the result; the step's
        end is the last stage.

    Returns
    -------
    int
        Number of Newton iterations, or 0 when there was no convergence.
    """
    chain, stages, contacts, tip = model.chain, workspace.stages, workspace.contacts, workspace.tip
    h = stretch.h
    copy_modes(modes, contacts.stage.modes)
    touching, stuck = False, 0
    for k in range(modes.normal.size):
        stuck += modes.normal[k] != OPEN and modes.friction[k] == STICK
        touching |= modes.normal[k] != OPEN
        for i in range(3):
            contacts.normal_force[i, k] = 0.0
            contacts.friction_force[i, k] = 0.0
            contacts.slip[i, k] = 0.0
    before = 0.0
    for iteration in range(MAX_ITERATIONS + 1):
        _place_stages(h, q0, v0, stages)
        # The first round linearises at the guess of the middle stage.
        for i in range(3):
            if iteration == 0 and i != 1:
                continue
            base_in_step(stretch, NODES[i], workspace.base)
            q, v, wrench = stages.q[i], stages.v[i], contacts.wrench[i]
            place(chain, workspace.base, model.gravity, q, v, stages.a[i], workspace.chain, tip)
            if iteration == 0:
                copy_chain(workspace.chain, workspace.tangent.chain)
                continue
            stages.load[i] = imbalances(chain, q, v, wrench, workspace.chain, stages.imbalance[i])
            contacts.turn[i, 0] = tip.turn[0]
            contacts.turn[i, 1] = tip.turn[1]
            for j in range(3):
                contacts.pose[i, j] = tip.pose[j]
                contacts.twist[i, j] = tip.twist[j]
        if iteration == 0:
            wrench = contacts.wrench[1]
            softer = 1.0 if stuck > 1 else SOFT_HOLD
            if not _factorise(
                chain, h, wrench, softer, workspace.tangent, contacts.hold, contacts.compliance
            ):
                return 0
            continue
        free_response(chain, workspace.tangent, stages.imbalance, stages.load, contacts.free)
        if touching:
            if not solve_stage_contacts(
                model.fingertip,
                model.obstacle,
                model.law,
                h,
                CONTACT_ACCURACY * accuracy * scale,
                contacts,
            ):
                return 0
        else:
            _release(
                contacts.wrench,
                contacts.change,
                contacts.free,
                contacts.compliance,
                contacts.increment,
            )
        turn = increments(chain, workspace.tangent, contacts.change, stages.z, stages.load)
        if not turn < MAX_TURN:
            return 0
        force = 0.0
        for i in range(3):
            for j in range(2):
                force = max(force, abs(contacts.change[i, j]))
                if touching:
                    sunk = model.law.stiffness * abs(contacts.increment[i, j])
                    force = max(force, CONSISTENT * sunk)
        size = max(turn, force / scale)
        ratio = size / before if before > 0.0 else 1.0
        stagnant = iteration > 2 and ratio > 0.5 and size <= ROUNDING
        if size <= AT_ONCE * accuracy or size * ratio <= (1.0 - ratio) * accuracy or stagnant:
            _place_stages(h, q0, v0, stages)
            measure_stages(model.fingertip, model.obstacle, model.law, h, contacts)
            return iteration
        if iteration > 2 and ratio >= 1.0:
            return 0
        before = size
    return 0
