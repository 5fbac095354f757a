"""Recorded results of a simulation, sampled at a fixed period, with their units."""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.kernels.clearance import Recorded
from hma_gripper_sim.kernels.dense_output import add_load, hermite
from hma_gripper_sim.kernels.penetration import deepest_penetration
from hma_gripper_sim.mechanics.body_motion import body_motion
from hma_gripper_sim.mechanics.half_gripper import HalfGripper
from hma_gripper_sim.mechanics.outcome import SolverStats
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.states import HalfRecord
from hma_gripper_sim.model.joint_names import SIDES
from hma_gripper_sim.motion.prescribed_motion import evaluate
from hma_gripper_sim.results.bending_moments import joints_at_sections, section_moments
from hma_gripper_sim.results.contact_warnings import UnmodelledContactWarning
from hma_gripper_sim.results.energy_balance import EnergyBalance, energy_balance
from hma_gripper_sim.results.error_estimate import ErrorEstimate
from hma_gripper_sim.results.observation import Observed, tips_around_object
from hma_gripper_sim.results.unmodelled_contacts import find_unmodelled_touches
from hma_gripper_sim.results.validity import Finding, findings
from hma_gripper_sim.simulation.state import SimulationState
from hma_gripper_sim.units import choice

Array = NDArray[np.float64]
Rows = tuple[Array, Array]

FAR_TURN, FAR_WAY = 0.05, 2e-3
"""How far bodies may turn [rad] and the base move [m] between two states searched for touches."""

ROUND_OFF = 1e-6
"""How far the last sample may lie beyond the end because of rounding, in sample periods."""


