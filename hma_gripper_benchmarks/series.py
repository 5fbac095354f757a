"""Results of any solver in one form, and how far they are from a reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.simulation.trace import Trace, beam_tangent

Array = NDArray[np.float64]

SETTLED = 0.1  # s; start-up of solvers that do not start in equilibrium is not compared


@dataclass(frozen=True)
class Series:
    """Sampled results; all arrays of shape (n_samples,).

    Parameters
    ----------
    time
        [s]
    force
        Of the actuator [N].
    phi
        Of the right side [rad].
    moment
        Largest bending moment of any section of the right half [N m]; of the thesis' model, the
        largest spring-damper moment of any joint.
    """

    time: Array
    force: Array
    phi: Array
    moment: Array

    @property
    def is_finite(self) -> bool:
        """Whether there is no infinity or NaN in it."""
        return all(bool(np.isfinite(part).all()) for part in (self.force, self.phi, self.moment))


@dataclass(frozen=True)
class Deviation:
    """Differences to a reference.

    Parameters
    ----------
    force_rms, force_max
        Relative to the largest force of the reference.
    phi_rms, phi_max
        [degree]
    moment_rms, moment_max
        Relative to the largest moment of the reference.
    """

    force_rms: float
    force_max: float
    phi_rms: float
    phi_max: float
    moment_rms: float
    moment_max: float


def from_trace(trace: Trace) -> Series:
    """Results of this package."""
    moment = trace.largest_moments("right")
    return Series(trace.time, trace.actuator_force, trace.phi_right, moment)


def from_joints(scene: Scene, time: Array, force: Array, q: Array, v: Array) -> Series:
    """Results of a peer: joint angles and rates of the right half, shape (n_samples, n)."""
    chain = scene.half.chain
    moment = np.abs(chain.stiffness * q + chain.damping * v).max(axis=1)
    return Series(time, force, beam_tangent(scene.half, q), moment)


def deviation(series: Series, reference: Series) -> Deviation:
    """How far `series` is from a more finely sampled reference."""
    compared = (series.time >= SETTLED) & (series.time <= reference.time[-1])
    time = series.time[compared]

    def differences(values: Array, wanted: Array) -> Array:
        return np.asarray(values[compared] - np.interp(time, reference.time, wanted))

    def rms(values: Array) -> float:
        return float(np.sqrt(np.mean(values**2)))

    def largest(values: Array) -> float:
        return float(np.abs(values).max())

    force = differences(series.force, reference.force) / np.abs(reference.force).max()
    phi = np.degrees(differences(series.phi, reference.phi))
    moment = differences(series.moment, reference.moment) / reference.moment.max()
    if not series.is_finite:
        return Deviation(*(6 * (math.inf,)))
    return Deviation(
        rms(force), largest(force), rms(phi), largest(phi), rms(moment), largest(moment)
    )
