"""What the prismatic drive may do."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.drive_profile import Axis
from hma_gripper_sim.model.numbers import check_numbers, number

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

    max_velocity: float = field(
        metadata=number(
            "m/s",
            "Largest prismatic speed [m/s]; commands beyond it are clamped.",
            minimum=SLOWEST,
        )
    )
    max_acceleration: float = field(
        metadata=number(
            "m/s^2",
            "Largest prismatic acceleration [m/s^2], for every ramp and for braking at the travel "
            "limits.",
            minimum=SLOWEST,
        )
    )
    travel_min: float = field(
        metadata=number(
            "m",
            "Lower travel limit, away from the object [m]; the start pose is 0.",
            maximum=0.0,
        )
    )
    travel_max: float = field(
        metadata=number("m", "Upper travel limit, towards the object [m].", minimum=0.0)
    )
    command_timeout: float = field(
        metadata=number(
            "s",
            "Simulated time after which a velocity command that is not renewed expires, and the "
            "drive ramps to rest [s]; 0: never.",
            minimum=0.0,
        )
    )

    def __post_init__(self) -> None:
        check_numbers(self)
        if not self.travel_min < self.travel_max:
            raise InputError("must be greater than travel_min", field="travel_max")

    def axis(self, period: float) -> Axis:
        """Return the same for ticks of a period [s], ready for the kernels."""
        # A hair's allowance: 0.3 s at 0.1 s are three ticks, however the quotient is rounded.
        timeout = math.ceil(self.command_timeout / period * (1.0 - 1e-12))
        change = self.max_acceleration * period
        return Axis(self.max_velocity, change, self.travel_min, self.travel_max, timeout, period)