class Trace:
    """Results of a run, at multiples of the sample period.

    Forces come from the solver's own stages, angles and rates from cubic Hermite interpolation
    between its steps, bending moments from monotone cubics; joint arrays are computed when they
    are first asked for.

    Attributes
    ----------
    scene
        What was simulated.
    stats
        What it cost and how it ended.
    error_estimate
        Of a run that was verified; otherwise None.
    sample_period
        [s]
    time
        [s], shape (n_samples,)
    """

    error_estimate: ErrorEstimate | None = None

    def __init__(
        self,
        scene: Scene,
        motion: Motion,
        records: list[HalfRecord],
        sample_period: float,
        stats: SolverStats,
    ) -> None:
        self.scene = scene
        self.stats = stats
        self.sample_period = sample_period
        self._motion = motion
        self._records = records
        self._right, self._left = records[0], records[-1]
        start, end = motion.time[0], min(record.time[-1] for record in records)
        count = math.floor((end - start) / sample_period + ROUND_OFF) + 1
        self.time: Array = start + sample_period * np.arange(count)

    @cached_property
    def _base(self) -> tuple[Array, Array, Array]:
        """Travel, velocity and acceleration at the samples."""
        return evaluate(self._motion, self.time)

    @property
    def travel(self) -> Array:
        """Of the prismatic joint, positive towards the object [m], shape (n_samples,)."""
        return self._base[0]

    @property
    def velocity(self) -> Array:
        """Of the prismatic joint, positive towards the object [m/s], shape (n_samples,)."""
        return self._base[1]

    @cached_property
    def actuator_force(self) -> Array:
        """Positive when the actuator pushes towards the object [N], shape (n_samples,)."""
        half, motion = self.scene.half, self._motion
        force = np.full(len(self.time), -half.middle_mass * self.scene.gravity)
        if motion.velocity.shape[1] > 1:  # else its acceleration is 0
            force += half.middle_mass * self._base[2]
        for record in (self._right, self._left):
            add_load(self.time, record.time, record.load, force)
        return force

    @cached_property
    def phi_right(self) -> Array:
        """Angle between top beam and right side beam at mid-length [rad], shape (n_samples,)."""
        return self.phi("right")

    @cached_property
    def phi_left(self) -> Array:
        """Angle between top beam and left side beam at mid-length [rad], shape (n_samples,)."""
        return self.phi_right if self._left is self._right else self.phi("left")

    def phi(self, side: str, definition: str = "tangent") -> Array:
        """Angle of deflection of one side (thesis 5.3.2) [rad], shape (n_samples,).

        Parameters
        ----------
        side
            ``right`` or ``left``.
        definition
            ``tangent`` of the beam at mid-length, or the ``chord`` between the beam's ends.
        """
        record = self._record(side)
        half = self.scene.half
        if choice(definition, ("tangent", "chord"), field="definition", source="phi") == "chord":
            return beam_chord(half, self.half_rows(side)[0])
        knots = beam_tangent(half, record.q)
        rates = record.v @ half.phi_weights
        return _hermite(self.time, record.time, knots, rates)

    def phi_rate(self, side: str) -> Array:
        """Rate of the angle of deflection of one side, tangent [rad/s], shape (n_samples,)."""
        record, weights = self._record(side), self.scene.half.phi_weights
        return _hermite(self.time, record.time, record.v @ weights, record.a @ weights)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of the joint arrays' columns."""
        return self.scene.joint_names

    @cached_property
    def joint_position(self) -> Array:
        """Travel [m] and relative angles [rad], zero when stress-free, (n_samples, n_joints)."""
        return self._joints[0]

    @cached_property
    def joint_velocity(self) -> Array:
        """Their rates [m/s, rad/s], shape (n_samples, n_joints)."""
        return self._joints[1]

    @cached_property
    def joint_effort(self) -> Array:
        """Actuator force [N] and spring-damper moments on the outer body [N m], likewise."""
        return self._joints[2]

    def states(self, kept: slice = slice(None)) -> SimulationState:
        """Samples as the states of the simulation."""
        columns: dict[str, Any] = {
            name: getattr(self, name)[kept]
            for name in (
                *("time", "travel", "velocity", "actuator_force", "phi_left", "phi_right"),
                *("joint_position", "joint_velocity", "joint_effort"),
            )
        }
        for side in SIDES:
            columns[f"phi_{side}_rate"] = self.phi_rate(side)[kept]
            columns[f"moment_{side}"] = self.largest_moments(side)[kept]
        return SimulationState(**columns)

    def largest_moments(self, side: str) -> Array:
        """Largest bending moment of any section of one side [N m], shape (n_samples,).

        Where joints stand at the sections it is the largest effort of that side's joints.
        """
        return self._largest_moments[SIDES.index(choice(side, SIDES, field="side"))]

    @cached_property
    def _largest_moments(self) -> tuple[Array, Array]:
        """Of the right side and of the left one."""
        right = self._peaks("right")
        mirrored = self._left is self._right
        return right, right if mirrored else self._peaks("left")

    def _peaks(self, side: str) -> Array:
        record = self._record(side)
        if joints_at_sections(self.scene):
            columns = self.scene.joint_columns[SIDES.index(side)]
            return np.asarray(np.abs(self.joint_effort[:, columns]).max(axis=1))
        acceleration = evaluate(self._motion, record.time)[2]
        knots = section_moments(
            self.scene, record.q, record.v, record.a, record.wrench, acceleration
        )
        if len(knots) == 1:
            return np.full(len(self.time), np.abs(knots).max())
        moments = PchipInterpolator(record.time, knots)(self.time)
        return np.asarray(np.abs(moments).max(axis=1))

    @cached_property
    def max_bending_moment(self) -> float:
        """Largest bending moment of any section at any sample [N m] (`results.bending_moments`)."""
        return max(float(self.largest_moments(side).max()) for side in SIDES)

    @property
    def max_stress(self) -> float:
        """Largest bending stress [Pa] (thesis Eq. 5.1)."""
        return self.scene.design.bending_stress(self.max_bending_moment)

    @property
    def stress_ratio(self) -> float:
        """Largest stress relative to the end of the material's linear range."""
        return self.max_stress / self.scene.design.material.stress_limit

    @cached_property
    def energy(self) -> EnergyBalance:
        """Where the work of the actuator and of gravity went, from start to end."""
        return energy_balance(self.scene, self._motion, (self._right, self._left))

    @cached_property
    def warnings(self) -> tuple[UnmodelledContactWarning, ...]:
        """Parts that would have touched although the contact model leaves them out."""
        return find_unmodelled_touches(self.scene, _recorded(self._motion, self._records))

    @property
    def touched(self) -> bool:
        """Whether a tip pressed on the object at any time."""
        return any(bool(record.wrench.any()) for record in self._records)

    @property
    def max_penetration(self) -> float:
        """Deepest overlap of a tip and the object under a contact force [m]."""
        return self._penetration[0]

    @property
    def penetration_time(self) -> float:
        """When that was [s]; the start if there was none."""
        return self._penetration[1]

    @cached_property
    def _penetration(self) -> tuple[float, float]:
        deepest, time = 0.0, float(self.time[0])
        for model, record in zip(self.scene.models, self._records, strict=False):
            travel = evaluate(self._motion, record.time)[0]
            depth, row = deepest_penetration(
                model.chain, model.fingertip, model.obstacle, travel, record.q, record.wrench
            )
            if depth > deepest:
                deepest, time = depth, float(record.time[row])
        return deepest, time

    @cached_property
    def validity(self) -> tuple[Finding, ...]:
        """Where the run leaves what the model describes, what matters most first.

        See `hma_gripper_sim.results.validity`.
        """
        return findings(self.scene, self.observed, self.error_estimate)

    @cached_property
    def observed(self) -> Observed:
        """What the run's validity is judged by."""
        design, travel = self.scene.design, self.travel
        per_moment = design.bending_stress(1.0) / design.material.stress_limit
        ratio = per_moment * np.maximum(*(self.largest_moments(side) for side in SIDES))
        over = np.flatnonzero(ratio > 1.0)
        lowest = int(np.argmax(travel))
        angles = [self.half_rows(side)[0][lowest] for side in SIDES]
        nearest, between = tips_around_object(self.scene, float(travel[lowest]), angles)
        return Observed(
            outcome=self.stats.outcome,
            end=float(self.time[-1]),
            touches=self.warnings,
            touched=self.touched,
            nearest=nearest,
            beyond=float(travel[lowest]) - self.scene.clearance,
            between=between,
            penetration=self.max_penetration,
            penetration_time=self.penetration_time,
            stress_ratio=float(ratio.max()),
            overstress_time=float(self.time[over[0]]) if len(over) else None,
            excess=self.stats.excess,
        )

    @cached_property
    def _joints(self) -> tuple[Array, Array, Array]:
        slide = np.stack([self.travel, self.velocity, self.actuator_force])
        return joint_rows(self.scene, slide, self.half_rows("right"), self.half_rows("left"))

    def half_rows(self, side: str) -> Rows:
        """Joint angles and rates of one half in its own frame, shape (n_samples, n)."""
        record = self._record(side)
        angles = _hermite(self.time, record.time, record.q, record.v)
        return angles, _hermite(self.time, record.time, record.v, record.a)

    def _record(self, side: str) -> HalfRecord:
        return self._right if choice(side, SIDES, field="side") == "right" else self._left


