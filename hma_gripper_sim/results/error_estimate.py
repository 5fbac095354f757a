"""The error of a run, estimated from runs of the same motion that should give the same."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TIGHTER = 4.0
"""By how much the tolerance of the tighter run is smaller: twice the steps, a quarter of the error.

A larger one leaves less of the error out but takes more of the six runs' time.
"""

ALL_OF_IT = TIGHTER / (TIGHTER - 1.0)
"""The run's error relative to its difference from the tighter run, of which a part is missing."""


@dataclass(frozen=True)
class ErrorEstimate:
    """How far a run is from the exact solution of its equations, and these from the continuum.

    Errors of the force are relative to its largest magnitude in the run; RMS and maximum are over
    the samples, angles of both sides together.

    Parameters
    ----------
    force_rms, force_max
        Of the actuator force by the time stepping; None: the tighter run gave nothing.
    phi_rms, phi_max
        Of the angles of deflection by the time stepping [rad]; None: likewise.
    sensitive_from
        When the run with the object a picometre elsewhere parts from its twin by more than was
        asked [s]; from there on errors are chance.  None: it does not.
    model_force_rms, model_phi_rms
        Of the discretisation, against a finer one [-, rad].  Not smaller than the time stepping's
        errors can be told.  None: the run did not start at the start pose, or the finer model
        gave nothing.
    failures
        What of the companion runs ended early, and what that leaves unsaid.
    force, phi
        The estimated errors at the samples [N, rad], as far as the tighter run came:
        shapes (k,) and (k, 2), right and left; empty where they were not kept.
    """

    force_rms: float | None
    force_max: float | None
    phi_rms: float | None
    phi_max: float | None
    sensitive_from: float | None
    model_force_rms: float | None
    model_phi_rms: float | None
    failures: tuple[str, ...]
    force: Array = field(repr=False, compare=False)
    phi: Array = field(repr=False, compare=False)

    def __str__(self) -> str:
        parts = []
        if self.force_rms is None:
            parts.append("unknown")
        if self.force_rms is not None and self.force_max is not None:
            parts.append(
                f"force {100.0 * self.force_rms:.2g} % RMS, {100.0 * self.force_max:.2g} % at most"
            )
        if self.phi_rms is not None and self.phi_max is not None:
            rms, most = math.degrees(self.phi_rms), math.degrees(self.phi_max)
            parts.append(f"phi {rms:.2g}° RMS, {most:.2g}° at most")
        if self.model_force_rms is not None and self.model_phi_rms is not None:
            angle = math.degrees(self.model_phi_rms)
            parts.append(f"model {100.0 * self.model_force_rms:.2g} % of the force, {angle:.2g}°")
        if self.sensitive_from is not None:
            parts.append(f"sensitive to a picometre from t = {self.sensitive_from:.4g} s")
        return "; ".join(parts)


class Samples(NamedTuple):
    """What of a run is compared: time [s], force [N], shapes (k,), and both angles, (k, 2)."""

    time: Array
    force: Array
    phi: Array


class Spread:
    """Differences between two runs, added up part by part.

    Parameters
    ----------
    series
        Whether to keep them all.
    """

    def __init__(self, series: bool = False) -> None:
        self.count = 0
        self._squares = np.zeros(2)
        self._largest = np.zeros(2)
        self._rises: tuple[list[Array], list[Array]] = ([], [])
        self._series: list[tuple[Array, Array]] | None = [] if series else None

    def add(self, a: Samples, b: Samples) -> None:
        """Add the differences a - b of a part, as long as both are."""
        count = min(len(a.time), len(b.time))
        force, phi = a.force[:count] - b.force[:count], a.phi[:count] - b.phi[:count]
        self.count += count
        self._squares += np.sum(force**2), 0.5 * np.sum(phi**2)
        for i, values in enumerate((np.abs(force), np.abs(phi).max(axis=1, initial=0.0))):
            before = np.maximum.accumulate(np.append(self._largest[i], values))
            rises = values > before[:-1]
            self._rises[i].append(np.column_stack([a.time[:count][rises], values[rises]]))
            self._largest[i] = before[-1]
        if self._series is not None:
            self._series.append((force, phi))

    @property
    def rms(self) -> Array:
        """Of the force [N] and of the angles [rad], shape (2,)."""
        return np.asarray(np.sqrt(self._squares / self.count))

    @property
    def largest(self) -> Array:
        """Likewise."""
        return self._largest

    def first_beyond(self, bounds: tuple[float, float]) -> float:
        """When the force [N] or an angle [rad] first differs by more than its bound [s]."""
        times = [np.inf]
        for rises, bound in zip(self._rises, bounds, strict=True):
            times += [time for part in rises for time, value in part if value > bound][:1]
        return float(min(times))

    def series(self) -> tuple[Array, Array]:
        """Differences of force [N] and angles [rad], shapes (k,) and (k, 2); empty if not kept."""
        parts = self._series or [(np.zeros(0), np.zeros((0, 2)))]
        return np.concatenate([f for f, _ in parts]), np.concatenate([phi for _, phi in parts])


def estimate_error(
    spreads: Mapping[str, Spread], largest: float, tolerance: float, failures: tuple[str, ...] = ()
) -> ErrorEstimate:
    """Estimate the errors of a run from its companions, as far as each of them came.

    Parameters
    ----------
    spreads
        By name: of the run from the tighter and the moved run, and of the tighter one from the
        refined.
    largest
        Magnitude of the force in the run [N].
    tolerance
        What was asked of the run.
    """
    known = {name: spread for name, spread in spreads.items() if spread.count}
    units = np.array([largest or 1.0, 1.0])
    tighter, moved, refined = (known.get(name) for name in ("tighter", "moved", "refined"))
    rms = ALL_OF_IT * tighter.rms / units if tighter else None
    most = ALL_OF_IT * tighter.largest / units if tighter else None
    model = refined.rms / units if refined else None
    force, phi = (tighter or Spread()).series()
    sensitive = None
    if moved and (moved.rms > tolerance * units).any():
        sensitive = moved.first_beyond((tolerance * units[0], tolerance))
    return ErrorEstimate(
        force_rms=_part(rms, 0),
        force_max=_part(most, 0),
        phi_rms=_part(rms, 1),
        phi_max=_part(most, 1),
        sensitive_from=sensitive,
        model_force_rms=_part(model, 0),
        model_phi_rms=_part(model, 1),
        failures=failures,
        force=ALL_OF_IT * force,
        phi=ALL_OF_IT * phi,
    )


def _part(figures: Array | None, i: int) -> float | None:
    return None if figures is None else float(figures[i])
