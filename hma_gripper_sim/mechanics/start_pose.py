"""The start pose: one half of the gripper at rest at travel 0.

It hangs freely.  Where that shape would reach into the object, the start is what comes of
hanging it up high above the object and lowering it slowly and without friction: a soft gripper
can rest on an object in several ways, and this is one that does not depend on a discretisation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.contact_law import (
    ContactModes,
    contact_modes,
    copy_modes,
    measure_gaps,
)
from hma_gripper_sim.kernels.integrator import HalfState
from hma_gripper_sim.kernels.stage import Model, Workspace, allocate, solve_stage
from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError

Array = NDArray[np.float64]

ACCURACY = 1e-14  # rad
FIRST_STEP = 1e-4  # s
WEIGHTLESS = 1e-6  # of what bends the beams: the least force that counts where nothing weighs
LOAD_INCREMENTS = (1, 10, 100)  # of gravity, tried in this order until the free shape is found
LARGEST_TURN = 0.01  # rad; of a body in one step downwards, so that the pose follows its branch
SMALLEST_STEP = 1e-6  # downwards, relative to the chain's length: what turns further falls over
FIRST_RELAXATION = 0.01  # step of a fall, relative to the time scale of the whole chain
LAST_RELAXATION = 1e6  # from this on what still turns does so by rounding
SETTLED = 1e-9  # rad, in such a step
RELAXATIONS = 1000  # steps of a fall


def start_state(model: Model) -> HalfState:
    """Static equilibrium at travel 0, to rounding.

    Raises
    ------
    SimulationError
        There is none, or it was not found.
    """
    n = model.chain.rest.size
    workspace = allocate(model)
    q, v, a = np.zeros(n), np.zeros(n), np.zeros(n)
    candidates = len(workspace.contact.normal_force)
    if not _hang(model, 0.0, workspace, q, v, a) or workspace.contact.wrench.any():
        height = 2.0 * float(np.hypot(model.chain.link[:, 0], model.chain.link[:, 1]).sum())
        if not (
            _hang(model, height, workspace, q, v, a) and _lower(model, height, workspace, q, v, a)
        ):
            raise SimulationError(Outcome.NO_EQUILIBRIUM, 0.0)
    load = workspace.tip.root_force[0]
    margin, drift = np.zeros((candidates, 2)), np.zeros((candidates, 2))
    measure_gaps(
        model.fingertip,
        model.obstacle,
        workspace.contact.pose,
        workspace.tip.twist,
        workspace.contact.modes,
        margin,
        drift,
    )
    weight = float(model.chain.mass.sum()) * model.gravity
    scale = max(abs(load), weight, WEIGHTLESS * model.bending)
    return HalfState(
        time=np.zeros(1),
        next_step=np.array([FIRST_STEP]),
        force_scale=np.array([scale]),
        crowding=np.zeros(1),
        q=q,
        v=v,
        a=a,
        wrench=workspace.tip.wrench.copy(),
        modes=_copy_modes(workspace.contact.modes),
        margin=margin,
        drift=drift,
        load=np.array([load]),
        work=np.zeros(4),
        counts=np.zeros(3, dtype=np.int64),
    )


def copy_state(state: HalfState) -> HalfState:
    """A state with arrays of its own."""
    return HalfState(
        state.time.copy(),
        state.next_step.copy(),
        state.force_scale.copy(),
        state.crowding.copy(),
        state.q.copy(),
        state.v.copy(),
        state.a.copy(),
        state.wrench.copy(),
        _copy_modes(state.modes),
        state.margin.copy(),
        state.drift.copy(),
        state.load.copy(),
        state.work.copy(),
        state.counts.copy(),
    )


def _copy_modes(modes: ContactModes) -> ContactModes:
    return ContactModes(modes.normal.copy(), modes.friction.copy(), modes.stick_force.copy())


def _hang(model: Model, height: float, workspace: Workspace, q: Array, v: Array, a: Array) -> bool:
    """Hang the stress-free gripper up at a height, in as few steps of gravity as will do."""
    return any(
        _load(model, height, increments, workspace, q, v, a) for increments in LOAD_INCREMENTS
    )


def _load(
    model: Model, height: float, increments: int, workspace: Workspace, q: Array, v: Array, a: Array
) -> bool:
    """Let the gravity rise on the stress-free gripper in a number of increments."""
    q[:] = 0.0
    workspace.base[:] = height, 0.0, 0.0
    workspace.tip.wrench[:] = 0.0
    copy_modes(contact_modes(len(workspace.contact.normal_force)), workspace.contact.modes)
    zero = np.zeros(len(q))
    for share in np.arange(1, increments + 1) / increments:
        partly = model._replace(gravity=share * model.gravity)
        if not solve_stage(partly, 0.0, ACCURACY, zero, zero, q, v, a, workspace):
            return False
        workspace.tip.wrench[:] = workspace.contact.wrench
    return True


def _lower(model: Model, height: float, workspace: Workspace, q: Array, v: Array, a: Array) -> bool:
    """Lower the gripper from a height where it hangs freely, by as large steps as are sure."""
    smallest = SMALLEST_STEP * height
    zero = np.zeros(len(q))
    step = height
    while height > 0.0:
        before, wrench = q.copy(), workspace.tip.wrench.copy()
        modes = _copy_modes(workspace.contact.modes)
        workspace.base[0] = max(0.0, height - step)
        found = solve_stage(model, 0.0, ACCURACY, zero, zero, q, v, a, workspace)
        if not found or np.abs(np.cumsum(q - before)).max() > LARGEST_TURN:
            q[:] = before
            workspace.tip.wrench[:] = wrench
            copy_modes(modes, workspace.contact.modes)
            if step > smallest:
                step *= 0.5
                continue
            if not _fall(model, workspace, q, v, a):
                return False
        workspace.tip.wrench[:] = workspace.contact.wrench
        height = workspace.base[0]
        step *= 2.0
    return True


def _fall(model: Model, workspace: Workspace, q: Array, v: Array, a: Array) -> bool:
    """Let go of the gripper where its branch of equilibria ends: it creeps to another."""
    chain = model.chain
    length = float(np.hypot(chain.link[:, 0], chain.link[:, 1]).sum())
    period = length * float(np.sqrt(chain.mass.sum() * (1.0 / chain.stiffness).sum()))
    model = model._replace(law=model.law._replace(friction=0.0))
    at_rest, step = np.zeros(len(q)), FIRST_RELAXATION * period
    for _ in range(RELAXATIONS):
        before, wrench = q.copy(), workspace.tip.wrench.copy()
        modes = _copy_modes(workspace.contact.modes)
        found = solve_stage(model, 1.0 / step, ACCURACY, before, at_rest, q, v, a, workspace)
        turn = np.abs(np.cumsum(q - before)).max()
        if not found or turn > LARGEST_TURN:
            q[:] = before
            workspace.tip.wrench[:] = wrench
            copy_modes(modes, workspace.contact.modes)
            step *= 0.5
            continue
        workspace.tip.wrench[:] = workspace.contact.wrench
        if turn < SETTLED and step > LAST_RELAXATION * period:
            v[:] = a[:] = 0.0
            return True
        step *= 2.0
    return False
