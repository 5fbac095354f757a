"""Static equilibrium of a chain under a force on its end that keeps its direction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import (
    Chain,
    ChainWorkspace,
    TipResponse,
    eliminate,
    place,
    substitute,
)
from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]

MAX_ITERATIONS = 100
LARGEST_TURN = 0.5  # rad; of any body in one Newton iteration
CONVERGED = 1e-13  # rad


@kernel
def solve_dead_load(
    chain: Chain,
    force: Array,
    base: Array,
    q: Array,
    at_rest: Array,
    increment: Array,
    change: Array,
    workspace: ChainWorkspace,
    tip: TipResponse,
) -> bool:
    """Solve for the joint angles `q`, shape (n,), which hold the first guess.

    `force` (fx, fz) [N] acts on the end of the last link.  Newton's method, its step limited
    so that no body turns further than the linearisation reaches.  `at_rest`, `increment`,
    shape (n,), and `change`, shape (3,), are zeros.
    """
    n = q.size
    last = n - 1
    for _ in range(MAX_ITERATIONS):
        place(chain, base, 0.0, q, at_rest, at_rest, workspace, tip)
        cos, sin = np.cos(tip.pose[2]), np.sin(tip.pose[2])
        lx = cos * chain.link[last, 0] - sin * chain.link[last, 1]
        lz = sin * chain.link[last, 0] + cos * chain.link[last, 1]
        tip.wrench[0] = force[0]
        tip.wrench[1] = force[1]
        tip.wrench[2] = lx * force[1] - lz * force[0]
        if not eliminate(chain, 0.0, q, at_rest, workspace, tip):
            return False
        turn = substitute(workspace, change, increment)
        scale = min(1.0, LARGEST_TURN / turn) if turn > 0.0 else 1.0
        for i in range(n):
            q[i] += scale * increment[i]
        if turn <= CONVERGED:
            return True
    return False
