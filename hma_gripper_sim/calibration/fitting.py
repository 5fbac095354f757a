"""Weighted least squares: values, standard errors and correlations.

Each signal is weighted by its uncertainty. Where that is not stated it is estimated: a first fit
weights every signal by its range, and the scatter that is left is the uncertainty of the second.

The covariance of the result is the sandwich H⁻¹ (Σ cᵢ Jᵢᵀ Jᵢ) H⁻¹ with the weighted Jacobian Jᵢ of
signal i and H = Σ Jᵢᵀ Jᵢ. cᵢ is the variance of the signal's weighted residuals times their
integrated autocorrelation time τᵢ: of n samples only n / τᵢ count as independent, so that sampling
a log faster, or a slow drift, does not make the result look more certain than it is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hma_gripper_sim.calibration.free_parameters import FreeParameter
from hma_gripper_sim.calibration.observations import Observation, Trial
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.recordings.recording import FloatArray

DIFFERENCE = 2e-3
"""Step of the central differences, relative to a parameter's scale."""

HOPELESS = 1e3
"""Weighted residual of parameters that cannot be simulated."""

FEW = 10
"""Samples from which on their scatter says something about their uncertainty."""

INSEPARABLE = 1e-5
"""Singular value of the Jacobian, relative to the largest, below which there is only rounding."""

AT_BOUND = 1e-3
"""Of the distance between the bounds: nearer to one of them a value is taken to be held by it."""

WINDOW = 5.0
"""Autocorrelation times over which correlations are summed up (A. Sokal, 1989)."""

Progress = Callable[[int, float], None]


@dataclass(frozen=True)
class Fitted:
    """One parameter that was found.

    Attributes
    ----------
    free
        What it is, and where the search began.
    value, standard_error
        [SI]
    """

    free: FreeParameter
    value: float
    standard_error: float

    @property
    def at_bound(self) -> bool:
        """Whether a bound holds it: the best value may lie beyond, and the error says nothing."""
        room = AT_BOUND * (self.free.upper - self.free.lower)
        return not self.free.lower + room <= self.value <= self.free.upper - room


@dataclass(frozen=True)
class SignalFit:
    """How well one signal is met.

    Attributes
    ----------
    name
        Of the signal.
    count
        Samples.
    rmse_before, rmse_after
        With the start values, and with those found [SI].
    autocorrelation
        Samples that count as one, τ.
    """

    name: str
    count: int
    rmse_before: float
    rmse_after: float
    autocorrelation: float


@dataclass(frozen=True)
class Calibration:
    """The result.

    Attributes
    ----------
    parameters
        In the order in which they were asked for.
    correlation
        Of their errors, shape (p, p).
    signals
        How well each is met.
    simulations
        How many it took.
    converged
        Whether the search ended by itself.
    """

    parameters: tuple[Fitted, ...]
    correlation: FloatArray
    signals: tuple[SignalFit, ...]
    simulations: int
    converged: bool


def calibrate(
    scene: Scene,
    trial: Trial,
    free: Sequence[FreeParameter],
    progress: Progress = lambda count, error: None,
) -> Calibration:
    """Find the parameters for which a scene follows an experiment best.

    Parameters
    ----------
    scene
        With the start values.
    trial
        What was measured.
    free
        What is to be found.
    progress
        Called after every simulation with their number and the present weighted RMS residual.

    Raises
    ------
    InputError
        There are fewer measurements than free parameters, or one of these has no effect.
    SimulationError
        The scene cannot be simulated as it is.
    """
    count = sum(len(observation.time) for observation in trial.observations)
    if count < len(free):
        raise InputError(f"{count} measurements cannot tell {len(free)} parameters", field="--free")
    problem = _Problem(scene, trial, free, progress)
    before = trial.simulate(scene)
    if before is None:
        raise SimulationError(Outcome.STEP_TOO_SMALL, 0.0)
    weights = [_first_weight(observation) for observation in trial.observations]
    solution = problem.solve(weights, problem.start)
    if any(observation.uncertainty is None for observation in trial.observations):
        rest = problem.residuals(solution.x, weights)
        weights = [
            weight / max(_rms(part), 1e-9) if observation.uncertainty is None else weight
            for observation, weight, part in zip(trial.observations, weights, rest, strict=True)
        ]
        solution = problem.solve(weights, solution.x)
    residuals = problem.residuals(solution.x, weights)
    covariance, times = _covariance(solution.jac, residuals, trial.observations, free)
    scales = np.array([parameter.scale for parameter in free])
    errors = scales * np.sqrt(np.diag(covariance))
    spread = np.sqrt(np.diag(covariance))
    return Calibration(
        tuple(
            Fitted(parameter, float(value), float(error))
            for parameter, value, error in zip(free, scales * solution.x, errors, strict=True)
        ),
        covariance / np.outer(spread, spread),
        tuple(
            SignalFit(
                observation.name,
                len(observation.time),
                _rms(simulated - observation.value),
                _rms(part / weight),
                float(time),
            )
            for observation, simulated, part, weight, time in zip(
                trial.observations, before, residuals, weights, times, strict=True
            )
        ),
        problem.simulations,
        bool(solution.success),
    )


