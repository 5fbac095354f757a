"""Weighted least squares: values, standard errors and correlations.

Each signal is weighted by its uncertainty. Where that is not stated it is estimated: a first fit
weights every signal by its range, and the scatter that is left is the uncertainty of the second.

The covariance of the result is the sandwich H⁻¹ (Σ cᵢ Jᵢᵀ Jᵢ) H⁻¹ with the weighted Jacobian Jᵢ of
signal i and H = Σ Jᵢᵀ Jᵢ. cᵢ is the variance of the signal's weighted residuals times their
integrated autocorrelation time τᵢ: of n samples only n / τᵢ count as independent, so that sampling
a log faster, or a slow drift, does not make the result look more certain than it is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hma_gripper_sim.calibration.free_parameters import FreeParameter
from hma_gripper_sim.calibration.observations import Observation, Simulated, Trial
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.recordings.recording import FloatArray

DIFFERENCE = 2e-3
"""Step of the central differences, relative to a parameter's scale."""

ROUGH, FINE = 1e-2, 1e-4
"""Step, relative to the parameters, with which the first and the last search end.

The first is for the scatter alone. The search converges faster than linearly: what is left after
its last step is a small part of it, and far less than any standard error.
"""

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

DELAYS = {"force_delay": ("actuator_force",), "angle_delay": ("phi_left", "phi_right")}
"""Signals that each delay is of."""

DELAY_STEP, LEAST_DELAY = 5e-3, 2e-3
"""Step of the differences with respect to a delay, and a delay that is worth a word [s]."""

TOLD = 12.0**-0.5
"""Standard error, as a share of the room between the bounds, from which on nothing is told.

It is that of a value of which nothing but the bounds is known.
"""

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

    @property
    def is_told(self) -> bool:
        """Whether the experiment says more about it than the bounds, or its order at least."""
        told = self.standard_error < TOLD * (self.free.upper - self.free.lower)
        if self.free.parameter.factor is not None:
            return told and self.standard_error < abs(self.value)
        return told


@dataclass(frozen=True)
class SignalFit:
    """How well one signal is met.

    Attributes
    ----------
    name
        Of the signal.
    count
        Samples.
    span
        Range of what was measured [SI].
    noise
        What of the samples changes from one to the next, which no model explains: standard
        deviation [SI].
    rmse_before, rmse_after
        With the start values, and with those found [SI].
    autocorrelation
        Samples that count as one, τ.
    """

    name: str
    count: int
    span: float
    noise: float
    rmse_before: float
    rmse_after: float
    autocorrelation: float


@dataclass(frozen=True)
class Direction:
    """A direction in the space of the parameters.

    Attributes
    ----------
    shares
        Of each parameter, in units of the room between its bounds; the squares sum up to 1.
    singular_value
        Of the weighted residuals' derivative with respect to them.
    standard_error
        Along it, in units of the room between the bounds.
    """

    shares: tuple[float, ...]
    singular_value: float
    standard_error: float

    @property
    def is_told(self) -> bool:
        """Whether the experiment says more than the bounds."""
        return self.standard_error < TOLD


@dataclass(frozen=True)
class Delay:
    """How late signals seem to be in the log, if that is not free itself: to first order.

    Attributes
    ----------
    name
        ``force_delay`` or ``angle_delay``.
    value, standard_error
        [s]
    moves
        By how many of its standard errors each free parameter would change with it.
    """

    name: str
    value: float
    standard_error: float
    moves: tuple[float, ...]

    @property
    def matters(self) -> bool:
        """Whether it is told, and changes what is found."""
        is_told = abs(self.value) > max(LEAST_DELAY, 3.0 * self.standard_error)
        return is_told and max(map(abs, self.moves)) > 1.0


