"""Poses, velocities and accelerations of all bodies of a half, for many states at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


class BodyMotion(NamedTuple):
    """Motion of the bodies relative to the base; vectors of the plane are x + i z.

    Attributes
    ----------
    direction
        Of each body: the unit vector of its frame's x, shape (..., n).
    joint
        Place of each body's joint [m], shape (..., n).
    centre, centre_velocity, centre_acceleration
        Of gravity [m, m/s, m/s^2], shape (..., n).
    spin
        Angular velocity of each body [rad/s], shape (..., n).
    """

    direction: Complex
    joint: Complex
    centre: Complex
    centre_velocity: Complex
    centre_acceleration: Complex
    spin: Array


def body_motion(chain: Chain, q: Array, v: Array, a: Array) -> BodyMotion:
    """Return the motion of all bodies at joint angles, rates and accelerations, each (..., n)."""
    angle = np.cumsum(q + chain.rest, axis=-1)
    spin, spin_rate = np.cumsum(v, axis=-1), np.cumsum(a, axis=-1)
    direction = np.exp(1j * angle)
    turn = 1j * spin_rate - spin**2  # acceleration of what turns with a body, per its vector
    link = direction * (chain.link[:, 0] + 1j * chain.link[:, 1])
    arm = direction * (chain.centre[:, 0] + 1j * chain.centre[:, 1])
    # A joint slides by straightening q^2 along the beam, whose direction turns by half of q.
    along = chain.straightening * np.exp(1j * (angle - 0.5 * q))
    drift, drift_rate = spin - 0.5 * v, spin_rate - 0.5 * a
    slide, shift = along * q**2, along * 2.0 * q * v
    slide_rate = shift + 1j * drift * slide
    slide_acceleration = (
        along * 2.0 * (v**2 + q * a) + 2j * drift * shift + (1j * drift_rate - drift**2) * slide
    )
    joint = complex(*chain.root) + np.cumsum(link + slide, axis=-1) - link
    joint_velocity = np.cumsum(1j * spin * link + slide_rate, axis=-1) - 1j * spin * link
    joint_acceleration = np.cumsum(turn * link + slide_acceleration, axis=-1) - turn * link
    return BodyMotion(
        direction,
        joint,
        joint + arm,
        joint_velocity + 1j * spin * arm,
        joint_acceleration + turn * arm,
        spin,
    )
