"""States of a simulated gripper: one instant, and the accepted time steps of a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.integrator import HalfState

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Snapshot:
    """Everything a simulation needs to go on bit for bit as it would have."""

    time: float
    travel: float
    velocity: float
    acceleration: float
    halves: tuple[HalfState, ...]


class HalfRecord(NamedTuple):
    """Accepted time steps of one half, in its own frame; row 0 is the start.

    `load` is the vertical load on the base at the step's inner stage and at its end [N];
    `work` the work so far [J]: done by the base, lost in the joints, given to the contacts,
    and of that lost in friction.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    wrench: Array
    load: Array
    work: Array