@dataclass(frozen=True)
class Calibration:
    """The result.

    Attributes
    ----------
    parameters
        In the order in which they were asked for.
    correlation
        Of their errors, shape (p, p).
    directions
        Those that the experiment tells apart, the best told first.
    delays
        Of the signals, where they are not free.
    residual_before, residual_after
        Weighted RMS, with the start values and with those found.
    signals
        How well each is met.
    simulations
        How many it took.
    converged
        Whether the search ended by itself.
    """

    parameters: tuple[Fitted, ...]
    correlation: FloatArray
    directions: tuple[Direction, ...]
    delays: tuple[Delay, ...]
    residual_before: float
    residual_after: float
    signals: tuple[SignalFit, ...]
    simulations: int
    converged: bool

    @property
    def untold(self) -> tuple[str, ...]:
        """Names of the parameters that the experiment cannot tell."""
        return tuple(f.free.parameter.name for f in self.parameters if not f.is_told)


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
    before = problem.observed(problem.start, {})
    if before is None:
        raise SimulationError(Outcome.STEP_TOO_SMALL, 0.0)
    weights = [_first_weight(observation) for observation in trial.observations]
    estimated = any(observation.uncertainty is None for observation in trial.observations)
    solution = problem.solve(weights, problem.start, ROUGH if estimated else FINE)
    if estimated:
        rest = problem.residuals(solution.x, weights)
        weights = [
            weight / max(_rms(part), 1e-9) if observation.uncertainty is None else weight
            for observation, weight, part in zip(trial.observations, weights, rest, strict=True)
        ]
        solution = problem.solve(weights, solution.x, FINE)
    residuals = problem.residuals(solution.x, weights)
    covariance, times = _covariance(solution.jac, residuals, trial.observations, free)
    scales = np.array([parameter.scale for parameter in free])
    spread = np.sqrt(np.diag(covariance))
    weighted_before = [
        weight * (simulated - observation.value)
        for weight, simulated, observation in zip(weights, before, trial.observations, strict=True)
    ]
    return Calibration(
        tuple(
            Fitted(parameter, parameter.value(float(x)), float(error))
            for parameter, x, error in zip(free, solution.x, scales * spread, strict=True)
        ),
        covariance / np.outer(spread, spread),
        _directions(solution.jac, covariance, free),
        tuple(_delays(problem, solution, weights, residuals, spread)),
        _rms(np.concatenate(weighted_before)),
        _rms(np.concatenate(residuals)),
        tuple(
            SignalFit(
                observation.name,
                len(observation.time),
                float(np.ptp(observation.value)),
                noise(observation.value),
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
    """Residuals as a function of the scaled parameters.

    What is asked for again is not simulated again: where the second search begins, and for other
    delays and biases, with which nothing of the scene changes.
    """

    def __init__(
        self, scene: Scene, trial: Trial, free: Sequence[FreeParameter], progress: Progress
    ) -> None:
        self._scene, self._progress = scene, progress
        self.trial, self.free = trial, free
        self.start = np.ones(len(free))
        self.simulations = 0
        around = 2 * len(free) + 1  # a point, and its neighbours for the differences
        self._simulated = lru_cache(maxsize=2 * around)(self._simulate)

    def _simulate(self, values: tuple[float, ...]) -> Simulated | None:
        """Simulate the scene with values of those free parameters that are its own."""
        scene = self._scene
        for free, value in zip(self._of_scene, values, strict=True):
            scene = free.parameter.put(scene, value)
        self.simulations += 1
        return self.trial.simulate(scene)

    @property
    def _of_scene(self) -> list[FreeParameter]:
        return [free for free in self.free if free.parameter.owner != "log"]

    def observed(self, x: FloatArray, delays: Mapping[str, float]) -> list[FloatArray] | None:
        """Return each observation as the parameters give it; None if that cannot be simulated.

        Parameters
        ----------
        delays
            By name where they are not free [s].
        """
        values = {
            free.parameter.name: free.value(float(entry))
            for free, entry in zip(self.free, x, strict=True)
        }
        simulated = self._simulated(tuple(values[f.parameter.name] for f in self._of_scene))
        if simulated is None:
            return None
        return self.trial.observed(simulated, {**delays, **values})

    def residuals(
        self,
        x: FloatArray,
        weights: Sequence[FloatArray],
        delays: Mapping[str, float] = MappingProxyType({}),
    ) -> list[FloatArray]:
        """Weighted residuals of each observation; `delays` as `observed` takes them."""
        simulated = self.observed(x, delays)
        if simulated is None:
            return [np.full(len(o.time), HOPELESS) for o in self.trial.observations]
        parts = [
            weight * (ours - observation.value)
            for ours, weight, observation in zip(
                simulated, weights, self.trial.observations, strict=True
            )
        ]
        self._progress(self.simulations, _rms(np.concatenate(parts)))
        return parts

    def solve(self, weights: Sequence[FloatArray], x: FloatArray, step: float) -> Any:
        """Minimise the weighted squares from `x` on, until steps are as small as `step`.

        Returns
        -------
        scipy's result, `x` scaled.
        """
        bounds = np.array([(p.x(p.lower), p.x(p.upper)) for p in self.free]).T
        room = 1e-6 * (bounds[1] - bounds[0])
        return least_squares(
            lambda x: np.concatenate(self.residuals(x, weights)),
            np.clip(x, bounds[0] + room, bounds[1] - room),
            jac="3-point",
            bounds=bounds,
            x_scale="jac",
            # scipy multiplies by |x|, which is near 1 unless a parameter is near 0.
            diff_step=DIFFERENCE / np.maximum(np.abs(x), 0.1),
            xtol=step,
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
        names = " and ".join(parameter.parameter.name for parameter in free)
        raise InputError(
            f"what was measured cannot tell the parameters apart: {names}; leave one out",
            field="--free",
        )
    return _sandwich(jacobian, residuals, observations)


def _sandwich(
    jacobian: FloatArray, residuals: Sequence[FloatArray], observations: Sequence[Observation]
) -> tuple[FloatArray, list[float]]:
    inverse = np.linalg.inv(jacobian.T @ jacobian)
    total = sum(len(part) for part in residuals)
    freedom = total / max(1, total - jacobian.shape[1])
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


def _delays(
    problem: _Problem,
    solution: Any,
    weights: Sequence[FloatArray],
    residuals: Sequence[FloatArray],
    spread: FloatArray,
) -> Iterator[Delay]:
    """Estimate the delays that are not free: what one more step of the search would give them."""
    observations = problem.trial.observations
    names = {free.parameter.name for free in problem.free}
    for name, signals in DELAYS.items():
        if name in names or not any(len(o.time) >= FEW for o in observations if o.name in signals):
            continue
        later, earlier = (
            np.concatenate(problem.residuals(solution.x, weights, {name: side * DELAY_STEP}))
            for side in (1.0, -1.0)
        )
        column = (later - earlier) / (2.0 * DELAY_STEP)
        jacobian = np.column_stack([solution.jac, column])
        sizes = np.linalg.norm(jacobian, axis=0)
        if np.linalg.cond(jacobian / np.where(sizes > 0.0, sizes, 1.0)) > 1.0 / INSEPARABLE:
            continue
        step = np.linalg.lstsq(jacobian, -np.concatenate(residuals), rcond=None)[0]
        covariance, _ = _sandwich(jacobian, residuals, observations)
        yield Delay(
            name,
            float(step[-1]),
            float(np.sqrt(covariance[-1, -1])),
            tuple((step[:-1] / spread).tolist()),
        )


def _directions(
    jacobian: FloatArray, covariance: FloatArray, free: Sequence[FreeParameter]
) -> tuple[Direction, ...]:
    """Directions in units of the room between the bounds, the best told first."""
    rooms = np.array([(p.upper - p.lower) / p.scale for p in free])
    _, values, rows = np.linalg.svd(jacobian * rooms, full_matrices=False)
    scaled = covariance / np.outer(rooms, rooms)
    return tuple(
        Direction(
            tuple((row * np.sign(row[np.abs(row).argmax()])).tolist()),
            float(value),
            float(np.sqrt(row @ scaled @ row)),
        )
        for value, row in zip(values, rows, strict=True)
    )


def noise(values: FloatArray) -> float:
    """Return the standard deviation of white noise on a smooth course; 0 for few values."""
    if len(values) < FEW:
        return 0.0
    # Of white noise of unit deviation the second difference has √6; the median is no outlier's.
    return float(np.median(np.abs(np.diff(values, 2))) / (0.6745 * np.sqrt(6.0)))


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
