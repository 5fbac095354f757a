"""Matching the time of two logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series

SHARED = 0.5
"""Share of the shorter log that has to lie within the other for a match."""

STEP = 0.02
"""Least resolution [s] of the first search for an offset; refined afterwards."""

MAX_SAMPLES = 200_000
"""Of the first search: longer logs are searched more coarsely."""


LONGEST_DELAY, DELAY_STEP, MAX_DELAY_SAMPLES = 1.0, 0.01, 20_000
"""Delays of a signal that are looked for [s], how finely [s], and at how many samples at most."""


@dataclass(frozen=True)
class Alignment:
    """How the time of a simulated log is matched with that of an experiment.

    Attributes
    ----------
    method
        ``stamps`` or ``travel``.
    offset
        Is subtracted from the simulated log's own time [s].
    travel_rmse
        What is left between the travels [m]; None where one of them is not known.
    """

    method: str
    offset: float
    travel_rmse: float | None

    @property
    def description(self) -> str:
        """In words."""
        if self.method == "stamps":
            text = "aligned by their stamps"
        else:
            text = f"aligned by the travel: the simulated log is shifted by {-self.offset:.6g} s"
        if self.travel_rmse is None:
            return text
        return f"{text}; travels then differ by {self.travel_rmse * 1e3:.3g} mm RMS"


def align_recordings(
    simulated: Recording, experiment: Recording, method: str = "auto"
) -> tuple[Recording, Alignment]:
    """Move a simulated recording to the time of an experiment's.

    Parameters
    ----------
    method
        ``stamps``: the stamps are of one clock. ``travel``: by the offset that makes the travels
        differ least. ``auto``: by the stamps where the logs overlap by them, else by the travel.

    Raises
    ------
    InputError
        The logs do not overlap by their stamps, or a travel is missing or never changes.
    """
    by_stamps = 1e-9 * (experiment.start - simulated.start)
    if method != "travel":
        ours, theirs = _range(simulated), _range(experiment)
        shared = min(ours[1] - by_stamps, theirs[1]) - max(ours[0] - by_stamps, theirs[0])
        shorter = min(ours[1] - ours[0], theirs[1] - theirs[0])
        if shared >= SHARED * shorter:
            moved = simulated.delayed(by_stamps)
            return moved, Alignment("stamps", by_stamps, _travel_rmse(moved, experiment))
        if method == "stamps":
            raise InputError(
                "by their stamps the logs do not overlap: align them by the travel",
                source=simulated.source,
            )
    offset = best_offset(simulated["travel"], experiment["travel"], simulated.source)
    moved = simulated.delayed(offset)
    return moved, Alignment("travel", offset, _travel_rmse(moved, experiment))


def best_offset(simulated: Series, experiment: Series, source: str = "") -> float:
    """Return what to subtract from the simulated time for the travels to differ least [s].

    At least half of the shorter one has to lie within the other.
    """
    from scipy.optimize import minimize_scalar  # slow to import; most logs agree in their stamps

    step = max(STEP, (_length(simulated) + _length(experiment)) / MAX_SAMPLES)
    ours, theirs = _even(simulated, step), _even(experiment, step)
    for travel, whose in ((ours, "simulated"), (theirs, "experiment's")):
        if np.ptp(travel) == 0.0:
            raise InputError(
                f"the {whose} travel never changes: there is nothing to align by",
                field="travel",
                source=source,
            )
    # Mean square of ours[i + lag] - theirs[i] over the overlap, for every lag at once.
    ones = np.ones(len(theirs))
    count = _convolved(np.ones(len(ours)), ones)
    squares = _convolved(ours**2, ones) + _convolved(np.ones(len(ours)), theirs[::-1] ** 2)
    error = (squares - 2.0 * _convolved(ours, theirs[::-1])) / np.maximum(count, 1.0)
    enough = count >= SHARED * min(len(ours), len(theirs)) - 0.5
    lag = int(np.argmin(np.where(enough, error, np.inf))) - (len(theirs) - 1)
    coarse = lag * step + float(simulated.time[0] - experiment.time[0])

    def misfit(offset: float) -> float:
        return _rmse(Series(simulated.time - offset, simulated.value), experiment)

    found = minimize_scalar(
        misfit,
        bounds=(coarse - 2.0 * step, coarse + 2.0 * step),
        method="bounded",
        options={"xatol": 1e-6},
    )
    return float(found.x)


def estimated_delay(simulated: Series, measured: Series) -> tuple[float, float] | None:
    """Return how late a measured signal is where it differs least from a simulated one.

    Returns
    -------
    The delay [s], within `LONGEST_DELAY`, and the share of the RMSE that is left with it; None if
    the signals overlap too little to tell.
    """
    start = max(simulated.time[0], measured.time[0]) + LONGEST_DELAY
    end = min(simulated.time[-1], measured.time[-1]) - LONGEST_DELAY
    if end - start < 2.0 * LONGEST_DELAY:
        return None
    step = max(DELAY_STEP, (end - start) / MAX_DELAY_SAMPLES)
    time = np.arange(start, end, step)
    wanted = np.interp(time, measured.time, measured.value)
    lags = np.arange(-round(LONGEST_DELAY / step), round(LONGEST_DELAY / step) + 1)
    shifted = (
        np.interp(time - lag * step, simulated.time, simulated.value) - wanted for lag in lags
    )
    errors = np.array([float(np.sqrt(np.mean(difference**2))) for difference in shifted])
    undelayed, best = errors[len(lags) // 2], int(errors.argmin())
    if undelayed == 0.0:
        return 0.0, 1.0
    fine = 0.0
    if 0 < best < len(lags) - 1:
        before, at, after = errors[best - 1 : best + 2]
        curvature = before - 2.0 * at + after
        fine = 0.5 * (before - after) / curvature if curvature > 0.0 else 0.0
    return float((lags[best] + fine) * step), float(errors[best] / undelayed)


def _convolved(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the whole convolution, shape (n + m - 1,); `scipy.signal` takes 30 MB to import."""
    size = len(a) + len(b) - 1
    return np.fft.irfft(np.fft.rfft(a, size) * np.fft.rfft(b, size), size)


def _range(recording: Recording) -> tuple[float, float]:
    times = [series.time for series in recording.signals.values()]
    return min(float(t[0]) for t in times), max(float(t[-1]) for t in times)


def _length(series: Series) -> float:
    return float(series.time[-1] - series.time[0])


def _even(series: Series, step: float) -> FloatArray:
    grid = np.arange(series.time[0], series.time[-1] + 0.5 * step, step)
    return np.interp(grid, series.time, series.value)


def _travel_rmse(moved: Recording, experiment: Recording) -> float | None:
    if "travel" not in moved.signals or "travel" not in experiment.signals:
        return None
    return _rmse(moved["travel"], experiment["travel"])


def _rmse(a: Series, b: Series) -> float:
    """Root mean square difference where both are known; infinite if that is nowhere."""
    common = b.between(float(a.time[0]), float(a.time[-1]))
    if not len(common.time):
        return np.inf
    difference = np.interp(common.time, a.time, a.value) - common.value
    return float(np.sqrt(np.mean(difference**2)))
