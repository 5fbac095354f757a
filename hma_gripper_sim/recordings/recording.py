"""Signals over time, as they were recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.errors import InputError

FloatArray = npt.NDArray[np.float64]

REACH = 1.5
"""Usual sample periods by which a record holds beyond its ends."""


@dataclass(frozen=True)
class Series:
    """One signal.

    Parameters
    ----------
    time
        [s], shape (n,), never decreasing.
    value
        SI, shape (n,).
    """

    time: FloatArray
    value: FloatArray

    def at(self, time: float) -> float:
        """Return the value at `time` [s], between samples linearly; NaN outside the record.

        The record reaches one and a half of its usual sample periods beyond its ends: a message
        that was lost there is no end.
        """
        beyond = max(self.time[0] - time, time - self.time[-1]) if len(self.time) else np.inf
        steps = np.diff(self.time)
        if beyond > (REACH * np.median(steps) if len(steps) else 0.0):
            return float("nan")
        return float(np.interp(time, self.time, self.value))

    def between(self, start: float, end: float) -> Series:
        """Return the samples with start <= time <= end [s]."""
        kept = (self.time >= start) & (self.time <= end)
        return Series(self.time[kept], self.value[kept])


@dataclass(frozen=True)
class Recording:
    """The signals of one log.

    Parameters
    ----------
    source
        The log's path.
    signals
        By name, such as ``travel`` or ``phi_left``.
    start
        Stamp of this recording's time 0 [ns].
    notes
        Everything in the log that was skipped or recovered, one line each.
    """

    source: str
    signals: Mapping[str, Series]
    start: int
    notes: tuple[str, ...] = ()

    def __getitem__(self, signal: str) -> Series:
        """Return a signal by name."""
        try:
            return self.signals[signal]
        except KeyError:
            raise InputError(
                "no such signal in this log", field=signal, source=self.source
            ) from None

    def delayed(self, offset: float) -> Recording:
        """Return the same recording with time 0 moved `offset` [s] later."""
        return replace(
            self,
            signals={n: replace(s, time=s.time - offset) for n, s in self.signals.items()},
            start=self.start + round(offset * 1e9),
        )
