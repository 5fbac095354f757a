"""Velocity profiles of a drive that changes its velocity by at most so much per tick.

Within a tick the velocity is linear in time. All speeds and distances here count towards the
place where the drive is to come to rest.
"""

from __future__ import annotations

import math

from hma_gripper_sim.kernels.compiled import kernel

TRAVEL_RESOLUTION = 1e-12
"""m. Distances below this are rounding: a drive aims this far inside its travel limits."""


@kernel
def stopping_distance(velocity: float, change: float, period: float) -> float:
    """Distance to rest from `velocity` >= 0 when every tick takes off at most `change`.

    With m ticks to go the velocities are v, v - u, ..., v - (m - 1) u, 0, and the travel is the
    sum of the trapezoids between them: T (m v - u m (m - 1) / 2 - v / 2).
    """
    ticks = math.ceil(velocity / change)
    return period * (ticks * velocity - change * ticks * (ticks - 1) / 2 - velocity / 2)


@kernel
def approach_velocity(spare: float, change: float) -> float:
    """Velocity v₁ at the end of the coming tick from which braking ends exactly at the goal.

    Parameters
    ----------
    spare
        Distance that v₁ may still add, divided by the duration of a tick [m/s], >= 0: what is
        left of the way after a coming tick that would end at rest.
    change
        Largest change of velocity in one tick, u [m/s].

    The coming tick adds T v₁ / 2 and braking from v₁ takes `stopping_distance`. Their sum equals
    the distance for v₁ = s / m + u (m - 1) / 2, where s is the spare and m, the ticks that braking
    takes, is the smallest with s <= u m (m + 1) / 2. The last tick of such a ramp ends at the
    goal, at rest.
    """
    ticks = max(1, math.ceil((math.sqrt(1.0 + 8.0 * spare / change) - 1.0) / 2.0))
    return spare / ticks + change * (ticks - 1) / 2.0


@kernel
def braking_velocity(distance: float, velocity: float, change: float, period: float) -> float:
    """Largest velocity at the end of the coming tick from which `distance` still suffices.

    Parameters
    ----------
    distance
        Travel left to the limit, now [m].
    velocity
        Present velocity towards the limit [m/s].
    change
        Largest change of velocity in one tick [m/s].
    period
        Duration of one tick [s].
    """
    spare = (distance - TRAVEL_RESOLUTION) / period - velocity / 2
    if spare * period < TRAVEL_RESOLUTION:
        return 0.0
    return approach_velocity(spare, change)


@kernel
def limited_velocity(
    wanted: float,
    velocity: float,
    ahead: float,
    behind: float,
    change: float,
    period: float,
) -> tuple[float, bool]:
    """Velocity at the end of the coming tick that comes closest to the wanted one [m/s].

    Also returns whether a travel limit holds it back.

    Parameters
    ----------
    velocity
        Present velocity [m/s].
    ahead, behind
        Travel left to the upper and to the lower limit, now [m].
    change, period
        As for `braking_velocity`.
    """
    near = min(max(wanted, velocity - change), velocity + change)
    highest = braking_velocity(ahead, velocity, change, period)
    lowest = -braking_velocity(behind, -velocity, change, period)
    reached = min(max(near, lowest), highest)
    rounding = min(4.0 * TRAVEL_RESOLUTION / period, 0.5 * change)
    return reached, abs(reached - near) > rounding
