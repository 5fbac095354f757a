"""What contacts do next: a tiny step of the implicit Euler method that finds their modes.

It is taken at the start of a run, after a jump of the commanded motion and after an event.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.accelerations import solve_accelerations
from hma_gripper_sim.kernels.base_motion import Stretch, base_in_step
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import (
    CLOSED,
    GRAZING,
    OPEN,
    ContactModes,
    closing_margin,
    copy_modes,
)
from hma_gripper_sim.kernels.error_propagation import ErrorWorkspace
from hma_gripper_sim.kernels.integrator import HalfState, stage_power
from hma_gripper_sim.kernels.radau import RadauWorkspace
from hma_gripper_sim.kernels.radau_events import event_margins
from hma_gripper_sim.kernels.stage import Model, Workspace, solve_stage

Array = NDArray[np.float64]

ACCURACY = 1e-12  # of the stage [rad]


@kernel
def _step(
    model: Model, stretch: Stretch, state: HalfState, workspace: Workspace, radau: RadauWorkspace
) -> bool:
    """Take the step, contact modes found with it, into ``radau.q``, ``v`` and ``a``."""
    base_in_step(stretch, 1.0, workspace.base)
    for j in range(3):
        workspace.tip.wrench[j] = state.wrench[j]
    for i in range(state.q.size):
        radau.q[i] = state.q[i] + stretch.h * state.v[i]
    copy_modes(state.modes, workspace.contact.modes)
    iterations = solve_stage(
        model, 1.0 / stretch.h, ACCURACY, state.q, state.v, radau.q, radau.v, radau.a, workspace
    )
    return iterations > 0


@kernel
def _measure_margins(
    model: Model, modes: ContactModes, radau: RadauWorkspace, margin: Array
) -> None:
    """How far each contact is from a change of its modes, from the state's forces and motion."""
    tip, found = radau.tip, radau.contacts.stage
    for k in range(modes.normal.size):
        apart = found.gap[k]
        if modes.normal[k] == OPEN:
            apart = closing_margin(
                model.fingertip, model.obstacle, model.law, tip.pose, tip.twist, k
            )
        normal, friction = found.normal_force[k], found.friction_force[k]
        event_margins(model.law, modes, k, normal, friction, found.slip[k], apart, margin[k])


@kernel
def find_modes(
    model: Model,
    stretch: Stretch,
    allowed: float,
    state: HalfState,
    workspace: Workspace,
    radau: RadauWorkspace,
    error: ErrorWorkspace,
    margin: Array,
) -> float:
    """Take an implicit Euler step that finds the contact modes, and forces that go with them.

    A step that is off by more than `allowed` [rad] is not taken.

    Parameters
    ----------
    state
        Where the step starts; receives the result, but for its clock.
    workspace, radau
        Buffers; ``radau.tip`` receives pose and twist of the tip.
    error
        The error that is carried along; receives what this step adds to it.
    margin
        Receives how far each contact is from a change of its modes, shape (k, 2).

    Returns
    -------
    float
        What it is off in the angle of a body [rad], or inf when there was no convergence: then
        nothing changes.
    """
    duration, contact = stretch.h, workspace.contact
    if not _step(model, stretch, state, workspace, radau):
        return np.inf
    turn, largest = 0.0, 0.0
    for i in range(state.q.size):
        turn += radau.v[i] - state.v[i]
        largest = max(largest, abs(turn))
    off = float(0.5 * duration * largest)
    if off > allowed:
        return off
    modes = contact.modes
    for k in range(modes.normal.size):
        # A touch is over this layer in no time; but a force along the tip's normal can keep a
        # contact in it that slides along the object's surface.
        if modes.normal[k] == GRAZING and not model.fingertip.along_tip_normal:
            modes.normal[k] = CLOSED
        modes.stick_force[k] = contact.friction_force[k]
    stage_power(model, 1.0 / duration, radau.v, workspace, radau.power)
    tip, found = radau.tip, radau.contacts.stage
    if not solve_accelerations(
        model,
        workspace.base,
        radau.q,
        radau.v,
        modes,
        radau.a,
        radau.chain,
        tip,
        radau.tangent.real,
        radau.tangent.real_side,
        found,
    ):
        return np.inf
    for k in range(modes.normal.size):
        modes.stick_force[k] = found.friction_force[k]
    _measure_margins(model, modes, radau, margin)
    copy_modes(modes, state.modes)
    for i in range(state.q.size):
        error.angle[i] -= 0.5 * duration * (radau.v[i] - state.v[i])
        state.q[i] = radau.q[i]
        state.v[i] = radau.v[i]
        state.a[i] = radau.a[i]
    for j in range(3):
        state.wrench[j] = found.wrench[j]
    for j in range(4):
        state.work[j] += duration * radau.power[j]
    state.load[0] = tip.root_force[0]
    return off
