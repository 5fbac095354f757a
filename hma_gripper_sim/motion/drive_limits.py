"""What the prismatic drive may do."""

from __future__ import annotations

import math
from dataclasses import dataclass

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.units import quantity

SLOWEST = 1e-6
"""Least maximum of velocity and acceleration [m/s, m/s²]: below it a ramp never ends."""


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
        Simulated time after which a velocity that is not renewed expires [s]; 0: never.
    """

    max_velocity: float
    max_acceleration: float
    travel_min: float
    travel_max: float
    command_timeout: float

    def __post_init__(self) -> None:
        for field, unit in (("max_velocity", "m/s"), ("max_acceleration", "m/s^2")):
            quantity(getattr(self, field), unit, field=field, minimum=SLOWEST)
        quantity(self.travel_min, "m", field="travel_min", maximum=0.0)
        quantity(self.travel_max, "m", field="travel_max", minimum=0.0)
        quantity(self.command_timeout, "s", field="command_timeout", minimum=0.0)
        if not self.travel_min < self.travel_max:
            raise InputError("must be greater than travel_min", field="travel_max")

    def timeout_ticks(self, period: float) -> int:
        """Ticks of a period [s] after which a velocity that is not renewed expires; 0: never."""
        # A hair's allowance: 0.3 s at 0.1 s are three ticks, however the quotient is rounded.
        return math.ceil(self.command_timeout / period * (1.0 - 1e-12))
