"""Trajectories of the prismatic joint: way points in time, and the spline through them.

The rules are those of ros2_controllers' joint_trajectory_controller, so that the same message
gives the same motion behind it and here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.interpolate import BPoly, PPoly

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.units import quantity

LARGEST = 1e6
"""Bound of every number of a way point [m, m/s, m/s²]: beyond it a spline could overflow."""

SHORTEST = 1e-9
"""Least time between two knots of a spline [s]: the resolution of ROS times."""

AT_REST = 1.2e-7
"""Velocity up to which a last way point counts as at rest [m/s]: the precision of a float32."""

_UNITS = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}


@dataclass(frozen=True, kw_only=True)
class WayPoint:
    """Where to be when.

    Attributes
    ----------
    time
        After the start of the trajectory [s].
    position, velocity, acceleration
        Of the prismatic joint [m, m/s, m/s²]; None: not given.
    """

    time: float
    position: float | None = None
    velocity: float | None = None
    acceleration: float | None = None


class Spline:
    """A piecewise polynomial in time, and a standstill at its end.

    Between two knots it is linear, cubic or quintic, by what both of them give: positions only,
    velocities as well, or also accelerations.

    Parameters
    ----------
    times
        Of the knots, increasing [s].
    knots
        Position and, as far as given, velocity and acceleration at each.
    """

    def __init__(self, times: Sequence[float], knots: Sequence[Sequence[float]]) -> None:
        self._end, self._last = times[-1], knots[-1][0]
        if len(times) > 1:
            given = [len(knot) for knot in knots]
            degrees = 2 * np.minimum(given[:-1], given[1:]) - 1
            bernstein = BPoly.from_derivatives(times, knots, orders=degrees)
            self._position = PPoly.from_bernstein_basis(bernstein)
            self._velocity = self._position.derivative()

    def at(self, time: float) -> tuple[float, float]:
        """Position [m] and velocity [m/s] at a time [s] that is not before the first knot."""
        if time >= self._end:
            return self._last, 0.0
        return float(self._position(time)), float(self._velocity(time))


class Trajectory:
    """A motion of the prismatic joint through way points.

    Parameters
    ----------
    points
        At least one, at increasing times. Either all have a position, or none has: then every
        one has a velocity, and the motion starts from wherever the joint is.
    moving_end
        The last point need not be at rest.

    Raises
    ------
    InputError
        A number is missing, not finite or out of range, times do not increase, or the last point
        is not at rest although it must be.
    """

    def __init__(self, points: Sequence[WayPoint], *, moving_end: bool = False) -> None:
        if not points:
            raise InputError("has no way points", field="points")
        self._points = tuple(_checked(point, i) for i, point in enumerate(points))
        before = None
        for i, point in enumerate(self._points):
            if before is not None and not point.time - before.time > 0.5 * SHORTEST:
                raise _refuse(i, "time", "must be later than that of the point before")
            if (point.position is None) != (self._points[0].position is None):
                raise _refuse(i, "position", "must be given for all points or for none")
            before = point
        if abs(self._points[-1].velocity or 0.0) > AT_REST and not moving_end:
            reason = "must be 0 at the last point (see allow_nonzero_velocity_at_trajectory_end)"
            raise _refuse(len(points) - 1, "velocity", reason)

    @property
    def end(self) -> float:
        """Time of the last way point [s]."""
        return self._points[-1].time

    def spline(self, now: float, travel: float, velocity: float) -> Spline:
        """Return the motion from a present state on, in the trajectory's own time.

        Parameters
        ----------
        now
            Present time after the trajectory's start, negative before it [s]. Way points that
            have passed keep their part in the shape of what is left.
        travel, velocity
            Present state: where the motion starts from if the first point is yet to come [m, m/s].
        """
        times: list[float] = []
        knots: list[list[float]] = []
        begins_here = self._points[0].time - now > SHORTEST
        if begins_here:
            times.append(now)
            knots.append([travel, velocity])
        for point in self._points:
            position = point.position
            if position is None:
                position = _mean_velocity_step(times, knots, point) if knots else 0.0
            times.append(point.time)
            knots.append([position, *_derivatives(point)])
        spline = Spline(times, knots)
        if self._points[0].position is None and not begins_here:
            shift = travel - spline.at(max(now, times[0]))[0]
            return Spline(times, [[knot[0] + shift, *knot[1:]] for knot in knots])
        return spline


def _mean_velocity_step(times: list[float], knots: list[list[float]], point: WayPoint) -> float:
    """Position of a point that has none: as far as the mean of both velocities carries."""
    velocities = knots[-1][1] + (point.velocity or 0.0)
    return knots[-1][0] + 0.5 * velocities * (point.time - times[-1])


def _derivatives(point: WayPoint) -> list[float]:
    """Velocity and acceleration as far as given; an acceleration alone is of no use."""
    if point.velocity is None:
        return []
    return [point.velocity] if point.acceleration is None else [point.velocity, point.acceleration]


def _checked(point: WayPoint, index: int) -> WayPoint:
    try:
        quantity(point.time, "s", field="time", minimum=0.0)
        for field in fields(point):
            value = getattr(point, field.name)
            if field.name in _UNITS and value is not None:
                unit = _UNITS[field.name]
                quantity(value, unit, field=field.name, minimum=-LARGEST, maximum=LARGEST)
    except InputError as error:
        raise error.within(field_prefix=f"points[{index}]") from None
    if point.position is None and point.velocity is None:
        raise _refuse(index, "position", "or a velocity must be given")
    return point


def _refuse(index: int, field: str, reason: str) -> InputError:
    return InputError(reason, field=f"points[{index}].{field}")
