"""Simulation of a scene: owns the state and the solver's buffers."""

from __future__ import annotations

import copy
import math
import time as clock
import warnings
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.kernels.clearance import PARTS, part_gaps, place_segments
from hma_gripper_sim.kernels.dense_output import add_load, hermite
from hma_gripper_sim.kernels.error_propagation import clear_error
from hma_gripper_sim.kernels.integrator import (
    COARSEST,
    DONE,
    NOT_FINITE,
    STUCK,
    HalfState,
    integrate,
    tick_workspace,
)
from hma_gripper_sim.kernels.radau_integrator import (
    FULL,
    Record,
    integrate_radau,
    run_workspace,
)
from hma_gripper_sim.kernels.stage import Model, allocate
from hma_gripper_sim.mechanics.asked_accuracy import stepping_tolerance
from hma_gripper_sim.mechanics.outcome import (
    Outcome,
    SimulationError,
    SolverStats,
    ToleranceWarning,
)
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.start_pose import copy_state
from hma_gripper_sim.mechanics.states import HalfRecord, Snapshot
from hma_gripper_sim.motion.prescribed_motion import Velocity, evaluate, follow, ramp
from hma_gripper_sim.results.bending_moments import section_moments
from hma_gripper_sim.results.contact_warnings import PenetrationWarning, is_deep
from hma_gripper_sim.simulation.companion_runs import Companions
from hma_gripper_sim.simulation.state import SimulationState
from hma_gripper_sim.simulation.trace import Trace, beam_tangent, joint_rows
from hma_gripper_sim.units import quantity

Array = NDArray[np.float64]

TOLERANCE = 1e-3
REPEATS = 3  # of a run whose estimated error is beyond the tolerance
DOUBT = 0.5  # of the tolerance: estimated errors beyond may be beyond the tolerance in truth
AIM, TIGHTER, TIGHTEST = 0.25, 0.3, 0.03  # of the excess; how much lower the next tolerance is
LONG_RUN = 10_000  # steps: one that takes more is not repeated with yet smaller ones
FINEST = 1e-8  # tolerance that rounding lets through
ROWS = 256  # of the record of a run before it first grows
OUTCOMES = {
    DONE: Outcome.CONVERGED,
    STUCK: Outcome.STEP_TOO_SMALL,
    NOT_FINITE: Outcome.NOT_FINITE,
}


class HalfRun(NamedTuple):
    """One half after a run."""

    outcome: Outcome
    record: HalfRecord
    state: HalfState  # at the end
    error: float  # estimated, in the measure of the tolerance
    repeats: int  # runs before this one that were not accurate enough


class Half:
    """State and buffers of one half."""

    def __init__(self, model: Model, state: HalfState) -> None:
        self.model = model
        self.workspace = allocate(model)
        points, candidates = len(model.fingertip.points), len(self.workspace.contact.normal_force)
        self.tick_workspace = tick_workspace(model.chain.rest.size, points, candidates)
        self.run_workspace = run_workspace(model)
        self.state = state  # never changed in place: it may be anyone's snapshot

    def tick(self, motion: Motion, tolerance: float) -> Outcome:
        """Step to the end of `motion` from whatever state, as cheaply as a short motion allows."""
        state = copy_state(self.state)
        status = integrate(
            self.model, motion, tolerance, state, self.workspace, self.tick_workspace
        )
        self.state = state
        return OUTCOMES[status]

    def run(self, motion: Motion, tolerance: float) -> HalfRun:
        """Step to the end of `motion` and record it.

        Where errors grow by so much on the way that the run would exceed the tolerance, or where
        it ends early, it is repeated with a lower tolerance of its steps.
        """
        start, stepping = self.state, min(tolerance, COARSEST)
        run = self._run_once(motion, stepping, tolerance)
        for repeats in range(1, REPEATS + 1):
            done = run.outcome is Outcome.CONVERGED
            excess = run.error / tolerance if done else 1.0 / TIGHTER
            long = len(run.record.time) > LONG_RUN
            if (done and excess <= DOUBT) or stepping <= FINEST or long:
                break
            stepping = max(FINEST, stepping * max(TIGHTEST, min(TIGHTER, AIM / excess)))
            self.state = start
            again = self._run_once(motion, stepping, tolerance)
            if done and again.outcome is not Outcome.CONVERGED:
                break
            run = again._replace(repeats=repeats)
        self.state = run.state
        return run

    def _run_once(self, motion: Motion, tolerance: float, asked: float) -> HalfRun:
        state = copy_state(self.state)
        record = _empty_record(state)
        filled = 1
        scratch = self.run_workspace
        scratch.going[0] = 0.0
        clear_error(scratch.error, asked)
        while True:
            status, filled = integrate_radau(
                self.model, motion, tolerance, state, record, filled, self.workspace, scratch
            )
            if status != FULL:
                break
            record = Record(*(np.concatenate([part, np.empty_like(part)]) for part in record))
        force, angle = np.sqrt(scratch.error.square / (motion.time[-1] - motion.time[0]))
        error = float(max(force / state.force_scale[0], angle))
        rows = HalfRecord(*(part[:filled] for part in record))
        return HalfRun(OUTCOMES[status], rows, state, error, 0)


