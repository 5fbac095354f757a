"""Where in a log each signal is found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Any, Protocol

import numpy as np

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.logs.topics import ACTUATOR_WRENCH, JOINT_STATES, PHI

SLIDE = "slide"
"""Name of the prismatic joint; all others are revolute."""


class Signal(Protocol):
    """A scalar, SI, that every message of one topic carries."""

    @property
    def topic(self) -> str:
        """Name of the topic."""

    def read(self, message: Any) -> float:
        """Return the signal's value in `message`; raise `InputError` if it is not there."""


@dataclass(frozen=True)
class Field:
    """A number in a message: dotted `field`, and `joint` by name where that is an array."""

    topic: str
    field: str
    joint: str | None = None

    def read(self, message: Any) -> float:
        """Return the field's value."""
        try:
            value = reduce(getattr, self.field.split("."), message)
            return float(value if self.joint is None else value[message.name.index(self.joint)])
        except (AttributeError, IndexError, TypeError, ValueError):
            entry = f" of joint {self.joint!r}" if self.joint else ""
            raise InputError(f"a message has no {self.field!r}{entry}", field=self.topic) from None


@dataclass(frozen=True)
class LargestMoment:
    """The largest absolute spring-damper moment of the revolute joints [N m] (thesis 5.2)."""

    topic: str

    def read(self, message: Any) -> float:
        """Return the largest moment in one JointState."""
        if len(message.effort) != len(message.name):
            raise InputError("a message has no 'effort' of every joint", field=self.topic)
        revolute = [name != SLIDE for name in message.name]
        return float(np.max(np.abs(message.effort), where=revolute, initial=0.0))


NODE_SIGNALS: Mapping[str, Signal] = {
    "travel": Field(JOINT_STATES.name, "position", SLIDE),
    "actuator_force": Field(ACTUATOR_WRENCH.name, "wrench.force.z"),
    "phi_left": Field(PHI.name, "position", "phi_left"),
    "phi_right": Field(PHI.name, "position", "phi_right"),
    "bending_moment": LargestMoment(JOINT_STATES.name),
}
"""The signals in a log of this project's own node: m, N, rad, rad, N m."""
