"""Where the bodies of a chain are: forward kinematics, for everybody but the solver's own sweep.

`kernels.chain.place` goes the same way with rates, accelerations and loads; the tests compare both.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain, rotation
from hma_gripper_sim.kernels.compiled import kernel

Array = NDArray[np.float64]


@kernel
def turn_joint(
    chain: Chain, i: int, q: float, x: float, z: float, angle: float
) -> tuple[float, float, float]:
    """Place of joint `i` (x, z) [m] and direction of its body [rad], from the body before.

    Parameters
    ----------
    q
        Angle of the joint [rad].
    x, z, angle
        Where the body before ends [m], and its direction [rad].
    """
    angle += chain.rest[i] + q
    if chain.straightening[i] > 0.0:  # it slides along the beam, whose direction turns by half q
        slide = chain.straightening[i] * q * q
        x += slide * np.cos(angle - 0.5 * q)
        z += slide * np.sin(angle - 0.5 * q)
    return x, z, angle


@kernel
def place_tip(chain: Chain, travel: float, q: Array) -> tuple[float, float, float]:
    """Joint of the last body (x, z) [m] and that body's direction [rad]."""
    cos, sin = 1.0, 0.0
    x, z, angle = chain.root[0], chain.root[1] - travel, 0.0
    last = q.size - 1
    for i in range(q.size):
        angle += chain.rest[i] + q[i]
        if chain.straightening[i] > 0.0:
            turn_cos, turn_sin = rotation(chain.rest[i] + 0.5 * q[i])
            slid = chain.straightening[i] * q[i] * q[i]
            x += slid * (cos * turn_cos - sin * turn_sin)
            z += slid * (sin * turn_cos + cos * turn_sin)
        turn_cos, turn_sin = rotation(chain.rest[i] + q[i])
        cos, sin = cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin
        if i < last:
            x += cos * chain.link[i, 0] - sin * chain.link[i, 1]
            z += sin * chain.link[i, 0] + cos * chain.link[i, 1]
    return x, z, angle