def beam_tangent(half: HalfGripper, q: Array) -> Array:
    """Angle between top beam and the side beam's tangent at mid-length [rad].

    `q`: joint angles of one half, shape (..., n).
    """
    return np.asarray(half.phi_rest + q @ half.phi_weights)


def beam_chord(half: HalfGripper, q: Array) -> Array:
    """Angle between top beam and the line through the side beam's ends [rad]; `q` likewise."""
    still = np.zeros_like(q)
    motion = body_motion(half.chain, q, still, still)
    start, end = (
        motion.joint[..., body] + motion.direction[..., body] * complex(*point)
        for body, point in (half.beam_start, half.beam_end)
    )
    return np.asarray(np.pi + np.angle(end - start))


def joint_rows(scene: Scene, slide: Array, right: Rows, left: Rows) -> tuple[Array, Array, Array]:
    """Arrange both halves as the joint arrays of ``scene.joint_names``.

    Parameters
    ----------
    slide
        Travel, velocity and actuator force, shape (3, ...).
    right, left
        Angles and rates of each half in its own frame, shape (..., n).

    Returns
    -------
    position, velocity, effort
        Shape (..., n_joints).
    """
    chain = scene.half.chain
    rows = np.empty((3, *slide.shape[1:], len(scene.joint_names)))
    rows[..., 0] = slide
    # Mirrored angles turn the other way.
    for columns, sign, (q, v) in zip(scene.joint_columns, (1.0, -1.0), (right, left), strict=True):
        rows[0][..., columns] = sign * q
        rows[1][..., columns] = sign * v
        rows[2][..., columns] = -sign * (chain.stiffness * q + chain.damping * v)
    return rows[0], rows[1], rows[2]


def _recorded(motion: Motion, records: list[HalfRecord]) -> list[Recorded]:
    """States of both halves along the run, close enough to each other to search for touches."""
    recorded = []
    for record, other in zip(records, reversed(records), strict=True):
        time = _divided(motion, record)
        angles = _hermite(time, record.time, record.q, record.v)
        others = angles if other is record else _hermite(time, other.time, other.q, other.v)
        recorded.append(Recorded(time, evaluate(motion, time)[0], angles, others))
    return recorded


def _divided(motion: Motion, record: HalfRecord) -> Array:
    """Times of a record, and between those of long steps so many that no body moves far [s]."""
    h = np.diff(record.time)[:, None]
    rate = np.maximum(np.abs(record.v[:-1]), np.abs(record.v[1:]))
    turn = np.maximum(np.abs(np.diff(record.q, axis=0)), h * rate).sum(axis=1)
    way = np.abs(np.diff(evaluate(motion, record.time)[0]))
    parts = np.ceil(np.maximum(turn / FAR_TURN, way / FAR_WAY)).clip(1.0).astype(np.intp)
    step = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(step)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[step]
    time = record.time[step] + share * h[step, 0]
    return np.append(time, record.time[-1])


def _hermite(at: Array, time: Array, rows: Array, rates: Array) -> Array:
    """Cubic interpolation of `rows`, shape (r,) or (r, n), with given rates."""
    if rows.ndim == 1:
        return _hermite(at, time, rows[:, None], rates[:, None])[:, 0]
    found = np.empty((len(at), rows.shape[1]))
    hermite(at, time, rows, rates, found)
    return found
