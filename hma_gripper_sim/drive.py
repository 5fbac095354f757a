"""The prismatic drive that moves the gripper: commands in, one fixed time step at a time out.

What a real drive with its safety functions does in front of the gripper: it checks and clamps
velocity commands, ramps with a limited acceleration, brakes in time for the ends of its travel,
stops when commands cease, and halts with the last good state when the simulation fails.

Everything happens in ticks of one fixed period and nothing reads a clock: the same commands
before the same ticks give bit-identical states.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.outcome import SimulationError
from hma_gripper_sim.quantities import quantity
from hma_gripper_sim.scene import Scene
from hma_gripper_sim.simulation import Simulation, SimulationState

TRAVEL_RESOLUTION = 1e-12
"""m. The drive aims this far inside a travel limit, so that rounding cannot carry it beyond."""


@dataclass(frozen=True, kw_only=True)
class DriveLimits:
    """What the drive may do.

    Attributes
    ----------
    max_velocity
        Largest speed in either direction [m/s].
    max_acceleration
        Largest rate of change of the velocity [m/s²].
    travel_min, travel_max
        Ends of the travel [m]; the start pose, travel 0, lies between them.
    command_timeout
        Simulated time after which a command that is not renewed expires [s]; 0: never.
    """

    max_velocity: float
    max_acceleration: float
    travel_min: float
    travel_max: float
    command_timeout: float

    def __post_init__(self) -> None:
        for field, unit in (("max_velocity", "m/s"), ("max_acceleration", "m/s^2")):
            quantity(getattr(self, field), unit, field=field, minimum=0.0, exclusive=True)
        quantity(self.travel_min, "m", field="travel_min", maximum=0.0)
        quantity(self.travel_max, "m", field="travel_max", minimum=0.0)
        quantity(self.command_timeout, "s", field="command_timeout", minimum=0.0)
        if not self.travel_min < self.travel_max:
            raise InputError("must be greater than travel_min", field="travel_max")


@dataclass(frozen=True)
class DriveStatus:
    """What the drive is doing, and what it has had to correct since it was built.

    Attributes
    ----------
    contour
        Name of the object that is in place.
    paused
        Time has been stopped by request.
    failure
        Why the simulation could not go on; None while it can.
    stale
        The last command has expired: the drive ramps down or stands until a new one comes.
    clamped
        The command in force had been beyond the velocity limit.
    at_limit
        A travel limit holds the drive back from the commanded velocity.
    ticks
        Time steps made.
    accepted, rejected, clamps, timeouts
        Commands taken, commands dropped as not finite, commands cut to the velocity limit,
        commands that expired.
    """

    contour: str
    paused: bool
    failure: str | None
    stale: bool
    clamped: bool
    at_limit: bool
    ticks: int
    accepted: int
    rejected: int
    clamps: int
    timeouts: int


class Drive:
    """A gripper simulation behind a velocity-controlled prismatic axis.

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
        self._state = simulation.state()
        self._command = 0.0
        self._command_age = 0  # ticks
        self._paused = False
        self._failure: str | None = None
        self._stale = self._clamped = self._at_limit = False
        self._ticks = self._accepted = self._rejected = self._clamps = self._timeouts = 0

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
            paused=self._paused,
            failure=self._failure,
            stale=self._stale,
            clamped=self._clamped,
            at_limit=self._at_limit,
            ticks=self._ticks,
            accepted=self._accepted,
            rejected=self._rejected,
            clamps=self._clamps,
            timeouts=self._timeouts,
        )

    def command(self, velocity: float) -> str | None:
        """Set the velocity to move at [m/s, towards the object], from the next tick on.

        Returns
        -------
        The reason when the command is rejected (it then changes nothing), otherwise None.
        """
        if not math.isfinite(velocity):
            self._rejected += 1
            return f"velocity command must be finite, got {velocity}"
        bound = self._limits.max_velocity
        self._command = min(max(velocity, -bound), bound)
        self._command_age = 0
        self._clamped = self._command != velocity
        self._stale = False
        self._accepted += 1
        self._clamps += self._clamped
        return None

    def tick(self) -> SimulationState:
        """Let one period pass, and return the state after it.

        While paused or failed, time stands still and the state stays the same.
        """
        if not self.running:
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
        self._command_age += 1
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
        self._command = 0.0
        self._command_age = 0
        self._stale = self._clamped = self._at_limit = False
        self._failure = None

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
        self._command_age = round(self._command_age * self._period / period)
        self._command = min(max(self._command, -limits.max_velocity), limits.max_velocity)
        self._limits = limits
        self._period = period

    def _expire_command(self) -> None:
        timeout = self._limits.command_timeout
        if self._command == 0.0 or timeout == 0.0:
            return
        # A hair's allowance: 0.3 s at 0.1 s are three ticks, however the quotient is rounded.
        if self._command_age >= math.ceil(timeout / self._period * (1.0 - 1e-12)):
            self._command = 0.0
            self._clamped = False
            self._stale = True
            self._timeouts += 1

    def _next_velocity(self) -> float:
        """Velocity at the end of the coming tick, within every limit."""
        limits, now = self._limits, self._simulation
        change = limits.max_acceleration * self._period
        wanted = min(max(self._command, now.velocity - change), now.velocity + change)
        ahead, behind = limits.travel_max - now.travel, now.travel - limits.travel_min
        highest = _braking_velocity(ahead, now.velocity, change, self._period)
        lowest = -_braking_velocity(behind, -now.velocity, change, self._period)
        velocity = min(max(wanted, lowest), highest)
        self._at_limit = velocity != wanted
        return velocity

    def _check_stoppable(self, limits: DriveLimits, period: float) -> None:
        """Refuse limits that the present motion can no longer be kept within."""
        travel, velocity = self._simulation.travel, self._simulation.velocity
        needed = travel + math.copysign(
            _stopping_distance(abs(velocity), limits.max_acceleration * period, period), velocity
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
    return (
        math.isfinite(state.actuator_force)
        and math.isfinite(state.phi_left)
        and math.isfinite(state.phi_right)
        and bool(np.isfinite(state.joint_position).all())
        and bool(np.isfinite(state.joint_velocity).all())
        and bool(np.isfinite(state.joint_effort).all())
    )


def _stopping_distance(velocity: float, change: float, period: float) -> float:
    """Distance to rest from `velocity` >= 0 when every tick takes off at most `change`.

    With m ticks to go the velocities are v, v - u, ..., v - (m - 1) u, 0, and the travel is the
    sum of the trapezoids between them: T (m v - u m (m - 1) / 2 - v / 2).
    """
    ticks = math.ceil(velocity / change)
    return period * (ticks * velocity - change * ticks * (ticks - 1) / 2 - velocity / 2)


def _braking_velocity(distance: float, velocity: float, change: float, period: float) -> float:
    """Largest velocity at the end of the coming tick from which `distance` still suffices.

    Parameters
    ----------
    distance
        Travel left to the limit, now [m].
    velocity
        Present velocity towards the limit [m/s].
    change
        Largest change of velocity in one tick, u [m/s].
    period
        Duration of one tick, T [s].

    The coming tick travels T (v + v₁) / 2 and braking from v₁ takes `_stopping_distance`.
    Their sum equals the distance for v₁ = s / m + u (m - 1) / 2, where s = distance / T - v / 2
    and m, the ticks that braking takes, is the smallest with s <= u m (m + 1) / 2. The last
    tick of such a ramp ends on the limit, at rest.
    """
    spare = (distance - TRAVEL_RESOLUTION) / period - velocity / 2
    if spare * period < TRAVEL_RESOLUTION:
        return 0.0
    ticks = max(1, math.ceil((math.sqrt(1.0 + 8.0 * spare / change) - 1.0) / 2.0))
    return spare / ticks + change * (ticks - 1) / 2.0
