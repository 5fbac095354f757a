"""Time integration of one half by Radau IIA(5): whole runs.

Between events the motion is smooth and the contact modes are held; a step in which one of them
would change is repeated to end there.  Then, as after a jump of the commanded motion, a tiny
step of the implicit Euler method finds the modes that go on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.base_motion import Motion, Stretch, base_in_step
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact_law import copy_modes
from hma_gripper_sim.kernels.error_propagation import (
    ErrorWorkspace,
    delay_touches,
    error_workspace,
    propagate_error,
)
from hma_gripper_sim.kernels.hidden_events import (
    CLOSE,
    Passage,
    PassageWorkspace,
    first_hidden_touch,
    passage_workspace,
)
from hma_gripper_sim.kernels.integrator import (
    COARSEST,
    DONE,
    MEMORY,
    NOT_FINITE,
    STUCK,
    HalfState,
    are_finite,
    crowding,
)
from hma_gripper_sim.kernels.mode_search import find_modes
from hma_gripper_sim.kernels.radau import (
    RadauWorkspace,
    Stages,
    angle_error,
    guess_again,
    guess_first,
    guess_next,
    load_error,
    powers,
    radau_step,
    radau_workspace,
)
from hma_gripper_sim.kernels.radau_events import first_event, first_kink, stage_margins
from hma_gripper_sim.kernels.radau_method import NODES, QUADRATURE
from hma_gripper_sim.kernels.stage import Model, Workspace

Array = NDArray[np.float64]

FULL = -1  # the record needs more rows

SHORTEST_EULER = 1e-12  # s; of the step that finds modes
LONGEST_EULER = 1e-4  # s, for a tolerance of 1, falling with its fourth root; likewise, unless
CROWDED = 0.03  # of the error that may show in the angles of other steps allows for more
TRIES = 4  # of such steps, until the modes found are taken although a margin is negative
PAST = 5.0  # lengths by which an event may have been passed that this step takes: it must be
# able to stop what has moved on since then
SMALLEST_STEP = 1e-9  # s
RESTART = 1e-4  # s; first step after the first jump or event, and the least after others
SAFETY, SHRINK, GROW = 0.9, 0.2, 4.0
FAILED = 0.25  # shorter when the iteration does not converge
CALM = 1e-8  # of the error accepted: smaller ones are taken as this

# What the embedded estimates, of order 3, of a step may show at a tolerance of 1.  The result is
# of order 5 where nothing happens but of less beside events: over random scenes a run's error goes
# with the power 0.8 of what its steps show.  What is off in the angles can last, as where a contact
# sticks, and shifts the time at which it slips; what is off in the force is over with the step.
ESTIMATE, POWER = 6.0, 1.25
ANGLE, FORCE = 0.01, 2.5  # shares of that, in rad and relative to the largest force so far
ACCURACY = 1e-3  # of the iteration, relative to the tolerance
LANDING = 1e-3  # s per tolerance: how exactly an event is met
LATEST, EARLIEST = 2e-7, 1e-9  # s; bounds of that
LANDINGS = 8  # repeated steps to one event
TINY = 1e-300  # for a quotient
KINK = 1e-3  # of the step: how exactly a kink of the contact's geometry is met at least


class Record(NamedTuple):
    """Accepted steps; row 0 is the start."""

    time: Array  # shape (c,)
    q: Array  # shape (c, n)
    v: Array  # shape (c, n)
    a: Array  # shape (c, n)
    wrench: Array  # shape (c, 3)
    load: Array  # vertical load on the base at the stages, the last at the end, shape (c, 3)
    work: Array  # see `HalfState.work`, shape (c, 4)


class RunWorkspace(NamedTuple):
    """Buffers of the integrator beside those of a step."""

    step: RadauWorkspace
    # How far each contact is from a change of its normal and its friction mode, positive while
    # it keeps them: at the step's start and at the stages, shape (4, k, 2).
    margin: Array
    pose: Array  # of the tip at the step's start, and scratch, shape (2, 3)
    passage: PassageWorkspace
    error: ErrorWorkspace
    going: Array  # length of the last step [s], 0: start afresh; shape (1,)


class NextEvent(NamedTuple):
    """The first event within a step."""

    share: float  # of the step, or inf: there is none
    close: float  # a step is taken that ends up to that long after it [s]
    hidden: bool  # a touch that no stage shows
    changes_modes: bool


class Taken(NamedTuple):
    """A step that was taken."""

    h: float  # its length [s]; below the smallest: there is none
    growth: float  # by which the next one may be longer
    landings: int  # repetitions that led it to an event
    landed: bool  # one that changes modes is at its end


def run_workspace(model: Model) -> RunWorkspace:
    """Allocate the buffers for a model; a run starts afresh."""
    n = model.chain.rest.size
    step = radau_workspace(model)
    k = step.contacts.slip.shape[1]
    return RunWorkspace(
        step,
        np.zeros((4, k, 2)),
        np.zeros((2, 3)),
        passage_workspace(n, len(model.fingertip.points), k),
        error_workspace(n, k),
        np.zeros(1),
    )


@kernel
def _hidden_touch(
    model: Model, stretch: Stretch, tolerance: float, state: HalfState, scratch: RunWorkspace
) -> float:
    """Share of the step shortly behind the first touch that its stages conceal, or inf."""
    step, h = scratch.step, stretch.h
    stages, start, end = step.stages, step.v, step.a
    for j in range(state.q.size):  # slopes of the collocation polynomial
        a, b, c = powers(stages.z[0, j], stages.z[1, j], stages.z[2, j])
        start[j] = state.v[j] + a / h
        end[j] = state.v[j] + (a + 2.0 * b + 3.0 * c) / h
    touch = first_hidden_touch(
        model,
        stretch,
        Passage(state.q, start, stages.q[2], end),
        state.modes,
        state.modes,
        state.modes,
        tolerance * state.force_scale[0] / model.law.stiffness,
        scratch.passage,
    )
    return float(touch / h * (1.0 + 1.5 * CLOSE))


@kernel
def _add_work(model: Model, stretch: Stretch, work: Array, step: RadauWorkspace) -> None:
    """Integrate the rates of `HalfState.work` over a step into `workspace`, shape (4,)."""
    stages, found = step.stages, step.contacts
    for i in range(3):
        base_in_step(stretch, NODES[i], step.base)
        share = QUADRATURE[i] * stretch.h
        work[0] -= share * stages.load[i] * step.base[1]
        for j in range(stages.v.shape[1]):
            work[1] += share * model.chain.damping[j] * stages.v[i, j] * stages.v[i, j]
        for j in range(3):
            work[2] -= share * found.wrench[i, j] * found.found_twist[i, j]
        for k in range(found.slip.shape[1]):
            work[3] -= share * found.friction_force[i, k] * found.slip[i, k]


@kernel
def _write(state: HalfState, load: Array, record: Record, row: int) -> None:
    """Record an accepted step; `load` is that at its stages, shape (3,)."""
    record.time[row] = state.time[0]
    for i in range(state.q.size):
        record.q[row, i] = state.q[i]
        record.v[row, i] = state.v[i]
        record.a[row, i] = state.a[i]
    for j in range(3):
        record.wrench[row, j] = state.wrench[j]
        record.load[row, j] = load[j]
    for j in range(4):
        record.work[row, j] = state.work[j]


@kernel
def _estimate(tolerance: float) -> float:
    """What the embedded estimates of a step may show at a tolerance."""
    return float(ESTIMATE * tolerance**POWER)


@kernel
def _meeting(tolerance: float) -> float:
    """How exactly an event is met [s]."""
    return max(EARLIEST, min(LATEST, LANDING * tolerance))


@kernel
def _judge(
    model: Model, h: float, tolerance: float, state: HalfState, stages: Stages
) -> tuple[float, float]:
    """Error of a step relative to what is allowed, and the growth that it suggests."""
    estimate = _estimate(tolerance)
    scale = max(state.force_scale[0], abs(stages.load[2]))
    angle = angle_error(stages.z) / (ANGLE * estimate * min(1.0, scale / model.bending))
    defect = load_error(state.load[0], stages.load)
    load = defect / (FORCE * estimate * scale)
    # The mean square of the force counts, to which short steps add little.
    load *= min(1.0, np.sqrt(h * crowding(state, h) / MEMORY))
    growth = SAFETY * min(max(angle, CALM) ** -0.25, max(load, CALM) ** (-1.0 / 3.0))
    error = max(angle, load) if defect <= scale else np.inf  # no step is too short for that
    return error, max(SHRINK, min(GROW, growth))


@kernel
def _next_event(
    model: Model, stretch: Stretch, tolerance: float, state: HalfState, scratch: RunWorkspace
) -> NextEvent:
    """The first event within the step in ``scratch.step``, which is accurate enough."""
    contacts, h = scratch.step.contacts, stretch.h
    close = _meeting(tolerance)
    stage_margins(model.law, state.modes, contacts, scratch.margin)
    event = first_event(scratch.margin)
    kink = first_kink(model, state.modes, contacts.found_pose, scratch.pose)
    changes_modes = event < np.inf and event <= kink
    if kink < event:
        event, close = kink, max(close, KINK * h)
    if min(1.0, event) * h > close or event == np.inf:
        touch = _hidden_touch(model, stretch, tolerance, state, scratch)
        if touch < min(1.0, event):
            return NextEvent(touch, close, True, changes_modes)
    return NextEvent(event, close, False, changes_modes)


@kernel
def _take_step(
    model: Model,
    stretch: Stretch,
    first: bool,
    tolerance: float,
    state: HalfState,
    scratch: RunWorkspace,
) -> Taken:
    """Take a step that is accurate enough and in which no mode changes.

    `stretch` is the longest it may be, `first` says that it follows an event.  The result is in
    ``scratch.step``, `state` is that at its start.
    """
    step = scratch.step
    stages, contacts, modes = step.stages, step.contacts, state.modes
    longest, h = stretch.h, stretch.h
    if first:
        guess_first(h, state.a, state.wrench, modes, stages.z, contacts)
    else:
        guess_next(h / scratch.going[0], stages.z, contacts)
    landings, landed, growth = 0, False, GROW
    while h >= SMALLEST_STEP or h == longest:
        stretch = Stretch(stretch.motion, stretch.segment, stretch.t, h)
        iterations = radau_step(
            model,
            stretch,
            ACCURACY * tolerance,
            state.force_scale[0],
            state.q,
            state.v,
            modes,
            step,
        )
        state.counts[2] += iterations
        shorter = FAILED
        if iterations > 0:
            error, growth = _judge(model, h, tolerance, state, stages)
            shorter = min(growth, SAFETY)
            if error <= 1.0 or (landings > 0 and error < np.inf):
                event = _next_event(model, stretch, tolerance, state, scratch)
                landed = event.changes_modes
                if event.share == np.inf:
                    break
                landings += 1
                if landings > LANDINGS or (
                    not event.hidden and (1.0 - event.share) * h <= event.close
                ):
                    break
                shorter = event.share
                if not event.hidden:
                    shorter += min(0.5 * event.close / h, 0.5 * (1.0 - event.share))
        state.counts[1] += 1
        h *= shorter
        if iterations > 0:
            guess_again(shorter, stages.z, contacts)
        else:
            guess_first(h, state.a, state.wrench, modes, stages.z, contacts)
    return Taken(h, growth, landings, landed)


@kernel
def _accept(model: Model, stretch: Stretch, state: HalfState, scratch: RunWorkspace) -> None:
    """Take over the step in ``scratch.step`` as the state, but for its clock."""
    step, margin = scratch.step, scratch.margin
    stages, contacts, modes = step.stages, step.contacts, state.modes
    propagate_error(model, stretch, state.load[0], state.force_scale[0], modes, step, scratch.error)
    _add_work(model, stretch, state.work, step)
    for i in range(state.q.size):
        state.q[i] = stages.q[2, i]
        state.v[i] = stages.v[2, i]
        state.a[i] = stages.a[2, i]
    for j in range(3):
        state.wrench[j] = contacts.wrench[2, j]
        scratch.pose[0, j] = contacts.found_pose[2, j]
    for k in range(modes.normal.size):
        modes.stick_force[k] = contacts.friction_force[2, k]
        margin[0, k, 0] = margin[3, k, 0]
        margin[0, k, 1] = margin[3, k, 1]
    state.load[0] = stages.load[2]
    state.force_scale[0] = max(state.force_scale[0], abs(state.load[0]))


@kernel
def _is_due(margin: Array) -> bool:
    """Whether a contact is beyond a change of its modes; `margin` has shape (k, 2)."""
    due = False
    for k in range(margin.shape[0]):
        due |= margin[k, 0] < 0.0 or margin[k, 1] < 0.0
    return due


@kernel
def _leave_margins(margin: Array, state: HalfState) -> None:
    """Leave the margins for a tick that goes on from here: it knows no rates of change."""
    for k in range(margin.shape[0]):
        for event in range(2):
            found = margin[k, event]
            state.margin[k, event] = found if np.isfinite(found) else 0.0
            state.drift[k, event] = 0.0


@kernel
def integrate_radau(
    model: Model,
    motion: Motion,
    tolerance: float,
    state: HalfState,
    record: Record,
    filled: int,
    workspace: Workspace,
    scratch: RunWorkspace,
) -> tuple[int, int]:
    """Step `state` to the end of `motion`; record accepted steps from row `filled` on.

    Returns DONE, FULL, STUCK or NOT_FINITE, and the number of rows filled.  On a failure `state`
    is the last accepted one.  ``scratch.going`` is 0 at the start of a run.
    """
    step, margin, error = scratch.step, scratch.margin, scratch.error
    stages, modes = step.stages, state.modes
    end, segments = motion.time[-1], motion.jump.size
    tolerance = min(tolerance, COARSEST)
    shortly, tries = PAST * _meeting(tolerance), 0
    brief = longest = max(shortly, LONGEST_EULER * tolerance**0.25)
    segment, jump, euler, restart, last = 0, 0, shortly, RESTART, state.time[0]
    first = scratch.going[0] == 0.0
    fresh = first
    while segment + 1 < segments and motion.time[segment + 1] <= state.time[0]:
        segment += 1
    while state.time[0] < end:
        t = state.time[0]
        while segment + 1 < segments and motion.time[segment + 1] <= t:
            segment += 1
            if motion.jump[segment]:
                fresh, euler = True, shortly
        # A step ends where the velocity jumps.
        jump = max(jump, segment + 1)
        while jump < segments and not motion.jump[jump]:
            jump += 1
        stop = motion.time[jump]
        if filled >= record.time.size:
            return FULL, filled
        if fresh:
            h = min(euler, stop - t)
            if tries == 0:
                copy_modes(modes, error.modes)
            share = min(1.0, state.force_scale[0] / model.bending)
            bound = CROWDED * ANGLE * _estimate(tolerance) * share
            allowed = 4.0 * bound if h > brief else np.inf
            stretch = Stretch(motion, segment, t, h)
            off = find_modes(model, stretch, allowed, state, workspace, step, error, margin[0])
            if off == np.inf:
                euler *= FAILED
                if euler < SHORTEST_EULER:
                    return STUCK, filled
                continue
            longest = max(brief, min(4.0 * h, h * np.sqrt(bound / max(off, TINY))))
            if off > allowed:
                euler = longest
                state.counts[1] += 1
                continue
            for j in range(3):
                scratch.pose[0, j] = step.tip.pose[j]
                stages.load[j] = state.load[0]
            state.time[0] = stop if h == stop - t else t + h
            state.next_step[0] = min(state.next_step[0], restart)
            state.force_scale[0] = max(state.force_scale[0], abs(state.load[0]))
            first, tries = True, tries + 1
            fresh = _is_due(margin[0]) and tries < TRIES
            if fresh:
                euler = min(2.0 * euler, longest)
            else:
                for j in range(3):
                    step.base[j] = workspace.base[j]
                delay_touches(model, state.v, state.q, state.a, modes, t - last, step, error)
                last = t
        else:
            h = min(state.next_step[0], stop - t)
            if stop - t - h < 0.1 * h:
                h = stop - t
            stretch = Stretch(motion, segment, t, h)
            taken = _take_step(model, stretch, first, tolerance, state, scratch)
            h = taken.h
            if h < SMALLEST_STEP and h < stop - t:  # the modes cannot be held any longer
                fresh, euler = True, min(2.0 * euler, longest)
                continue
            if not are_finite(stages.q[2]):
                return NOT_FINITE, filled
            _accept(model, Stretch(motion, segment, t, h), state, scratch)
            state.time[0] = stop if h == stop - t else t + h
            further = h * taken.growth
            if further > state.next_step[0] or (h < stop - t and taken.landings == 0):
                state.next_step[0] = further
            if first:  # after the next event as after this one
                restart = max(RESTART, further)
            state.crowding[0] = crowding(state, h)
            scratch.going[0] = h
            fresh, first, tries = taken.landed, False, 0
            # Where events crowd they are passed by longer steps.
            euler = min(2.0 * euler, longest) if h < 2.0 * euler else shortly
        state.counts[0] += 1
        _write(state, stages.load, record, filled)
        filled += 1
    _leave_margins(margin[0], state)
    return DONE, filled
