"""The prismatic drive that moves the gripper: commands in, one fixed time step at a time out.

What a real drive with its safety functions does in front of the gripper: it checks and clamps
velocity commands, follows trajectories, ramps with a limited acceleration, brakes in time for the
ends of its travel, stops when commands cease, and halts with the last good state when the
simulation fails.

Everything happens in ticks of one fixed period and nothing reads a clock: the same commands
before the same ticks give bit-identical states.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.braking import (
    TRAVEL_RESOLUTION,
    approach_velocity,
    stopping_distance,
)
from hma_gripper_sim.kernels.drive_profile import clamped, is_expired, next_velocity
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.states import Snapshot
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.motion.trajectory import Spline, Trajectory, WayPoint
from hma_gripper_sim.results.observation import observe_instant
from hma_gripper_sim.results.validity import Finding, findings
from hma_gripper_sim.simulation.simulation import Simulation
from hma_gripper_sim.simulation.state import SimulationState
from hma_gripper_sim.units import quantity


class DriveStatus(NamedTuple):
    """What the drive is doing, and what it has had to correct since it was built.

    Attributes
    ----------
    contour
        Name of the object that is in place.
    source
        Who sent the command in force; empty before the first.
    following
        That command is a trajectory.
    paused
        Time has been stopped by request.
    failure
        Why the simulation could not go on; None while it can.
    stale
        The last command has expired: the drive ramps down or stands until a new one comes.
    clamped
        The command in force is, or was, beyond the velocity limit.
    at_limit
        A travel limit holds the drive back from the commanded velocity.
    ticks
        Time steps made.
    clamps, timeouts
        How often a command was cut to the velocity limit, and how many expired.
    """

    contour: str
    source: str
    following: bool
    paused: bool
    failure: str | None
    stale: bool
    clamped: bool
    at_limit: bool
    ticks: int
    clamps: int
    timeouts: int


class Drive:
    """A gripper simulation behind a prismatic axis that takes velocities and trajectories.

    Parameters
    ----------
    simulation
        The gripper. Nobody else may step it.
    scenes
        The catalogue: one scene per object name, all of the same design and discretisation.
    contour
        Name of the object that `simulation` starts with.
    period
        Duration of one tick [s].
    limits
        What the drive may do.
    """

    def __init__(
        self,
        simulation: Simulation,
        scenes: Mapping[str, Scene],
        contour: str,
        *,
        period: float,
        limits: DriveLimits,
    ) -> None:
        self._simulation = simulation
        self._scenes = _catalogue(scenes, contour)
        self._contour = contour
        self._period = quantity(period, "s", field="period", minimum=0.0, exclusive=True)
        self._limits = limits
        self._axis = limits.axis(self._period)
        self._state = simulation.state()
        self._paused = False
        self._failure: str | None = None
        self._ticks = self._clamps = self._timeouts = 0
        self._spline: Spline | None = None
        self._forget_command()

    @property
    def scenes(self) -> Mapping[str, Scene]:
        """The catalogue, by object name."""
        return self._scenes

    @property
    def limits(self) -> DriveLimits:
        """What the drive may do."""
        return self._limits

    @property
    def period(self) -> float:
        """Duration of one tick [s]."""
        return self._period

    @property
    def state(self) -> SimulationState:
        """The last good state."""
        return self._state

    @property
    def running(self) -> bool:
        """Whether the next tick will move time on."""
        return not self._paused and self._failure is None

    def status(self) -> DriveStatus:
        """Return what the drive is doing."""
        return DriveStatus(
            contour=self._contour,
            source=self._source,
            following=self._spline is not None,
            paused=self._paused,
            failure=self._failure,
            stale=self._stale,
            clamped=self._clamped,
            at_limit=self._at_limit,
            ticks=self._ticks,
            clamps=self._clamps,
            timeouts=self._timeouts,
        )

    def snapshot(self) -> Snapshot:
        """Return everything that the simulation's next tick depends on."""
        return self._simulation.snapshot()

    def validity(self) -> tuple[Finding, ...]:
        """Return where the present state leaves what the model describes, stress apart."""
        scene = self._scenes[self._contour]
        observed = observe_instant(scene, self._simulation.snapshot())
        return tuple(f for f in findings(scene, observed) if f.name != "no_contact")

    def command(self, velocity: float, source: str = "") -> None:
        """Set the velocity to move at [m/s, towards the object], from the next tick on.

        Parameters
        ----------
        source
            Who sent it.

        Raises
        ------
        InputError
            It is not finite; nothing changes.
        """
        velocity = quantity(velocity, "m/s", field="velocity")
        self._velocity = clamped(self._axis, velocity)
        self._age = 0
        self._spline = None
        self._source = source
        self._clamped = self._velocity != velocity
        self._clamps += self._clamped
        self._stale = False

    def go_to(self, travel: float, source: str = "") -> None:
        """Go to a travel [m], from the next tick on, as fast as the limits allow, and stay there.

        Raises
        ------
        InputError
            It is not finite; nothing changes.
        """
        self.follow(Trajectory([WayPoint(time=0.0, position=travel)]), source=source)

    def follow(self, trajectory: Trajectory, delay: float = 0.0, source: str = "") -> None:
        """Follow a trajectory that starts `delay` seconds from now, from the next tick on.

        Within the limits, the travel at the end of each tick is on the spline to ``T³ |j| / 24``
        (period T, the spline's third derivative j). A trajectory does not expire: it ends in a
        standstill, which is held.

        Parameters
        ----------
        delay
            Negative for a trajectory that has started in the past [s].
        source
            Who sent it.
        """
        now = self._simulation
        self._spline = trajectory.spline(-delay, now.travel, now.velocity)
        self._spline_start = now.time + delay
        self._velocity = 0.0
        self._source = source
        self._clamped = self._stale = False

    def tick(self) -> SimulationState:
        """Let one period pass, and return the state after it.

        While paused or failed, time stands still and the state stays the same.
        """
        return self.step() if self.running else self._state

    def step(self) -> SimulationState:
        """Let one period pass although paused; not after a failure."""
        if self._failure is not None:
            return self._state
        self._expire_command()
        try:
            self._simulation.step(self._period, self._next_velocity())
        except SimulationError as error:
            self._failure = str(error)
            return self._state
        state = self._simulation.state()
        if not _is_finite(state):
            self._failure = "the simulation returned a state that is not finite"
            return self._state
        self._age += 1
        self._ticks += 1
        self._state = state
        return state

    def pause(self, paused: bool) -> None:
        """Stop time, or let it go on.

        Nothing is forgotten meanwhile: motion and command go on as they were, and a new
        command may be given. Going on after a failure tries the failed tick again.
        """
        self._paused = paused
        if not paused:
            self._failure = None

    def reset(self) -> None:
        """Return to the start pose, at rest and without a command; the object stays selected.

        Ends a failure, not a pause.
        """
        self._simulation.reset()
        self._state = self._simulation.state()
        self._failure = None
        self._forget_command()

    def select(self, contour: str) -> None:
        """Put another object of the catalogue in place.

        Raises
        ------
        InputError
            The name is unknown, or the object would overlap the gripper where it is now.
        """
        self.configure(contour=contour)

    def configure(
        self,
        *,
        scenes: Mapping[str, Scene] | None = None,
        contour: str | None = None,
        limits: DriveLimits | None = None,
        period: float | None = None,
    ) -> None:
        """Change what is given, all of it or nothing, between two ticks.

        Raises
        ------
        InputError
            The object is unknown or would overlap the gripper where it is now, or the drive
            could not stop within the new limits from its present motion.
        """
        contour = self._contour if contour is None else contour
        scenes = _catalogue(self._scenes if scenes is None else scenes, contour)
        limits = self._limits if limits is None else limits
        period = self._period if period is None else period
        if limits != self._limits or period != self._period:
            self._check_stoppable(limits, period)
        if scenes[contour] is not self._scenes[self._contour]:
            try:
                self._simulation.change_scene(scenes[contour])
            except InputError as error:
                raise InputError(f"{contour!r} {error.reason}", field="contour") from None
            self._state = self._simulation.state()
        self._scenes = scenes
        self._contour = contour
        self._age = round(self._age * self._period / period)
        self._limits = limits
        self._period = period
        self._axis = limits.axis(period)
        self._velocity = clamped(self._axis, self._velocity)

    def _forget_command(self) -> None:
        self._velocity = 0.0
        self._age = 0  # ticks
        self._spline = None
        self._spline_start = 0.0
        self._source = ""
        self._stale = self._clamped = self._at_limit = False

    def _expire_command(self) -> None:
        if self._velocity != 0.0 and is_expired(self._axis, self._age):
            self._velocity = 0.0
            self._clamped = False
            self._stale = True
            self._timeouts += 1

    def _next_velocity(self) -> float:
        """Velocity at the end of the coming tick, within every limit."""
        now, wanted = self._simulation, self._velocity
        if self._spline is not None:
            wanted = self._velocity_onto(self._spline)
        velocity, self._at_limit = next_velocity(self._axis, wanted, now.travel, now.velocity)
        return velocity

    def _velocity_onto(self, spline: Spline) -> float:
        """Velocity at the end of the coming tick that leads onto a spline.

        It is the spline's own, plus what makes up for the distance by which the tick would then
        miss it. Seen from the spline that is the approach of a goal, which ends at rest there.
        """
        now, bound = self._simulation, self._limits.max_velocity
        position, velocity = spline.at(now.time + self._period - self._spline_start)
        miss = position - now.travel - 0.5 * self._period * (now.velocity + velocity)
        if abs(miss) > TRAVEL_RESOLUTION:
            catch_up = approach_velocity(abs(miss) / self._period, self._axis.change)
            velocity += math.copysign(catch_up, miss)
        before, self._clamped = self._clamped, abs(velocity) > bound
        self._clamps += self._clamped and not before
        return clamped(self._axis, velocity)

    def _check_stoppable(self, limits: DriveLimits, period: float) -> None:
        """Refuse limits that the present motion can no longer be kept within."""
        travel, velocity = self._simulation.travel, self._simulation.velocity
        needed = travel + math.copysign(
            stopping_distance(abs(velocity), limits.max_acceleration * period, period), velocity
        )
        for field, bound, outside in (
            ("travel_max", limits.travel_max, max(travel, needed) - limits.travel_max),
            ("travel_min", limits.travel_min, limits.travel_min - min(travel, needed)),
        ):
            if outside > 0.0:
                raise InputError(
                    f"the gripper, at {travel:g} m and {velocity:g} m/s, cannot be kept within "
                    f"{bound:g} m; move it back first",
                    field=field,
                )


def _catalogue(scenes: Mapping[str, Scene], contour: str) -> Mapping[str, Scene]:
    if contour not in scenes:
        known = ", ".join(sorted(scenes)) or "none"
        raise InputError(f"unknown contour {contour!r} (known: {known})", field="contour")
    return MappingProxyType(dict(scenes))


def _is_finite(state: SimulationState) -> bool:
    """Whether all numbers are: the quickest test is a sum of squares."""
    rows = (state.joint_position, state.joint_velocity, state.joint_effort)
    squares = sum(float(row @ row) for row in rows)
    return math.isfinite(squares + state.actuator_force + state.phi_left + state.phi_right)
