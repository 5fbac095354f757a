"""Way points of a motion from rest to rest: a ramp up, a constant speed, a ramp down."""

from __future__ import annotations

import math

from hma_gripper_sim.motion.trajectory import WayPoint

_ROUNDING = 1e-9
"""What a number of ticks may be above a whole one and still count as it."""


def trapezoid(
    start: float, distance: float, speed: float, acceleration: float, tick: float
) -> list[WayPoint]:
    """Return the way points at which the acceleration changes; none where there is no way to go.

    They lie on ticks, so that a drive which changes its acceleration from tick to tick follows
    exactly; the motion takes up to two ticks longer for it. Cubic interpolation between them,
    which a position and a velocity at each ask for, gives the ramps, whose travel is quadratic in
    time.

    Parameters
    ----------
    start
        Travel at rest, at time 0 [m].
    distance
        To go, either way [m].
    speed, acceleration
        Limits, greater than 0 [m/s, m/s²].
    tick
        Of the drive [s].
    """
    if distance == 0.0:
        return []
    way = abs(distance)
    speed = min(speed, math.sqrt(way * acceleration))
    ramp = _ticks(speed / (acceleration * tick))
    # Both ramps together cover as much as one of them would at full speed.
    cruise = max(0, _ticks(way / (speed * tick)) - ramp)
    velocity = distance / ((ramp + cruise) * tick)
    before, after = 0.5 * ramp * tick * velocity, (0.5 * ramp + cruise) * tick * velocity
    points = [WayPoint(time=ramp * tick, position=start + before, velocity=velocity)]
    if cruise:
        time = (ramp + cruise) * tick
        points.append(WayPoint(time=time, position=start + after, velocity=velocity))
    end = (2 * ramp + cruise) * tick
    points.append(WayPoint(time=end, position=start + distance, velocity=0.0))
    return points


def _ticks(count: float) -> int:
    return max(1, math.ceil(count - _ROUNDING))
