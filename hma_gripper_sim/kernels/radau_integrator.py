"""Time integration of one half by Radau IIA(5): whole runs.

Between events the motion is smooth and the contact modes are held; a step in which one of them
would change is repeated to end there.  Then, as after a jump of the commanded motion, a tiny
step of the implicit Euler method finds the modes that go on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.accelerations import solve_accelerations
from hma_gripper_sim.kernels.base_motion import Motion, base_motion
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.contact import (
    CLOSED,
    GRAZING,
    OPEN,
    STICK,
    ContactLaw,
    ContactModes,
    closing_margin,
    copy_modes,
    touched_part,
)
from hma_gripper_sim.kernels.error_propagation import (
    ErrorWork,
    delay_touches,
    error_work,
    propagate_error,
)
from hma_gripper_sim.kernels.hidden_events import (
    CLOSE,
    PassageWork,
    first_hidden_touch,
    passage_work,
)
from hma_gripper_sim.kernels.integrator import (
    COARSEST,
    DONE,
    MEMORY,
    NOT_FINITE,
    STUCK,
    HalfState,
    crowding,
    stage_power,
)
from hma_gripper_sim.kernels.radau import (
    RadauWork,
    angle_error,
    guess_again,
    guess_first,
    guess_next,
    load_error,
    powers,
    radau_step,
    radau_work,
)
from hma_gripper_sim.kernels.radau_method import NODES, QUADRATURE
from hma_gripper_sim.kernels.stage import Model, Work, solve_stage

Array = NDArray[np.float64]

FULL = -1  # the record needs more rows

SHORTEST_EULER = 1e-12  # s; of the step that finds modes
LONGEST_EULER = 1e-4  # s, for a tolerance of 1, falling with its fourth root; likewise, unless
CROWDED = 0.03  # of the error that may show in the angles of other steps allows for more
TRIES = 4  # of such steps, until the modes found are taken although a margin is negative
ROUNDING = 1e-12  # of a margin
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
KINK_HALVINGS = 40


class Record(NamedTuple):
    """Accepted steps; row 0 is the start."""

    time: Array  # shape (c,)
    q: Array  # shape (c, n)
    v: Array  # shape (c, n)
    a: Array  # shape (c, n)
    wrench: Array  # shape (c, 3)
    load: Array  # vertical load on the base at the stages, the last at the end, shape (c, 3)
    work: Array  # see `HalfState.work`, shape (c, 4)


class RadauScratch(NamedTuple):
    """Buffers of the integrator beside those of a step."""

    step: RadauWork
    q: Array
    v: Array
    a: Array
    # How far each contact is from a change of its normal and its friction mode, positive while
    # it keeps them: at the step's start and at the stages, shape (4, k, 2).
    margin: Array
    pose: Array  # of the tip at the step's start, and scratch, shape (2, 3)
    passage: PassageWork
    power: Array  # rates of `HalfState.work` [W], shape (4,)
    error: ErrorWork
    going: Array  # length of the last step [s], 0: start afresh; shape (1,)


def radau_scratch(model: Model) -> RadauScratch:
    """Allocate the buffers for a model; a run starts afresh."""
    q, v, a = np.zeros((3, model.chain.rest.size))
    step = radau_work(model)
    k = step.contacts.slip.shape[1]
    return RadauScratch(
        step,
        q,
        v,
        a,
        np.zeros((4, k, 2)),
        np.zeros((2, 3)),
        passage_work(q.size, len(model.fingertip.points), k),
        np.zeros(4),
        error_work(q.size, k),
        np.zeros(1),
    )


@kernel
def _event_margins(
    law: ContactLaw,
    modes: ContactModes,
    k: int,
    normal: float,
    friction: float,
    slip: float,
    apart: float,
    margin: Array,
) -> None:
    """How far contact `k` is from a change of its modes, into `margin`, shape (2,).

    An open contact closes when it overlaps and would push [m]; a closed one opens when it no
    longer pushes [N] or overlaps, and a grazing one may not leave its layer [m]; a stick slips
    beyond the friction limit [N], a slip ends at rest [m/s].
    """
    margin[1] = np.inf
    if modes.normal[k] == OPEN:
        margin[0] = apart
        return
    if modes.normal[k] == GRAZING:
        margin[0] = min(-apart, apart + law.graze)
    else:
        margin[0] = min(normal, -law.stiffness * apart)
    if law.friction == 0.0:
        return
    mode = modes.friction[k]
    if mode == STICK:
        margin[1] = law.friction * normal - abs(friction)
    else:
        margin[1] = -mode * slip - law.slip_velocity


@kernel
def _first_zero(f: float, f0: float, f1: float, f2: float) -> float:
    """Share of the step at which an event function, positive at its start, first vanishes; or inf.

    On the cubic through its values at the start, `f`, and at the stages.
    """
    a, b, c = powers(f0 - f, f1 - f, f2 - f)
    # It first vanishes on one of the stretches between its turning points.
    first, second = 1.0, 1.0
    square = b * b - 3.0 * a * c
    if square > 0.0:
        q = -(b + np.copysign(np.sqrt(square), b))
        one = q / (3.0 * c) if c != 0.0 else 1.0
        two = a / q if q != 0.0 else 1.0
        first = min(one, two) if min(one, two) > 0.0 else 1.0
        second = max(one, two) if max(one, two) > 0.0 else 1.0
    low = 0.0
    for high in (min(first, 1.0), min(second, 1.0), 1.0):
        if f + high * (a + high * (b + high * c)) < 0.0:
            while high - low > 1e-15:
                middle = 0.5 * (low + high)
                if middle in (low, high):
                    break
                if f + middle * (a + middle * (b + middle * c)) < 0.0:
                    high = middle
                else:
                    low = middle
            return float(high)
        low = high
    return np.inf


@kernel
def _first_event(margin: Array) -> float:
    """Share of the step at which the first contact would change its modes, or inf."""
    first = np.inf
    for k in range(margin.shape[1]):
        for event in range(2):
            f = margin[0, k, event]
            if np.isfinite(f):
                f0, f1, f2 = margin[1, k, event], margin[2, k, event], margin[3, k, event]
                # Contacts that share a force may be beyond their own margins: then what counts
                # is whether they go further.
                low = min(0.0, f) - ROUNDING * max(abs(f), abs(f0), abs(f1), abs(f2))
                first = min(first, _first_zero(f - low, f0 - low, f1 - low, f2 - low))
    return first


@kernel
def _part_at(model: Model, theta: float, k: int, stage_pose: Array, pose: Array) -> int:
    """What contact `k` meets at a share `theta` of a step (`touched_part`).

    `stage_pose`, shape (3, 3), is that of the tip at the stages; `pose`, shape (2, 3), holds the
    one at the start, and a scratch row.
    """
    for j in range(3):
        f = pose[0, j]
        a, b, c = powers(stage_pose[0, j] - f, stage_pose[1, j] - f, stage_pose[2, j] - f)
        pose[1, j] = f + theta * (a + theta * (b + theta * c))
    part: int = touched_part(model.fingertip, model.obstacle, pose[1], k)
    return part


@kernel
def _first_kink(model: Model, modes: ContactModes, stage_pose: Array, pose: Array) -> float:
    """Share of the step at which a contact first meets another part of the object, or inf."""
    first = np.inf
    for k in range(modes.normal.size):
        if modes.normal[k] == OPEN:
            continue
        part = _part_at(model, 0.0, k, stage_pose, pose)
        low, high = 0.0, np.inf
        for i in range(3):
            if high == np.inf:
                if _part_at(model, NODES[i], k, stage_pose, pose) == part:
                    low = NODES[i]
                else:
                    high = NODES[i]
        if high < np.inf:
            for _ in range(KINK_HALVINGS):
                middle = 0.5 * (low + high)
                if _part_at(model, middle, k, stage_pose, pose) == part:
                    low = middle
                else:
                    high = middle
        first = min(first, high)
    return first


@kernel
def _hidden_touch(
    model: Model,
    motion: Motion,
    segment: int,
    t: float,
    h: float,
    tolerance: float,
    state: HalfState,
    scratch: RadauScratch,
) -> float:
    """Share of the step shortly behind the first touch that its stages conceal, or inf."""
    stages, start, end = scratch.step.stages, scratch.v, scratch.a
    for j in range(state.q.size):  # slopes of the collocation polynomial
        a, b, c = powers(stages.z[0, j], stages.z[1, j], stages.z[2, j])
        start[j] = state.v[j] + a / h
        end[j] = state.v[j] + (a + 2.0 * b + 3.0 * c) / h
    touch = first_hidden_touch(
        model.chain,
        model.fingertip,
        model.obstacle,
        motion,
        segment,
        t,
        h,
        state.q,
        start,
        stages.q[2],
        end,
        state.modes,
        state.modes,
        state.modes,
        tolerance * state.clock[2] / model.law.stiffness,
        scratch.passage,
    )
    return float(touch / h * (1.0 + 1.5 * CLOSE))


@kernel
def _find_modes(
    model: Model,
    motion: Motion,
    segment: int,
    duration: float,
    state: HalfState,
    allowed: float,
    work: Work,
    scratch: RadauScratch,
) -> float:
    """Take an implicit Euler step that finds the contact modes, and forces that go with them.

    Returns what it is off in the angle of a body [rad], which is also added to the error that is
    carried along, or inf when there was no convergence.  A step that is off by more than `allowed`
    is not taken.
    """
    s, t = 1.0 / duration, state.clock[0] + duration
    contact = work.contact
    base_motion(motion, segment, t, work.base)
    for j in range(3):
        work.tip.wrench[j] = state.wrench[j]
    for i in range(state.q.size):
        scratch.q[i] = state.q[i] + duration * state.v[i]
    copy_modes(state.modes, contact.modes)
    if not solve_stage(model, s, 1e-12, state.q, state.v, scratch.q, scratch.v, scratch.a, work):
        return np.inf
    turn, largest = 0.0, 0.0
    for i in range(state.q.size):
        turn += scratch.v[i] - state.v[i]
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
    stage_power(model, s, scratch.v, work, scratch.power)
    step = scratch.step
    tip, found = step.tip, step.contacts.work
    if not solve_accelerations(
        model,
        work.base,
        scratch.q,
        scratch.v,
        modes,
        scratch.a,
        step.chain,
        tip,
        step.tangent.real,
        step.tangent.real_side,
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
        _event_margins(
            model.law,
            modes,
            k,
            found.normal_force[k],
            found.friction_force[k],
            found.slip[k],
            apart,
            scratch.margin[0, k],
        )
    copy_modes(modes, state.modes)
    for i in range(state.q.size):
        scratch.error.angle[i] -= 0.5 * duration * (scratch.v[i] - state.v[i])
        state.q[i] = scratch.q[i]
        state.v[i] = scratch.v[i]
        state.a[i] = scratch.a[i]
    for j in range(3):
        state.wrench[j] = found.wrench[j]
        scratch.pose[0, j] = tip.pose[j]
    for j in range(4):
        state.work[j] += duration * scratch.power[j]
    state.load[0] = tip.root_force[0]
    return off


@kernel
def _stage_margins(law: ContactLaw, modes: ContactModes, scratch: RadauScratch) -> None:
    """Event functions of the stages of a step."""
    found = scratch.step.contacts
    for i in range(3):
        for k in range(modes.normal.size):
            _event_margins(
                law,
                modes,
                k,
                found.normal_force[i, k],
                found.friction_force[i, k],
                found.slip[i, k],
                found.apart[i, k],
                scratch.margin[1 + i, k],
            )


@kernel
def _add_work(
    model: Model, motion: Motion, segment: int, t: float, h: float, work: Array, step: RadauWork
) -> None:
    """Integrate the rates of `HalfState.work` over a step into `work`, shape (4,)."""
    stages, found = step.stages, step.contacts
    for i in range(3):
        base_motion(motion, segment, t + NODES[i] * h, step.base)
        share = QUADRATURE[i] * h
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
    record.time[row] = state.clock[0]
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
def integrate_radau(
    model: Model,
    motion: Motion,
    tolerance: float,
    state: HalfState,
    record: Record,
    filled: int,
    work: Work,
    scratch: RadauScratch,
) -> tuple[int, int]:
    """Step `state` to the end of `motion`; record accepted steps from row `filled` on.

    Returns DONE, FULL, STUCK or NOT_FINITE, and the number of rows filled.  On a failure `state`
    is the last accepted one.  ``scratch.going`` is 0 at the start of a run.
    """
    step, margin = scratch.step, scratch.margin
    stages, contacts = step.stages, step.contacts
    modes, clock = state.modes, state.clock
    n, count = state.q.size, state.modes.normal.size
    end, segments = motion.time[-1], motion.jump.size
    tolerance = min(tolerance, COARSEST)
    estimate = ESTIMATE * tolerance**POWER
    met = max(EARLIEST, min(LATEST, LANDING * tolerance))
    shortly, tries = PAST * met, 0
    brief = longest = max(shortly, LONGEST_EULER * tolerance**0.25)
    segment, jump, euler, restart, last = 0, 0, shortly, RESTART, clock[0]
    first = scratch.going[0] == 0.0
    fresh = first
    while segment + 1 < segments and motion.time[segment + 1] <= clock[0]:
        segment += 1
    while clock[0] < end:
        t = clock[0]
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
            duration = min(euler, stop - t)
            if tries == 0:
                copy_modes(modes, scratch.error.modes)
            bound = CROWDED * ANGLE * estimate * min(1.0, clock[2] / model.bending)
            allowed = 4.0 * bound if duration > brief else np.inf
            off = _find_modes(model, motion, segment, duration, state, allowed, work, scratch)
            if off == np.inf:
                euler *= FAILED
                if euler < SHORTEST_EULER:
                    return STUCK, filled
                continue
            reach = duration * np.sqrt(bound / max(off, TINY))
            longest = max(brief, min(4.0 * duration, reach))
            if off > allowed:
                euler = longest
                state.counts[1] += 1
                continue
            clock[0] = stop if duration == stop - t else t + duration
            clock[1] = min(clock[1], restart)
            clock[2] = max(clock[2], abs(state.load[0]))
            for i in range(3):
                stages.load[i] = state.load[0]
            state.counts[0] += 1
            _write(state, stages.load, record, filled)
            filled += 1
            fresh, first, tries = False, True, tries + 1
            for k in range(count):
                fresh |= margin[0, k, 0] < 0.0 or margin[0, k, 1] < 0.0
            fresh &= tries < TRIES
            if fresh:
                euler = min(2.0 * euler, longest)
            else:
                for j in range(3):
                    step.base[j] = work.base[j]
                delay_touches(
                    model, state.v, state.q, state.a, modes, t - last, step, scratch.error
                )
                last = t
            continue
        h = min(clock[1], stop - t)
        if stop - t - h < 0.1 * h:
            h = stop - t
        if first:
            guess_first(h, state.a, state.wrench, modes, stages.z, contacts)
        else:
            guess_next(h / scratch.going[0], stages.z, contacts)
        landings, landed, growth = 0, False, GROW
        while True:
            iterations = radau_step(
                model,
                motion,
                segment,
                t,
                h,
                ACCURACY * tolerance,
                clock[2],
                state.q,
                state.v,
                modes,
                step,
            )
            state.counts[2] += iterations
            shorter = FAILED
            if iterations > 0:
                scale = max(clock[2], abs(stages.load[2]))
                angle = angle_error(stages.z) / (ANGLE * estimate * min(1.0, scale / model.bending))
                load = load_error(state.load[0], stages.load) / (FORCE * estimate * scale)
                # The mean square of the force counts, to which short steps add little.
                load *= min(1.0, np.sqrt(h * crowding(state, h) / MEMORY))
                growth = SAFETY * min(max(angle, CALM) ** -0.25, max(load, CALM) ** (-1.0 / 3.0))
                growth = max(SHRINK, min(GROW, growth))
                shorter = min(growth, SAFETY)
                if landings > 0 or max(angle, load) <= 1.0:
                    _stage_margins(model.law, modes, scratch)
                    event = _first_event(margin)
                    kink = _first_kink(model, modes, contacts.found_pose, scratch.pose)
                    close = met
                    landed = event < np.inf and event <= kink
                    if kink < event:
                        event, close = kink, max(met, KINK * h)
                    hidden = np.inf
                    if min(1.0, event) * h > close or event == np.inf:
                        hidden = _hidden_touch(
                            model, motion, segment, t, h, tolerance, state, scratch
                        )
                    if hidden < min(1.0, event):
                        landings += 1
                        event = hidden
                        if landings <= LANDINGS:
                            state.counts[1] += 1
                            h *= hidden
                            guess_again(hidden, stages.z, contacts)
                            continue
                    if event == np.inf:
                        break
                    landings += 1
                    if (1.0 - event) * h <= close or landings > LANDINGS:
                        break
                    shorter = event + min(0.5 * close / h, 0.5 * (1.0 - event))
            state.counts[1] += 1
            h *= shorter
            if h < SMALLEST_STEP:
                break
            if iterations > 0:
                guess_again(shorter, stages.z, contacts)
            else:
                guess_first(h, state.a, state.wrench, modes, stages.z, contacts)
        if h < SMALLEST_STEP and h < stop - t:  # the modes cannot be held any longer
            fresh, euler = True, min(2.0 * euler, longest)
            continue
        for i in range(n):
            if not np.isfinite(stages.q[2, i]):
                return NOT_FINITE, filled
        propagate_error(
            model, motion, segment, t, h, state.load[0], clock[2], modes, step, scratch.error
        )
        _add_work(model, motion, segment, t, h, state.work, step)
        for i in range(n):
            state.q[i] = stages.q[2, i]
            state.v[i] = stages.v[2, i]
            state.a[i] = stages.a[2, i]
        for j in range(3):
            state.wrench[j] = contacts.wrench[2, j]
            scratch.pose[0, j] = contacts.found_pose[2, j]
        for k in range(count):
            modes.stick_force[k] = contacts.friction_force[2, k]
            margin[0, k, 0] = margin[3, k, 0]
            margin[0, k, 1] = margin[3, k, 1]
        state.load[0] = stages.load[2]
        clock[0] = stop if h == stop - t else t + h
        clock[2] = max(clock[2], abs(state.load[0]))
        if h * growth > clock[1] or (h < stop - t and landings == 0):
            clock[1] = h * growth
        if first:  # after the next event as after this one
            restart = max(RESTART, h * growth)
        clock[3] = crowding(state, h)
        state.counts[0] += 1
        _write(state, stages.load, record, filled)
        filled += 1
        scratch.going[0] = h
        fresh, first, tries = landed, False, 0
        # Where events crowd they are passed by longer steps.
        euler = min(2.0 * euler, longest) if h < 2.0 * euler else shortly
    for k in range(count):  # a tick that goes on from here knows no rates of change
        for event in range(2):
            state.margin[k, event] = (
                margin[0, k, event] if np.isfinite(margin[0, k, event]) else 0.0
            )
            state.drift[k, event] = 0.0
    return DONE, filled
