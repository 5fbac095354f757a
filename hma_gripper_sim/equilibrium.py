"""The start pose: one half of the gripper hanging at rest, on the object where they touch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.contact import ContactModes, contact_modes, copy_modes, measure_gaps
from hma_gripper_sim.kernels.integrator import HalfState
from hma_gripper_sim.kernels.stage import Model, Work, allocate, solve_stage
from hma_gripper_sim.outcome import Outcome, SimulationError

Array = NDArray[np.float64]

ACCURACY = 1e-14  # rad
FIRST_STEP = 1e-4  # s
WEIGHTLESS = 1e-6  # of what bends the beams: the least force that counts where nothing weighs
LOAD_INCREMENTS = (1, 10, 100)  # of gravity, tried in this order until the start pose is found


def start_state(model: Model) -> HalfState:
    """Static equilibrium at travel 0, to rounding.

    Raises
    ------
    SimulationError
        There is none, or it was not found.
    """
    n = model.chain.rest.size
    work = allocate(model)
    q, v, a = np.zeros(n), np.zeros(n), np.zeros(n)
    candidates = len(work.contact.normal_force)
    if not any(_settle(model, increments, work, q, v, a) for increments in LOAD_INCREMENTS):
        raise SimulationError(Outcome.NO_EQUILIBRIUM, 0.0)
    load = work.tip.root_force[0]
    margin, drift = np.zeros((candidates, 2)), np.zeros((candidates, 2))
    measure_gaps(
        model.fingertip,
        model.obstacle,
        work.contact.pose,
        work.tip.twist,
        work.contact.modes,
        margin,
        drift,
    )
    weight = float(model.chain.mass.sum()) * model.gravity
    scale = max(abs(load), weight, WEIGHTLESS * model.bending)
    return HalfState(
        clock=np.array([0.0, FIRST_STEP, scale, 0.0]),
        q=q,
        v=v,
        a=a,
        wrench=work.tip.wrench.copy(),
        modes=_copy_modes(work.contact.modes),
        margin=margin,
        drift=drift,
        load=np.array([load]),
        work=np.zeros(4),
        counts=np.zeros(3, dtype=np.int64),
    )


def copy_state(state: HalfState) -> HalfState:
    """A state with arrays of its own."""
    return HalfState(
        state.clock.copy(),
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


def _settle(model: Model, increments: int, work: Work, q: Array, v: Array, a: Array) -> bool:
    """Hang the stress-free gripper up with the gravity rising in a number of increments."""
    q[:] = 0.0
    work.base[:] = 0.0
    work.tip.wrench[:] = 0.0
    copy_modes(contact_modes(len(work.contact.normal_force)), work.contact.modes)
    zero = np.zeros(len(q))
    for share in np.arange(1, increments + 1) / increments:
        partly = model._replace(gravity=share * model.gravity)
        if not solve_stage(partly, 0.0, ACCURACY, zero, zero, q, v, a, work):
            return False
        work.tip.wrench[:] = work.contact.wrench
    return True
