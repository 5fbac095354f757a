"""Time integration of one half by SDIRK2, in ticks: what goes on from any state at little cost.

Method: the two-stage singly diagonally implicit Runge-Kutta method of order 2 that is
L-stable and stiffly accurate (R. Alexander, SIAM J. Numer. Anal. 14, 1977).  Both stages are
implicit, so nothing of the time before a jump of force or command enters a step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.base_motion import Motion, Stretch, base_in_step, base_motion
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import (
    OPEN,
    STICK,
    ContactLaw,
    ContactModes,
    contact_modes,
    copy_modes,
    measure_gaps,
)
from hma_gripper_sim.kernels.contact_wrench import ContactWorkspace
from hma_gripper_sim.kernels.hidden_events import (
    Passage,
    PassageWorkspace,
    first_dip,
    first_hidden_touch,
    passage_workspace,
)
from hma_gripper_sim.kernels.stage import Model, Workspace, solve_stage

Array = NDArray[np.float64]

GAMMA = 1.0 - np.sqrt(0.5)
SMALLEST_STEP = 1e-9  # s
SAFETY = 0.9
SHRINK, GROW = 0.2, 2.5
RESTART, RESTART_TRAVEL = 1e-3, 1e-6  # s, m; first step after a jump or a touch
LANDING = 1.0 - 1e-4  # of the time to a touch: the step that ends just before it

# Error that one step may add at a tolerance of 1: angles of bodies, and the deviation of the
# force from a straight line, relative to the largest force so far.  The tolerance bounds the
# root mean square of the force's error, to which a step contributes the square of its own times
# its length: one that is short beside the mean step of the last while (the memory) may deviate
# more, so that a jump of the force is not chased.
COARSEST = 2e-2  # tolerances above this are taken as this
ANGLE = 0.1  # rad
FORCE = 0.1
MEMORY = 0.1  # s
FLEETING = 1e-7  # s; the force within a step no longer than this is not judged: it may jump
NOISE = 10.0  # of the contact force by rounding: less is no error of the step
DIP = 1e-3  # of a contact's margin; a smaller dip below zero within a step is none

DONE, STUCK, NOT_FINITE = 0, 1, 2


class HalfState(NamedTuple):
    """Everything that the next step of one half depends on."""

    time: Array  # [s], shape (1,)
    next_step: Array  # [s], shape (1,)
    force_scale: Array  # largest force so far, or what counts as one [N], shape (1,)
    crowding: Array  # number of steps within the memory, shape (1,)
    q: Array  # joint angles [rad], shape (n,)
    v: Array  # joint rates [rad/s], shape (n,)
    a: Array  # joint accelerations [rad/s^2], shape (n,)
    wrench: Array  # contact wrench on the tip [N, N, N m], shape (3,)
    modes: ContactModes
    margin: Array  # to the next event of each contact candidate (`_margins`), shape (k, 2)
    drift: Array  # its rate, shape (k, 2)
    load: Array  # vertical load on the base [N], shape (1,)
    work: Array  # by the base, in joints, to contacts, in friction [J], shape (4,)
    counts: NDArray[np.int64]  # steps, rejected, Newton iterations; shape (3,)


class TickWorkspace(NamedTuple):
    """Stage vectors."""

    q0: Array
    v0: Array
    q: Array
    v: Array
    a: Array
    v1: Array
    a1: Array
    load: Array  # vertical load on the base at both stages [N], shape (2,)
    power: Array  # rates of `HalfState.work` at both stages [W], shape (2, 4)
    twist: Array  # of the tip at the end [m/s, m/s, rad/s], shape (3,)
    modes: ContactModes  # at the inner stage
    margin: Array  # at both stages, shape (2, k, 2)
    passage: PassageWorkspace


def tick_workspace(n: int, points: int, candidates: int) -> TickWorkspace:
    """Allocate the stage vectors for `n` joints, points of the tip and contact candidates."""
    q0, v0, q, v, a, v1, a1 = np.zeros((7, n))
    return TickWorkspace(
        q0,
        v0,
        q,
        v,
        a,
        v1,
        a1,
        np.zeros(2),
        np.zeros((2, 4)),
        np.zeros(3),
        contact_modes(candidates),
        np.zeros((2, candidates, 2)),
        passage_workspace(n, points, candidates),
    )


@kernel
def restart_step(velocity: float) -> float:
    """First step after a jump or a touch at a base velocity [s]."""
    return min(RESTART, RESTART_TRAVEL / max(abs(velocity), 1e-12))


@kernel
def _margins(law: ContactLaw, contact: ContactWorkspace, margin: Array) -> None:
    """How far closed contacts are from opening [N] and from a change of friction, into (k, 2).

    A sticking contact starts to slide when the friction limit is used up [N], a sliding one
    sticks when its slip comes to rest [m/s].
    """
    for k in range(contact.slip.size):
        margin[k, 0] = contact.normal_force[k]
        mode = contact.modes.friction[k]
        if mode == STICK:
            margin[k, 1] = law.friction * contact.normal_force[k] - abs(contact.friction_force[k])
        else:
            margin[k, 1] = -mode * contact.slip[k] - law.slip_velocity


@kernel
def _same_modes(a: ContactModes, b: ContactModes, k: int) -> bool:
    """Whether contact `k` does the same in both."""
    return bool(a.normal[k] == b.normal[k] and a.friction[k] == b.friction[k])


@kernel
def time_to_event(
    h: float, state: HalfState, workspace: Workspace, scratch: TickWorkspace
) -> float:
    """Time from `state` to the first change of contact modes in the trial step [s], or inf."""
    first = np.inf
    before, after = state.modes, workspace.contact.modes
    for k in range(before.normal.size):
        was_open, is_open = before.normal[k] == OPEN, after.normal[k] == OPEN
        if was_open != is_open:
            event = 0
        elif not is_open and before.friction[k] != after.friction[k]:
            event = 1
        else:
            continue
        margin, drift = state.margin[k, event], state.drift[k, event]
        if not was_open and _same_modes(before, scratch.modes, k):
            drift = (scratch.margin[0, k, event] - margin) / (GAMMA * h)
        if margin > 0.0 and drift < 0.0:
            first = min(first, -margin / drift)
    return first


@kernel
def stage_power(model: Model, s: float, v: Array, workspace: Workspace, power: Array) -> None:
    """Rates of `HalfState.work` at the end of a stage [W], into `power`, shape (4,)."""
    contact, tip = workspace.contact, workspace.tip
    power[0] = -workspace.tip.root_force[0] * workspace.base[1]
    power[1] = 0.0
    for i in range(v.size):
        power[1] += model.chain.damping[i] * v[i] * v[i]
    power[2] = 0.0
    for j in range(3):
        power[2] -= contact.wrench[j] * (tip.twist[j] + s * contact.increment[j])
    power[3] = 0.0
    for k in range(contact.slip.size):
        power[3] -= contact.friction_force[k] * contact.slip[k]


@kernel
def are_finite(values: Array) -> bool:
    """Whether all values, shape (n,), are finite."""
    finite = True
    for i in range(values.size):
        finite &= np.isfinite(values[i])
    return finite


@kernel
def integrate(
    model: Model,
    motion: Motion,
    tolerance: float,
    state: HalfState,
    workspace: Workspace,
    scratch: TickWorkspace,
) -> int:
    """Step `state` to the end of `motion`.

    Returns DONE, STUCK or NOT_FINITE.  On a failure `state` is the last accepted one.
    """
    end = motion.time[-1]
    segments = motion.jump.size
    segment, jump = 0, 0
    while state.time[0] < end:
        t = state.time[0]
        while segment + 1 < segments and motion.time[segment + 1] <= t:
            segment += 1
        # A step ends where the velocity jumps.
        jump = max(jump, segment + 1)
        while jump < segments and not motion.jump[jump]:
            jump += 1
        stop = motion.time[jump]
        fresh = motion.jump[segment] and t == motion.time[segment]
        if fresh:
            base_motion(motion, segment, t, workspace.base)
            state.next_step[0] = min(state.next_step[0], restart_step(workspace.base[1]))
        h = min(state.next_step[0], stop - t)
        if stop - t - h < 0.1 * h:
            h = stop - t
        error, landed = 0.0, False
        while True:
            if h < SMALLEST_STEP and h < stop - t:
                return STUCK
            stretch = Stretch(motion, segment, t, h)
            error = _try_step(model, stretch, tolerance, fresh, state, workspace, scratch)
            if error <= 1.0:
                event = _hidden_event(model, stretch, tolerance, fresh, state, workspace, scratch)
                if event >= h:
                    break
                state.counts[1] += 1
                h, landed = event, True
                continue
            state.counts[1] += 1
            shorter = h * (max(SHRINK, SAFETY / np.sqrt(error)) if np.isfinite(error) else SHRINK)
            event = time_to_event(h, state, workspace, scratch)
            if event < FLEETING < h:
                h, landed = FLEETING, False
            elif not landed and 0.1 * shorter < LANDING * event < h:
                h, landed = LANDING * event, True
            else:
                h, landed = shorter, False
        if not are_finite(scratch.q):
            return NOT_FINITE
        state.time[0] = stop if h == stop - t else t + h
        growth = min(GROW, SAFETY / np.sqrt(max(error, 1e-12)))
        if landed:
            state.next_step[0] = min(h * growth, restart_step(workspace.base[1]))
        elif h * growth > state.next_step[0] or h < stop - t:
            state.next_step[0] = h * growth
        _accept(model, h, state, workspace, scratch)
    return DONE


@kernel
def _hidden_event(
    model: Model,
    stretch: Stretch,
    tolerance: float,
    fresh: bool,
    state: HalfState,
    workspace: Workspace,
    scratch: TickWorkspace,
) -> float:
    """Time into the trial step of the first event that neither stage shows [s], or infinity."""
    before, inside, after = state.modes, scratch.modes, workspace.contact.modes
    h = stretch.h
    first = first_hidden_touch(
        model,
        stretch,
        Passage(state.q, state.v, scratch.q, scratch.v),
        before,
        inside,
        after,
        min(tolerance, COARSEST) * state.force_scale[0] / model.law.stiffness,
        scratch.passage,
    )
    if fresh:  # margins before a jump say nothing about this step
        return first
    for k in range(before.normal.size):
        if before.normal[k] == OPEN:
            continue
        if not _same_modes(before, inside, k) or not _same_modes(before, after, k):
            continue
        for event in range(2):
            start = state.margin[k, event]
            middle, end = scratch.margin[0, k, event], scratch.margin[1, k, event]
            low = -DIP * max(start, middle, end)
            first = min(first, first_dip(h, GAMMA * h, start, middle, end, low))
    return first


@kernel
def crowding(state: HalfState, h: float) -> float:
    """Number of steps within the memory, the one of length `h` that follows `state` included."""
    return float(1.0 + state.crowding[0] * np.exp(-h / MEMORY))


@kernel
def _accept(
    model: Model, h: float, state: HalfState, workspace: Workspace, scratch: TickWorkspace
) -> None:
    """Take over the result of a trial step of length `h` as the state."""
    for i in range(state.q.size):
        state.q[i] = scratch.q[i]
        state.v[i] = scratch.v[i]
        state.a[i] = scratch.a[i]
    for j in range(3):
        state.wrench[j] = workspace.tip.wrench[j]
        # Of the tip, after the last Newton step.
        scratch.twist[j] = workspace.tip.twist[j] + workspace.contact.increment[j] / (GAMMA * h)
    copy_modes(workspace.contact.modes, state.modes)
    for k in range(state.modes.normal.size):
        for event in range(2):
            inner, outer = scratch.margin[0, k, event], scratch.margin[1, k, event]
            known = _same_modes(scratch.modes, state.modes, k)
            state.margin[k, event] = outer
            state.drift[k, event] = (outer - inner) / ((1.0 - GAMMA) * h) if known else 0.0
    measure_gaps(
        model.fingertip,
        model.obstacle,
        workspace.contact.pose,
        scratch.twist,
        state.modes,
        state.margin,
        state.drift,
    )
    for j in range(4):
        power = (1.0 - GAMMA) * scratch.power[0, j] + GAMMA * scratch.power[1, j]
        state.work[j] += h * power
    state.load[0] = scratch.load[1]
    state.force_scale[0] = max(state.force_scale[0], abs(state.load[0]))
    state.crowding[0] = crowding(state, h)
    state.counts[0] += 1


@kernel
def _try_step(
    model: Model,
    stretch: Stretch,
    tolerance: float,
    fresh: bool,
    state: HalfState,
    workspace: Workspace,
    scratch: TickWorkspace,
) -> float:
    """Take one trial step; return its error relative to the tolerance."""
    n, h = state.q.size, stretch.h
    s = 1.0 / (GAMMA * h)
    tolerance = min(tolerance, COARSEST)
    accuracy = 0.01 * tolerance * ANGLE
    for j in range(3):
        workspace.tip.wrench[j] = state.wrench[j]
    copy_modes(state.modes, workspace.contact.modes)
    for stage in range(2):
        if stage == 0:
            v, a = scratch.v1, scratch.a1
            for i in range(n):
                scratch.q0[i] = state.q[i]
                scratch.v0[i] = state.v[i]
                scratch.q[i] = state.q[i] + GAMMA * h * state.v[i]
            base_in_step(stretch, GAMMA, workspace.base)
        else:
            v, a = scratch.v, scratch.a
            copy_modes(workspace.contact.modes, scratch.modes)
            for i in range(n):
                scratch.q0[i] = state.q[i] + (1.0 - GAMMA) * h * scratch.v1[i]
                scratch.v0[i] = state.v[i] + (1.0 - GAMMA) * h * scratch.a1[i]
                scratch.q[i] = scratch.q0[i] + GAMMA * h * scratch.v1[i]
            base_in_step(stretch, 1.0, workspace.base)
        iterations = solve_stage(
            model, s, accuracy, scratch.q0, scratch.v0, scratch.q, v, a, workspace
        )
        if iterations == 0:
            return np.inf
        state.counts[2] += iterations
        scratch.load[stage] = workspace.tip.root_force[0]
        stage_power(model, s, v, workspace, scratch.power[stage])
        _margins(model.law, workspace.contact, scratch.margin[stage])
    # The velocity must neither change much within the step nor have jumped before it.
    inner, outer, angle = 0.0, 0.0, 0.0
    for i in range(n):
        inner += GAMMA * h * (scratch.v1[i] - state.v[i])
        outer += GAMMA * h * (scratch.v[i] - scratch.v1[i])
        angle = max(angle, abs(inner), abs(outer))
    inner_load, outer_load = scratch.load[0], scratch.load[1]
    scale = max(state.force_scale[0], abs(outer_load))
    error = angle / (ANGLE * tolerance * min(1.0, scale / model.bending))
    if not fresh and h > FLEETING:  # the force before a jump says nothing about this step
        defect = abs(inner_load - state.load[0] - GAMMA * (outer_load - state.load[0]))
        defect = max(0.0, defect - NOISE * workspace.contact.noise[0])
        weight = np.sqrt(h * crowding(state, h) / MEMORY)
        error = max(error, defect / (FORCE * tolerance * scale) * min(1.0, weight))
    return float(error)
