"""Contact of the tip in three coupled stages: a problem in nine unknowns.

The stages of a Radau step answer together: a wrench in one of them moves the tip in all three.
`solve_stage_contacts` finds the wrenches for which the contact law and that answer agree at
fixed contact modes, by Newton's method on the three poses of the tip.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import rotation
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact import ROUNDING
from hma_gripper_sim.kernels.contact_law import OPEN, ContactLaw, closing_margin
from hma_gripper_sim.kernels.contact_wrench import ContactWork, contact_work, evaluate_contacts
from hma_gripper_sim.kernels.proximity import Obstacle
from hma_gripper_sim.kernels.radau_method import GAMMA, INVERSE
from hma_gripper_sim.kernels.touch import Fingertip

Array = NDArray[np.float64]

MAX_ITERATIONS = 30
SIZE = 9  # unknowns: three stages of x, z and angle


class StageContacts(NamedTuple):
    """The tip at three stages, its answer to wrenches, and its contacts; rows are stages."""

    work: ContactWork  # of the stage at hand
    stick_force: Array  # [N], shape (3, k)
    normal_force: Array  # [N], shape (3, k)
    friction_force: Array  # [N], shape (3, k)
    slip: Array  # [m/s], shape (3, k)
    slip_row: Array  # of the slip to the twist, shape (3, k, 3)
    apart: Array  # gap, of open contacts `closing_margin` [m], shape (3, k)
    law_wrench: Array  # of the contact law at the trial increments, shape (3, 3)
    by_pose: Array  # its differentials, shape (3, 3, 3)
    by_twist: Array  # shape (3, 3, 3)
    pose: Array  # where the linearisation is, shape (3, 3)
    turn: Array  # cosine and sine of the pose's angle, shape (3, 2)
    twist: Array  # shape (3, 3)
    found_pose: Array  # for the increments found, shape (3, 3)
    found_twist: Array  # shape (3, 3)
    wrench: Array  # estimated, then found; on the tip about its joint, shape (3, 3)
    change: Array  # from the one to the other, shape (3, 3)
    free: Array  # increment of the pose under the estimated wrenches, shape (3, 3)
    increment: Array  # and under those found, shape (3, 3)
    compliance: Array  # from changes of all wrenches to all poses, shape (9, 9)
    hold: Array  # compliance of a single stage that says how hard to hold a stick, (3, 3)
    residual: Array  # scratch, shape (9,)
    matrix: Array  # scratch, shape (9, 9)


def stage_contacts(fingertip: Fingertip) -> StageContacts:
    """Allocate the buffers for a fingertip."""
    work = contact_work(fingertip)
    k = work.slip.size
    return StageContacts(
        work,
        np.zeros((3, k)),
        np.zeros((3, k)),
        np.zeros((3, k)),
        np.zeros((3, k)),
        np.zeros((3, k, 3)),
        np.zeros((3, k)),
        np.zeros((3, 3)),
        np.zeros((3, 3, 3)),
        np.zeros((3, 3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 2)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        np.zeros((SIZE, SIZE)),
        np.zeros((3, 3)),
        np.zeros(SIZE),
        np.zeros((SIZE, SIZE)),
    )


@kernel
def solve_dense(matrix: Array, vector: Array) -> bool:
    """Solve a linear system in place by elimination with row pivots; False if singular."""
    n = vector.size
    for i in range(n):
        pivot, largest = i, abs(matrix[i, i])
        for row in range(i + 1, n):
            if abs(matrix[row, i]) > largest:
                pivot, largest = row, abs(matrix[row, i])
        if not (largest > 0.0 and np.isfinite(largest)):
            return False
        if pivot != i:
            for j in range(i, n):
                matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
            vector[i], vector[pivot] = vector[pivot], vector[i]
        inverse = 1.0 / matrix[i, i]
        for row in range(i + 1, n):
            share = matrix[row, i] * inverse
            if share != 0.0:
                for j in range(i + 1, n):
                    matrix[row, j] -= share * matrix[i, j]
                vector[row] -= share * vector[i]
    for i in range(n - 1, -1, -1):
        total = vector[i]
        for j in range(i + 1, n):
            total -= matrix[i, j] * vector[j]
        vector[i] = total / matrix[i, i]
    return True


@kernel
def _move_stage(h: float, i: int, work: StageContacts) -> None:
    """Pose and twist of stage `i` at the trial increments, into ``work.work``."""
    for j in range(3):
        rate = 0.0
        for other in range(3):
            rate += INVERSE[i, other] * work.increment[other, j]
        work.work.pose[j] = work.pose[i, j] + work.increment[i, j]
        work.work.twist[j] = work.twist[i, j] + rate / h


@kernel
def _evaluate_stages(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    h: float,
    fresh: bool,
    work: StageContacts,
) -> bool:
    """Evaluate the contacts of all stages at the trial increments; whether sticks have settled."""
    stage = work.work
    all_settled = True
    for i in range(3):
        _move_stage(h, i, work)
        turn_cos, turn_sin = rotation(work.increment[i, 2])
        stage.turn[0] = work.turn[i, 0] * turn_cos - work.turn[i, 1] * turn_sin
        stage.turn[1] = work.turn[i, 1] * turn_cos + work.turn[i, 0] * turn_sin
        for k in range(stage.slip.size):
            stage.modes.stick_force[k] = work.stick_force[i, k]
        all_settled &= evaluate_contacts(
            fingertip, obstacle, law, GAMMA / h, work.hold, fresh, stage
        )
        for k in range(stage.slip.size):
            work.stick_force[i, k] = stage.modes.stick_force[k]
            if stage.modes.normal[k] != OPEN:
                work.normal_force[i, k] = stage.normal_force[k]
                work.friction_force[i, k] = stage.friction_force[k]
                work.slip[i, k] = stage.slip[k]
                for j in range(3):
                    work.slip_row[i, k, j] = stage.slip_row[k, j]
                work.apart[i, k] = stage.gap[k]
        for m in range(3):
            work.law_wrench[i, m] = stage.wrench[m]
            for j in range(3):
                work.by_pose[i, m, j] = stage.by_pose[m, j]
                work.by_twist[i, m, j] = stage.by_twist[m, j]
    return all_settled


@kernel
def build_matrix(h: float, work: StageContacts) -> None:
    """Set up the tangent of the residual: ``1 - compliance d(wrench)/d(pose)``."""
    for other in range(3):
        for j in range(3):
            column = 3 * other + j
            for row in range(SIZE):
                work.matrix[row, column] = 1.0 if row == column else 0.0
            for i in range(3):
                for m in range(3):
                    slope = INVERSE[i, other] / h * work.by_twist[i, m, j]
                    if i == other:
                        slope += work.by_pose[i, m, j]
                    for row in range(SIZE):
                        work.matrix[row, column] -= work.compliance[row, 3 * i + m] * slope


@kernel
def solve_stage_contacts(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    h: float,
    accuracy: float,
    work: StageContacts,
) -> bool:
    """Find the wrenches for which contact law and linearised chain agree at the given modes.

    `accuracy` is that of a contact force [N].  Leaves the wrenches, their change and the
    increments of the poses in `work`.
    """
    give = work.hold[0, 0] + work.hold[1, 1]
    reach = np.sqrt(give / work.hold[2, 2])  # makes an angle comparable to a way
    place = max(abs(work.pose[2, 0]), abs(work.pose[2, 1]), reach)
    accuracy += ROUNDING * place * (law.stiffness + law.damping * GAMMA / h)
    for i in range(3):
        for j in range(3):
            work.increment[i, j] = work.free[i, j]
    for iteration in range(MAX_ITERATIONS):
        settled = _evaluate_stages(fingertip, obstacle, law, h, iteration == 0, work)
        square = 0.0
        for i in range(3):
            for j in range(3):
                r = work.increment[i, j] - work.free[i, j]
                for other in range(3):
                    for m in range(3):
                        lack = work.law_wrench[other, m] - work.wrench[other, m]
                        r -= work.compliance[3 * i + j, 3 * other + m] * lack
                work.residual[3 * i + j] = r
                square += (r * (reach if j == 2 else 1.0)) ** 2
        if settled and np.sqrt(square) <= accuracy * give:
            for i in range(3):
                for j in range(3):
                    work.change[i, j] = work.law_wrench[i, j] - work.wrench[i, j]
                    work.wrench[i, j] = work.law_wrench[i, j]
            return True
        build_matrix(h, work)
        if not solve_dense(work.matrix, work.residual):
            return False
        for i in range(3):
            for j in range(3):
                work.increment[i, j] -= work.residual[3 * i + j]
    return False


@kernel
def measure_stages(
    fingertip: Fingertip, obstacle: Obstacle, law: ContactLaw, h: float, work: StageContacts
) -> None:
    """Poses, twists and closing margins of open contacts at all stages, for what was found."""
    stage = work.work
    for i in range(3):
        _move_stage(h, i, work)
        for j in range(3):
            work.found_pose[i, j] = stage.pose[j]
            work.found_twist[i, j] = stage.twist[j]
        for k in range(stage.slip.size):
            if stage.modes.normal[k] == OPEN:
                work.apart[i, k] = closing_margin(
                    fingertip, obstacle, law, stage.pose, stage.twist, k
                )
