"""Contact of the rigid tip with a rigid convex object: a problem in three unknowns.

`solve_contact` finds the wrench for which the contact law and the linearised chain agree:
Newton's method on the pose of the tip with a mode for each contact (open, grazing or closed;
sticking or sliding either way), revised whenever it has converged.  Where that goes round in
circles, friction is softened and hardened again.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import TipResponse, rotation
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import OPEN, STICK, ContactLaw
from hma_gripper_sim.kernels.contact_wrench import ContactWorkspace, evaluate_contacts
from hma_gripper_sim.kernels.proximity import Obstacle
from hma_gripper_sim.kernels.touch import Fingertip

Array = NDArray[np.float64]

ROUNDING = 1e-15  # of a gap or a slip, relative to the numbers that it is computed from
JUDGED = 1e-3  # error relative to the contact force at which the modes can be judged
MAX_ITERATIONS, CAREFUL_ITERATIONS = 30, 80
BLOCK_REVISIONS = 8  # of the modes of all contacts together, unless the search is careful
STILL = 1e-9  # slip that passes for none where contacts share a stick force, to the tip's speed
HARDENING = 0.2  # of the slip velocity from one softened problem to the next
LEVELS = 13  # the problem itself, softened ones, and itself again


@kernel
def _evaluate(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    tip: TipResponse,
    fresh: bool,
    workspace: ContactWorkspace,
) -> bool:
    """Evaluate the forces of the present modes and their tangent at the trial increment.

    The twist follows the increment with the rate `s`.  Returns whether all stick forces have
    settled.
    """
    for j in range(3):
        workspace.pose[j] = tip.pose[j] + workspace.increment[j]
        workspace.twist[j] = tip.twist[j] + s * workspace.increment[j]
    turn_cos, turn_sin = rotation(workspace.increment[2])
    workspace.turn[0] = tip.turn[0] * turn_cos - tip.turn[1] * turn_sin
    workspace.turn[1] = tip.turn[1] * turn_cos + tip.turn[0] * turn_sin
    settled = evaluate_contacts(fingertip, obstacle, law, s, tip.compliance, fresh, workspace)
    for i in range(3):
        for j in range(3):
            workspace.tangent[i, j] = workspace.by_pose[i, j] + s * workspace.by_twist[i, j]
    return settled


@kernel
def _solve3(matrix: Array, vector: Array, solution: Array) -> bool:
    """Solve a 3x3 system by Cramer's rule with one step of iterative refinement."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 0], matrix[1, 1], matrix[1, 2]
    g, h, i = matrix[2, 0], matrix[2, 1], matrix[2, 2]
    ei, fg, dh = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * ei + b * fg + c * dh
    if det == 0.0 or not np.isfinite(det):
        return False
    inverse = 1.0 / det
    rx, ry, rz = vector[0], vector[1], vector[2]
    x = (ei * rx + (c * h - b * i) * ry + (b * f - c * e) * rz) * inverse
    y = (fg * rx + (a * i - c * g) * ry + (c * d - a * f) * rz) * inverse
    z = (dh * rx + (b * g - a * h) * ry + (a * e - b * d) * rz) * inverse
    rx -= a * x + b * y + c * z
    ry -= d * x + e * y + f * z
    rz -= g * x + h * y + i * z
    solution[0] = x + (ei * rx + (c * h - b * i) * ry + (b * f - c * e) * rz) * inverse
    solution[1] = y + (fg * rx + (a * i - c * g) * ry + (c * d - a * f) * rz) * inverse
    solution[2] = z + (dh * rx + (b * g - a * h) * ry + (a * e - b * d) * rz) * inverse
    return True


@kernel
def _revise_modes(workspace: ContactWorkspace, revision: int, block: int) -> bool:
    """Take over the wanted modes; return whether any changed.

    The first revision only closes contacts, those after `block` ones change one contact each.
    A contact that closes slides as it moves; if that has been tried, it sticks: one of both has
    a solution unless the step is too long.
    """
    modes, wanted = workspace.modes, workspace.wanted
    changed = False
    for k in range(modes.normal.size):
        if wanted.normal[k] != modes.normal[k]:
            if modes.normal[k] == OPEN:
                modes.friction[k] = wanted.friction[k] if revision % 2 == 0 else STICK
                modes.stick_force[k] = 0.0
            elif revision == 0:
                continue
            modes.normal[k] = wanted.normal[k]
        elif wanted.friction[k] != modes.friction[k] and revision > 0 and modes.normal[k] != OPEN:
            modes.stick_force[k] = workspace.friction_force[k]
            modes.friction[k] = wanted.friction[k]
        else:
            continue
        changed = True
        if revision > block:
            break
    return changed


