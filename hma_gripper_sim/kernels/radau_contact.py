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
from hma_gripper_sim.kernels.contact_wrench import (
    ContactWorkspace,
    contact_workspace,
    evaluate_contacts,
)
from hma_gripper_sim.kernels.proximity import Obstacle
from hma_gripper_sim.kernels.radau_method import GAMMA, INVERSE
from hma_gripper_sim.kernels.touch import Fingertip

Array = NDArray[np.float64]

MAX_ITERATIONS = 30
SIZE = 9  # unknowns: three stages of x, z and angle


class StageContacts(NamedTuple):
    """The tip at three stages, its answer to wrenches, and its contacts; rows are stages."""

    stage: ContactWorkspace  # of the stage at hand
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
    workspace = contact_workspace(fingertip)
    k = workspace.slip.size
    return StageContacts(
        workspace,
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
def _move_stage(h: float, i: int, workspace: StageContacts) -> None:
    """Pose and twist of stage `i` at the trial increments, into ``workspace.stage``."""
    for j in range(3):
        rate = 0.0
        for other in range(3):
            rate += INVERSE[i, other] * workspace.increment[other, j]
        workspace.stage.pose[j] = workspace.pose[i, j] + workspace.increment[i, j]
        workspace.stage.twist[j] = workspace.twist[i, j] + rate / h


@kernel
def _evaluate_stages(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    h: float,
    fresh: bool,
    workspace: StageContacts,
) -> bool:
    """Evaluate the contacts of all stages at the trial increments; whether sticks have settled."""
    stage = workspace.stage
    all_settled = True
    for i in range(3):
        _move_stage(h, i, workspace)
        turn_cos, turn_sin = rotation(workspace.increment[i, 2])
        stage.turn[0] = workspace.turn[i, 0] * turn_cos - workspace.turn[i, 1] * turn_sin
        stage.turn[1] = workspace.turn[i, 1] * turn_cos + workspace.turn[i, 0] * turn_sin
        for k in range(stage.slip.size):
            stage.modes.stick_force[k] = workspace.stick_force[i, k]
        all_settled &= evaluate_contacts(
            fingertip, obstacle, law, GAMMA / h, workspace.hold, fresh, stage
        )
        for k in range(stage.slip.size):
            workspace.stick_force[i, k] = stage.modes.stick_force[k]
            if stage.modes.normal[k] != OPEN:
                workspace.normal_force[i, k] = stage.normal_force[k]
                workspace.friction_force[i, k] = stage.friction_force[k]
                workspace.slip[i, k] = stage.slip[k]
                for j in range(3):
                    workspace.slip_row[i, k, j] = stage.slip_row[k, j]
                workspace.apart[i, k] = stage.gap[k]
        for m in range(3):
            workspace.law_wrench[i, m] = stage.wrench[m]
            for j in range(3):
                workspace.by_pose[i, m, j] = stage.by_pose[m, j]
                workspace.by_twist[i, m, j] = stage.by_twist[m, j]
    return all_settled


@kernel
def build_matrix(h: float, workspace: StageContacts) -> None:
    """Set up the tangent of the residual: ``1 - compliance d(wrench)/d(pose)``."""
    for other in range(3):
        for j in range(3):
            column = 3 * other + j
            for row in range(SIZE):
                workspace.matrix[row, column] = 1.0 if row == column else 0.0
            for i in range(3):
                for m in range(3):
                    slope = INVERSE[i, other] / h * workspace.by_twist[i, m, j]
                    if i == other:
                        slope += workspace.by_pose[i, m, j]
                    for row in range(SIZE):
                        workspace.matrix[row, column] -= (
                            workspace.compliance[row, 3 * i + m] * slope
                        )


@kernel
def solve_stage_contacts(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    h: float,
    accuracy: float,
    workspace: StageContacts,
) -> bool:
    """Find the wrenches for which contact law and linearised chain agree at the given modes.

    `accuracy` is that of a contact force [N].  Leaves the wrenches, their change and the
    increments of the poses in `workspace`.
    """
    give = workspace.hold[0, 0] + workspace.hold[1, 1]
    reach = np.sqrt(give / workspace.hold[2, 2])  # makes an angle comparable to a way
    place = max(abs(workspace.pose[2, 0]), abs(workspace.pose[2, 1]), reach)
    accuracy += ROUNDING * place * (law.stiffness + law.damping * GAMMA / h)
    for i in range(3):
        for j in range(3):
            workspace.increment[i, j] = workspace.free[i, j]
    for iteration in range(MAX_ITERATIONS):
        settled = _evaluate_stages(fingertip, obstacle, law, h, iteration == 0, workspace)
        square = 0.0
        for i in range(3):
            for j in range(3):
                r = workspace.increment[i, j] - workspace.free[i, j]
                for other in range(3):
                    for m in range(3):
                        lack = workspace.law_wrench[other, m] - workspace.wrench[other, m]
                        r -= workspace.compliance[3 * i + j, 3 * other + m] * lack
                workspace.residual[3 * i + j] = r
                square += (r * (reach if j == 2 else 1.0)) ** 2
        if settled and np.sqrt(square) <= accuracy * give:
            for i in range(3):
                for j in range(3):
                    workspace.change[i, j] = workspace.law_wrench[i, j] - workspace.wrench[i, j]
                    workspace.wrench[i, j] = workspace.law_wrench[i, j]
            return True
        build_matrix(h, workspace)
        if not solve_dense(workspace.matrix, workspace.residual):
            return False
        for i in range(3):
            for j in range(3):
                workspace.increment[i, j] -= workspace.residual[3 * i + j]
    return False


@kernel
def measure_stages(
    fingertip: Fingertip, obstacle: Obstacle, law: ContactLaw, h: float, workspace: StageContacts
) -> None:
    """Poses, twists and closing margins of open contacts at all stages, for what was found."""
    stage = workspace.stage
    for i in range(3):
        _move_stage(h, i, workspace)
        for j in range(3):
            workspace.found_pose[i, j] = stage.pose[j]
            workspace.found_twist[i, j] = stage.twist[j]
        for k in range(stage.slip.size):
            if stage.modes.normal[k] == OPEN:
                workspace.apart[i, k] = closing_margin(
                    fingertip, obstacle, law, stage.pose, stage.twist, k
                )