class _Problem:
    """Residuals as a function of the scaled parameters."""

    def __init__(
        self, scene: Scene, trial: Trial, free: Sequence[FreeParameter], progress: Progress
    ) -> None:
        self._scene, self._trial, self._free, self._progress = scene, trial, free, progress
        self._scales = np.array([parameter.scale for parameter in free])
        self.start = np.array([parameter.start for parameter in free]) / self._scales
        self.simulations = 0

    def residuals(self, x: FloatArray, weights: Sequence[FloatArray]) -> list[FloatArray]:
        """Weighted residuals of each observation."""
        scene = self._scene
        for parameter, value in zip(self._free, self._scales * x, strict=True):
            scene = parameter.parameter.put(scene, float(value))
        simulated = self._trial.simulate(scene)
        self.simulations += 1
        if simulated is None:
            return [np.full(len(o.time), HOPELESS) for o in self._trial.observations]
        parts = [
            weight * (ours - observation.value)
            for ours, weight, observation in zip(
                simulated, weights, self._trial.observations, strict=True
            )
        ]
        self._progress(self.simulations, _rms(np.concatenate(parts)))
        return parts

    def solve(self, weights: Sequence[FloatArray], x: FloatArray) -> Any:
        """Minimise the weighted squares from `x` on; scipy's result, `x` scaled."""
        bounds = np.array([(p.lower, p.upper) for p in self._free]).T / self._scales
        room = 1e-6 * (bounds[1] - bounds[0])
        return least_squares(
            lambda x: np.concatenate(self.residuals(x, weights)),
            np.clip(x, bounds[0] + room, bounds[1] - room),
            jac="3-point",
            bounds=bounds,
            x_scale="jac",
            # scipy multiplies by |x|, which is near 1 unless a parameter is near 0.
            diff_step=DIFFERENCE / np.maximum(np.abs(x), 0.1),
            xtol=1e-6,
            ftol=1e-8,
            gtol=1e-10,
        )


def _first_weight(observation: Observation) -> FloatArray:
    if observation.uncertainty is not None:
        return 1.0 / observation.uncertainty
    range_ = float(np.ptp(observation.value)) or float(np.abs(observation.value).max()) or 1.0
    return np.full(len(observation.time), 1.0 / range_)


def _covariance(
    jacobian: FloatArray,
    residuals: Sequence[FloatArray],
    observations: Sequence[Observation],
    free: Sequence[FreeParameter],
) -> tuple[FloatArray, list[float]]:
    """Covariance of the scaled parameters, and the autocorrelation time of each signal."""
    sizes = np.linalg.norm(jacobian, axis=0)
    for parameter, size in zip(free, sizes, strict=True):
        if size <= 1e-9 * sizes.max():
            raise InputError(
                f"{parameter.parameter.name} has no effect on what was measured", field="--free"
            )
    directions = np.linalg.svd(jacobian / sizes, compute_uv=False)
    if directions[-1] <= INSEPARABLE * directions[0]:
        raise InputError("what was measured cannot tell the parameters apart", field="--free")
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    total = sum(len(part) for part in residuals)
    freedom = total / max(1, total - len(free))
    middle = np.zeros_like(inverse)
    times = []
    first = 0
    for part, observation in zip(residuals, observations, strict=True):
        rows = jacobian[first : first + len(part)]
        first += len(part)
        time = autocorrelation_time(part) if len(part) >= FEW else 1.0
        times.append(time)
        variance = freedom * _rms(part) ** 2
        if observation.uncertainty is not None:
            variance = max(1.0, variance) if len(part) >= FEW else 1.0
        middle += variance * time * rows.T @ rows
    return inverse @ middle @ inverse, times


def autocorrelation_time(values: FloatArray) -> float:
    """Return how many samples count as one: 1 + 2 Σ ρₖ, at least 1.

    The sum over lags k ends where it has got over `WINDOW` times its own value.
    """
    centred = values - values.mean()
    size = len(centred)
    spectrum = np.fft.rfft(centred, 2 * size)
    covariance = np.fft.irfft(spectrum * spectrum.conj())[:size]
    if covariance[0] <= 0.0:
        return 1.0
    times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    window = np.arange(size) >= WINDOW * times
    end = int(np.argmax(window)) if window.any() else size - 1
    return max(1.0, float(times[end]))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
