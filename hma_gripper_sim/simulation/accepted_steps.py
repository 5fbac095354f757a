"""Accepted time steps of one half of the gripper, as the solver recorded them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


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
