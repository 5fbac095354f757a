"""What contacts do next: a tiny step of the implicit Euler method that finds their modes.

It is taken at the start of a run, after a jump of the commanded motion and after an event.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.accelerations import solve_accelerations
from hma_gripper_sim.kernels.base_motion import Stretch, base_in_step
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import CLOSED, GRAZING, OPEN, closing_margin, copy_modes
from hma_gripper_sim.kernels.error_propagation import ErrorWork
from hma_gripper_sim.kernels.integrator import HalfState, stage_power
from hma_gripper_sim.kernels.radau import RadauWork
from hma_gripper_sim.kernels.radau_events import event_margins
from hma_gripper_sim.kernels.stage import Model, Work, solve_stage

Array = NDArray[np.float64]

ACCURACY = 1e-12  # of the stage [rad]


@kernel
def find_modes(
    model: Model,
    stretch: Stretch,
    allowed: float,
    state: HalfState,
    work: Work,
    radau: RadauWork,
    error: ErrorWork,
    margin: Array,
) -> float:
    """Take an implicit Euler step that finds the contact modes, and forces that go with them.

    A step that is off by more than `allowed` [rad] is not taken.

    Parameters
    ----------
    state
        Where the step starts; receives the result, but for its clock.
    work, radau
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
    duration, contact = stretch.h, work.contact
    s = 1.0 / duration
    base_in_step(stretch, 1.0, work.base)
    for j in range(3):
        work.tip.wrench[j] = state.wrench[j]
    for i in range(state.q.size):
        radau.q[i] = state.q[i] + duration * state.v[i]
    copy_modes(state.modes, contact.modes)
    if not solve_stage(model, s, ACCURACY, state.q, state.v, radau.q, radau.v, radau.a, work):
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
    stage_power(model, s, radau.v, work, radau.power)
    tip, found = radau.tip, radau.contacts.work
    if not solve_accelerations(
        model,
        work.base,
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
        apart = found.gap[k]
        if modes.normal[k] == OPEN:
            apart = closing_margin(
                model.fingertip, model.obstacle, model.law, tip.pose, tip.twist, k
            )
        event_margins(
            model.law,
            modes,
            k,
            found.normal_force[k],
            found.friction_force[k],
            found.slip[k],
            apart,
            margin[k],
        )
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
