"""How much of a measured signal a simulated one covers: what a bound on errors is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.recordings.recording import FloatArray, Series

LONGEST_GAP = 5.0
"""Usual sample periods over which a signal is still interpolated: beyond them it is not known."""

ENOUGH = 0.95
"""Share of a measured signal that one with a bound has to cover, unless another is asked for."""

IN_ONE_GAP = 0.2
"""Share of what need not be covered that may lie in one gap."""


@dataclass(frozen=True)
class Coverage:
    """What of a measured signal another one covers.

    Attributes
    ----------
    share
        Of the time in which the measured signal is known.
    largest_gap
        The longest time [s] in which only the measured signal is known, between two times at which
        both are.
    span
        The time in which the measured signal is known [s].
    """

    share: float
    largest_gap: float
    span: float

    def is_enough(self, least: float) -> bool:
        """Whether a bound can be judged where so large a share has to be covered."""
        longest = IN_ONE_GAP * (1.0 - least) * self.span
        return self.share >= least and self.largest_gap <= longest


def coverage(simulated: Series, measured: Series) -> Coverage:
    """Return how much of a measured signal a simulated one covers, on one clock."""
    edges = np.unique(np.concatenate([*_stretches(measured), *_stretches(simulated)]))
    middle, length = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    wanted = known_at(measured, middle)
    both = wanted & known_at(simulated, middle)
    span = float(length[wanted].sum())
    if span == 0.0:  # of single samples
        return Coverage(float(known_at(simulated, measured.time).mean()), 0.0, span)
    if not both.any():
        return Coverage(0.0, 0.0, span)
    first, last = (int(end) for end in np.flatnonzero(both)[[0, -1]])
    missing = (wanted & ~both)[first : last + 1]
    runs = np.flatnonzero(np.diff(missing, prepend=~missing[0]))
    gaps = np.add.reduceat(length[first : last + 1], runs)[missing[runs]]
    share = float(length[both].sum()) / span
    return Coverage(share, float(gaps.max()) if gaps.size else 0.0, span)


def known_at(series: Series, time: FloatArray) -> npt.NDArray[np.bool_]:
    """Return at which times [s] a signal is known: at its samples, and not far between two."""
    starts, ends = _stretches(series)
    before = np.searchsorted(starts, time, side="right") - 1
    known: npt.NDArray[np.bool_] = (before >= 0) & (time <= ends[before])
    return known


def _stretches(series: Series) -> tuple[FloatArray, FloatArray]:
    """Return from when on and up to when a signal is known [s], both in order."""
    gaps = np.diff(series.time)
    longest = LONGEST_GAP * float(np.median(gaps[gaps > 0.0])) if (gaps > 0.0).any() else 0.0
    breaks = np.flatnonzero(gaps > longest)
    return series.time[np.append(0, breaks + 1)], series.time[np.append(breaks, len(gaps))]