@kernel
def _measure_noise(s: float, reach: float, tip: TipResponse, workspace: ContactWorkspace) -> None:
    """Note what rounding makes of the contact forces, and the slip that passes for none.

    `reach` [m] makes an angle comparable to a way.
    """
    moved, speed = 0.0, 0.0
    for j in range(3):
        length = reach if j == 2 else 1.0
        moved += length * (abs(workspace.increment[j]) + abs(tip.free[j]))
        speed += length * (abs(tip.twist[j]) + s * abs(workspace.increment[j]))
    place = abs(tip.pose[0]) + abs(tip.pose[1])
    noise = workspace.rigidity[0] * place + workspace.rigidity[1] * speed
    noise += moved / (tip.compliance[0, 0] + tip.compliance[1, 1])
    workspace.noise[0] = ROUNDING * noise
    workspace.noise[1] = STILL * speed


@kernel
def _search(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    precision: float,
    careful: bool,
    tip: TipResponse,
    workspace: ContactWorkspace,
) -> bool:
    """`solve_contact` from the present modes and trial increment.

    A `careful` search lets only one contact change its mode at a time, as Murty's least-index
    method does (K. G. Murty, Opsearch 11, 1974), which cannot go round in circles where there
    is one solution for all loads.
    """
    compliance = tip.compliance[0, 0] + tip.compliance[1, 1]
    reach = np.sqrt(compliance / tip.compliance[2, 2])  # makes an angle comparable to a way
    workspace.noise[:] = 0.0
    revisions = -1
    fresh = revisions < 0  # not a literal True: numba would compile everything for that, too
    block = 0 if careful else BLOCK_REVISIONS
    for _ in range(CAREFUL_ITERATIONS if careful else MAX_ITERATIONS):
        settled = _evaluate(fingertip, obstacle, law, s, tip, fresh, workspace)
        if revisions < 0:
            revisions = 0
            if _revise_modes(workspace, 0, block):
                continue
        square = 0.0
        for i in range(3):
            r = workspace.increment[i] - tip.free[i]
            for j in range(3):
                r -= tip.compliance[i, j] * (workspace.wrench[j] - tip.wrench[j])
            workspace.residual[i] = r
            weight = reach if i == 2 else 1.0
            square += (weight * r) ** 2
        lack = np.sqrt(square) / compliance  # as a force
        pressed = 0.0
        for k in range(workspace.normal_force.size):
            pressed += abs(workspace.normal_force[k])
        _measure_noise(s, reach, tip, workspace)
        noise = workspace.noise[0] + ROUNDING * pressed
        if lack <= noise + JUDGED * pressed:
            revisions += 1
            if _revise_modes(workspace, revisions, block):
                fresh = True
                continue
            if settled and lack <= noise + precision * pressed:
                return True
        for i in range(3):
            for j in range(3):
                entry = 1.0 if i == j else 0.0
                for k in range(3):
                    entry -= tip.compliance[i, k] * workspace.tangent[k, j]
                workspace.matrix[i, j] = entry
        if not _solve3(workspace.matrix, workspace.residual, workspace.correction):
            return False
        for j in range(3):
            workspace.increment[j] -= workspace.correction[j]
        fresh = False
    return False


@kernel
def _soften(law: ContactLaw, s: float, level: int, tip: TipResponse) -> ContactLaw:
    """The law with a slip velocity that falls from the tip's speed from level to level."""
    speed = abs(tip.twist[0] + s * tip.free[0]) + abs(tip.twist[1] + s * tip.free[1])
    slip_velocity = max(law.slip_velocity, speed * HARDENING ** (level - 1))
    return ContactLaw(law.stiffness, law.damping, law.friction, slip_velocity, law.graze)


@kernel
def solve_contact(
    fingertip: Fingertip,
    obstacle: Obstacle,
    law: ContactLaw,
    s: float,
    precision: float,
    tip: TipResponse,
    workspace: ContactWorkspace,
) -> bool:
    """Find the contact wrench for which contact law and linearised chain agree.

    The search starts from the present modes.  Where they have nothing to do with the solution,
    as after a jump of the velocity, and several contacts share the friction, it can go round
    in circles.  Then friction is softened until all contacts creep, which has one solution that
    Newton's method finds from anywhere, and hardened again.

    Leaves the wrench and the modes in `workspace`; returns False when there was no agreement
    within `precision` of the contact force or rounding.
    """
    level = 0
    while True:
        softened = 0 < level < LEVELS
        eased = _soften(law, s, level, tip) if softened else law
        if level <= 1:
            for j in range(3):
                workspace.increment[j] = tip.free[j]
        if level == 1:
            workspace.modes.normal[:] = OPEN
            workspace.modes.friction[:] = STICK
        accuracy = JUDGED if softened else precision
        found = _search(fingertip, obstacle, eased, s, accuracy, level > 0, tip, workspace)
        if level == LEVELS or (level == 0 and (found or law.friction == 0.0 or s == 0.0)):
            return found
        # Rounding may end the softened problems early.
        level = level + 1 if found or level == 0 else LEVELS