class Simulation:
    """A scene in motion, from static equilibrium at travel 0.

    Parameters
    ----------
    scene
        What is simulated.
    tolerance
        Root mean square error over a run: of the actuator force, relative to its largest
        magnitude in the run, and of the angles φ in radians.  The error is estimated along with
        a run, and a run that exceeds the tolerance is repeated with smaller steps; ``verify=True``
        checks it.  None: what the model's error leaves of the scene's accuracy, or 1e-3.  At
        least 1e-8; above 2e-2 it is taken as that.

    Raises
    ------
    InputError
        The tolerance is out of range.
    SimulationError
        There is no static equilibrium.
    """

    def __init__(self, scene: Scene, tolerance: float | None = None) -> None:
        if not isinstance(scene, Scene):
            raise InputError(f"expected a Scene, got {scene!r}", field="scene", source="Simulation")
        if tolerance is None:
            tolerance = (
                TOLERANCE
                if scene.accuracy is None
                else stepping_tolerance(scene.accuracy, scene.resolution.model_error)
            )
        self.tolerance = quantity(
            tolerance, "", field="tolerance", source="Simulation", minimum=FINEST, maximum=1.0
        )
        _load_machine_code()
        self._scene = scene
        self._halves = _build_halves(scene)
        self.time = self.travel = self.velocity = self._acceleration = 0.0

    @property
    def scene(self) -> Scene:
        """What is simulated."""
        return self._scene

    def reset(self) -> None:
        """Go back to the start: static equilibrium, travel 0, time 0, at rest."""
        self.time = self.travel = self.velocity = self._acceleration = 0.0
        for half, state in zip(self._halves, self._scene.start_states, strict=False):
            half.state = state

    def step(self, duration: float, velocity: float) -> None:
        """Advance by exactly `duration` [s] while the velocity goes linearly to `velocity` [m/s].

        Raises
        ------
        InputError
            An argument is not finite or the duration not positive; nothing changes.
        SimulationError
            The step could not be computed; the state is the one before the call.
        """
        duration = quantity(
            duration, "s", field="duration", source="step", minimum=0.0, exclusive=True
        )
        velocity = quantity(velocity, "m/s", field="velocity", source="step")
        before = self.snapshot()
        acceleration = (velocity - self.velocity) / duration
        jump = not math.isclose(acceleration, self._acceleration, rel_tol=1e-6, abs_tol=1e-6)
        motion = ramp(self.time, self.travel, duration, self.velocity, velocity, jump)
        for half in self._halves:
            outcome = half.tick(motion, self.tolerance)
            if outcome is not Outcome.CONVERGED:
                reached = float(half.state.time[0])
                self.restore(before)
                raise SimulationError(outcome, reached)
        self._arrive(motion)
        self.velocity = velocity  # without the rounding of the ramp

    def advance(
        self,
        duration: float,
        velocity: Velocity,
        sample_period: float = 0.001,
        breakpoints: Sequence[float] | None = None,
        *,
        verify: bool = False,
    ) -> Trace:
        """Advance by `duration` [s] at a velocity, which may be a function of time.

        The velocity is applied as it is, jumps included; `simulate` says in which forms it can
        be given, and what `breakpoints` are.  On a failure the trace ends where
        the solver did, its statistics name the outcome, a `RuntimeWarning` repeats it, and
        the simulation stays where it was before the call.

        Parameters
        ----------
        sample_period
            Of the trace [s].
        verify
            Estimate the error of this stretch, from its start on: `Trace.error_estimate`.  It
            takes up to five times as long on top.

        Raises
        ------
        InputError
            An argument cannot be used; nothing changes.
        """
        duration = quantity(
            duration, "s", field="duration", source="simulate", minimum=0.0, exclusive=True
        )
        sample_period = quantity(
            sample_period,
            "s",
            field="sample_period",
            source="simulate",
            minimum=0.0,
            exclusive=True,
        )
        motion = follow(velocity, self.time, self.travel, duration, breakpoints)
        companions = Companions(self, series=True) if verify else None
        trace = self.advance_along(motion, sample_period)
        if companions is not None:
            companions.advance_along(motion, trace)
            trace.error_estimate = companions.estimate()
        return trace

    def advance_along(self, motion: Motion, sample_period: float) -> Trace:
        """Advance along a motion that starts at the present time and travel, like `advance`.

        Parameters
        ----------
        sample_period
            Of the trace [s].
        """
        trace = self.solve_along(motion, sample_period)
        if not trace.stats.converged:
            error = SimulationError(trace.stats.outcome, float(trace.time[-1]))
            warnings.warn(str(error), RuntimeWarning, stacklevel=2)
        if trace.stats.converged and trace.stats.excess > 1.0:
            warnings.warn(ToleranceWarning(trace.stats.excess), stacklevel=2)
        for touch in trace.warnings:
            warnings.warn(touch, stacklevel=2)
        if is_deep(self._scene, trace.max_penetration):
            deep = PenetrationWarning(self._scene, trace.max_penetration, trace.penetration_time)
            warnings.warn(deep, stacklevel=2)
        return trace

    def solve_along(self, motion: Motion, sample_period: float) -> Trace:
        """Advance like `advance_along`, but give no warnings: the trace has it all."""
        before = self.snapshot()
        start = clock.perf_counter()
        counts = self._counts()
        runs = [half.run(motion, self.tolerance) for half in self._halves]
        failures = [run.outcome for run in runs if run.outcome is not Outcome.CONVERGED]
        steps, rejected, iterations = (
            now - then for now, then in zip(self._counts(), counts, strict=True)
        )
        stats = SolverStats(
            failures[-1] if failures else Outcome.CONVERGED,
            steps,
            rejected,
            iterations,
            max(run.repeats for run in runs),
            max(run.error for run in runs),
            self.tolerance,
            clock.perf_counter() - start,
        )
        trace = Trace(self._scene, motion, [run.record for run in runs], sample_period, stats)
        if stats.converged:
            self._arrive(motion)
        else:
            self.restore(before)
        return trace

    @property
    def at_start(self) -> bool:
        """Whether it stands at the start: nothing has happened yet."""
        starts = self._scene.start_states
        return self.time == 0.0 and all(
            half.state is start for half, start in zip(self._halves, starts, strict=False)
        )

    def twin(
        self,
        *,
        tolerance: float | None = None,
        move: tuple[float, float] = (0.0, 0.0),
        scene: Scene | None = None,
    ) -> Simulation:
        """Return another simulation at the same instant that goes on by itself.

        Parameters
        ----------
        tolerance
            None: the same.
        move
            Displacement (x, z) of its object, outwards in the frame of each half [m].
        scene
            Another scene, whose gripper then starts at its own start pose; None: the same.

        Raises
        ------
        SimulationError
            The other scene has no static equilibrium.
        """
        other = copy.copy(self)
        if tolerance is not None:
            other.tolerance = tolerance
        if scene is not None:
            other._scene = scene
            other._halves = _build_halves(scene, both=len(self._halves) == 2)
        else:
            other._halves = [Half(_moved(half.model, move), half.state) for half in self._halves]
        return other

    def state(self) -> SimulationState:
        """The present instant."""
        half = self._scene.half
        right, left = self._halves[0].state, self._halves[-1].state
        force = (
            right.load[0]
            + left.load[0]
            + half.middle_mass * (self._acceleration - self._scene.gravity)
        )
        position, velocity, effort = joint_rows(
            self._scene,
            np.array([self.travel, self.velocity, force]),
            (right.q, right.v),
            (left.q, left.v),
        )
        moments = section_moments(
            self._scene,
            np.stack([right.q, left.q]),
            np.stack([right.v, left.v]),
            np.stack([right.a, left.a]),
            np.stack([right.wrench, left.wrench]),
            np.full(2, self._acceleration),
        )
        moment_right, moment_left = np.abs(moments).max(axis=1).tolist()
        return SimulationState(
            time=self.time,
            travel=self.travel,
            velocity=self.velocity,
            actuator_force=float(force),
            phi_left=float(beam_tangent(half, left.q)),
            phi_right=float(beam_tangent(half, right.q)),
            phi_left_rate=float(left.v @ half.phi_weights),
            phi_right_rate=float(right.v @ half.phi_weights),
            joint_position=position,
            joint_velocity=velocity,
            joint_effort=effort,
            moment_left=moment_left,
            moment_right=moment_right,
        )

    def snapshot(self) -> Snapshot:
        """The complete state; its arrays are not to be changed."""
        halves = tuple(half.state for half in self._halves)
        return Snapshot(self.time, self.travel, self.velocity, self._acceleration, halves)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of this simulation; it continues bit for bit the same.

        Raises
        ------
        InputError
            The snapshot is of another gripper or of another number of halves.
        """
        if len(snapshot.halves) != len(self._halves) or any(
            a.q.shape != b.state.q.shape or a.modes.normal.shape != b.state.modes.normal.shape
            for a, b in zip(snapshot.halves, self._halves, strict=False)
        ):
            raise InputError("it was taken from another scene", field="snapshot", source="restore")
        self.time, self.travel = snapshot.time, snapshot.travel
        self.velocity, self._acceleration = snapshot.velocity, snapshot.acceleration
        for half, state in zip(self._halves, snapshot.halves, strict=True):
            half.state = state

    def change_scene(self, scene: Scene) -> None:
        """Put another object or another contact law under the same gripper, in its present pose.

        Raises
        ------
        InputError
            The gripper differs, or the object would overlap it; nothing changes.
        """
        if not isinstance(scene, Scene):
            raise InputError(
                f"expected a Scene, got {scene!r}", field="scene", source="change_scene"
            )
        old = self._scene
        same = scene.design == old.design and scene.resolution == old.resolution
        if not same:
            raise InputError("the gripper is another one", field="scene", source="change_scene")
        states = [half.state for half in self._halves]
        present = [states[0], states[-1]]
        moved = scene.contour != old.contour or scene.object_position != old.object_position
        overlap = deepest_overlap(scene, self.travel, present[0].q, present[1].q)
        if moved and overlap > 0.0:  # an object in place may be pressed upon
            raise InputError(
                f"would overlap the gripper by {1e3 * overlap:.3g} mm at travel "
                f"{1e3 * self.travel:.3g} mm",
                field="contour",
                source="change_scene",
            )
        alike = np.array_equal(present[0].q, present[1].q)
        halves = _build_halves(scene, both=not alike)
        for half, state in zip(halves, present, strict=False):
            half.state = half.state._replace(
                time=state.time,
                next_step=state.next_step,
                force_scale=state.force_scale,
                crowding=state.crowding,
                q=state.q,
                v=state.v,
                a=state.a,
                wrench=np.zeros(3),
                load=state.load - state.wrench[1],
                work=state.work,
                counts=state.counts,
            )
        self._scene = scene
        self._halves = halves

    def _counts(self) -> list[int]:
        """Steps, rejected steps and Newton iterations of all halves so far."""
        counts = (half.state.counts.tolist() for half in self._halves)
        return [sum(count) for count in zip(*counts, strict=True)]

    def _arrive(self, motion: Motion) -> None:
        self.time = float(motion.time[-1])
        self.travel = float(motion.travel[-1])
        _, velocity, acceleration = evaluate(motion, motion.time[-1])
        self.velocity, self._acceleration = float(velocity), float(acceleration)


def simulate(
    scene: Scene,
    velocity: Velocity,
    duration: float,
    tolerance: float | None = None,
    sample_period: float = 0.001,
    breakpoints: Sequence[float] | None = None,
    *,
    verify: bool = False,
) -> Trace:
    """Simulate a scene from static equilibrium at travel 0.

    Parameters
    ----------
    scene
        What is simulated.
    velocity
        Of the prismatic joint, positive towards the object; applied as it is, jumps included.
        A number [m/s]; segments of constant velocity, as pairs of a duration [s] and a velocity
        [m/s]; a `scipy.interpolate.PPoly` of time; or a function of time [s], which should do
        nothing that lasts shorter than 2 ms: it is called that often.
    duration
        [s]
    tolerance
        See `Simulation`.
    sample_period
        Of the trace [s].
    breakpoints
        Times [s] at which a velocity that is a function jumps or has a kink, all of them; its
        values there do not matter. None: they are looked for.
    verify
        Estimate the error of the run: `Trace.error_estimate`.  It takes up to five times as long
        on top.

    Raises
    ------
    InputError
        An argument cannot be used.
    SimulationError
        There is no static equilibrium.
    """
    simulation = Simulation(scene, tolerance)
    return simulation.advance(duration, velocity, sample_period, breakpoints, verify=verify)


def deepest_overlap(scene: Scene, travel: float, right: Array, left: Array) -> float:
    """How deep the object of a scene overlaps the gripper [m]; negative: the smallest gap.

    Parameters
    ----------
    right, left
        Joint angles of the halves, each in its own frame [rad], shape (n,).
    """
    half = scene.half
    placed = np.empty((len(half.segments.body), 4))
    gaps, places = np.empty(PARTS), np.empty((PARTS, 2))
    smallest = np.inf
    for model, q in zip(scene.models, (right, left), strict=True):
        place_segments(model.chain, -travel, q, half.segments, placed)
        part_gaps(half.segments, placed, model.obstacle, gaps, places)
        smallest = min(smallest, float(gaps.min()))
    return -smallest


def _build_halves(scene: Scene, both: bool = False) -> list[Half]:
    count = 2 if both or not scene.is_symmetric else 1
    return [
        Half(model, state)
        for model, state in zip(scene.models[:count], scene.start_states, strict=False)
    ]


@cache
def _load_machine_code() -> None:
    """Load, once per process, the kernels of a run beside those that step it.

    To load them takes longer than many a run, which would count as the first one's time.
    """
    follow(lambda t: abs(t - 0.03) if t < 0.07 else 0.0, 0.0, 0.0, 0.1)  # a kink and a jump
    add_load(np.zeros(1), np.arange(2.0), np.zeros((2, 3)), np.zeros(1))
    hermite(np.zeros(1), np.arange(2.0), *np.zeros((3, 2, 1)))


def _moved(model: Model, move: tuple[float, float]) -> Model:
    """The same half with its object displaced [m]."""
    if move == (0.0, 0.0):
        return model
    obstacle = model.obstacle
    return model._replace(
        obstacle=obstacle._replace(vertices=obstacle.vertices + move, centre=obstacle.centre + move)
    )


def _empty_record(state: HalfState) -> Record:
    """Allocate the record of a run; its first row is the state at the start."""
    n = len(state.q)
    record = Record(
        np.empty(ROWS),
        np.empty((ROWS, n)),
        np.empty((ROWS, n)),
        np.empty((ROWS, n)),
        np.empty((ROWS, 3)),
        np.empty((ROWS, 3)),
        np.empty((ROWS, 4)),
    )
    record.time[0] = state.time[0]
    record.q[0] = state.q
    record.v[0] = state.v
    record.a[0] = state.a
    record.wrench[0] = state.wrench
    record.load[0] = state.load[0]
    record.work[0] = state.work
    return record
