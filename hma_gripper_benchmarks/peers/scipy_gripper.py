"""scipy's stiff ODE solvers on the equations of `benchmark.dense`, one half.

The right-hand side is compiled and the Jacobian analytic; each phase of constant velocity
is integrated by itself, so that no step crosses a jump.  The friction law is the regularised
one, because an ODE solver knows no other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from hma_gripper_benchmarks.dense import (
    RIGHT,
    Equations,
    base_load,
    equations,
    jacobian,
    rates,
)
from hma_gripper_benchmarks.measuring import Candidate
from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD, Task
from hma_gripper_benchmarks.series import Series, from_joints

Array = NDArray[np.float64]

STICKING_SLIP = 1e-6  # m/s; where the friction of the task is set-valued
STICKING_TOLERANCE = 1e-4
SETTINGS = (("Radau", 1e-3), ("BDF", 1e-4))
FULL_SETTINGS = (("Radau", 1e-3), ("Radau", 1e-5), ("BDF", 1e-4), ("BDF", 1e-6))


class OdeError(RuntimeError):
    """The ODE solver gave up."""


def candidates(task: Task, full: bool) -> list[Candidate]:
    """Radau and BDF at several tolerances."""
    settings: tuple[tuple[str, float], ...] = FULL_SETTINGS if full else SETTINGS
    if task.scene.slip_velocity == 0.0:  # sticking needs a tighter tolerance than sliding
        settings = tuple(setting for setting in settings if setting[1] <= STICKING_TOLERANCE)
    return [candidate(task, *setting) for setting in settings]


def candidate(
    task: Task, method: str, tolerance: float, sample_period: float = SAMPLE_PERIOD
) -> Candidate:
    """One method at one relative and absolute tolerance."""
    scene = task.scene
    slip_velocity = scene.slip_velocity or STICKING_SLIP
    system = equations(scene, slip_velocity)
    rest = scene.start_states[RIGHT].q

    def run() -> tuple[Array, Array, Array]:
        return integrate(task, system, rest, method, tolerance, sample_period)

    def series(raw: tuple[Array, Array, Array]) -> Series:
        time, states, load = raw
        n = len(system.rest)
        q = joint_angles(system, states)
        v = np.diff(states[:, n:], axis=1, prepend=0.0)
        force = 2.0 * load - scene.half.middle_mass * scene.gravity
        return from_joints(scene, time, force, q, v)

    setting = f"{method}, tolerance {tolerance:.0e}"
    if scene.slip_velocity == 0.0:
        setting += f", slip velocity {slip_velocity:.0e} m/s"
    return Candidate("scipy, one half", setting, run, series)


@dataclass(frozen=True)
class Phase:
    """The equations while the base moves at a constant velocity."""

    system: Equations
    start: float  # s
    travel: float  # m, at the start
    velocity: float  # m/s

    def height(self, t: float) -> float:
        """Of the base [m]."""
        return -(self.travel + self.velocity * (t - self.start))

    def rates(self, t: float, state: Array) -> Array:
        """Time derivative of the state."""
        return rates(self.system, self.height(t), -self.velocity, state)

    def jacobian(self, t: float, state: Array) -> Array:
        """Derivative of the rates to the state."""
        return jacobian(self.system, self.height(t), -self.velocity, state)


def joint_angles(system: Equations, states: Array) -> Array:
    """Relative angles, zero when stress-free, of rows of states [rad], shape (n_rows, n)."""
    n = len(system.rest)
    return np.asarray(np.diff(states[:, :n], axis=1, prepend=0.0) - system.rest)


def integrate(
    task: Task,
    system: Equations,
    rest: Array,
    method: str,
    tolerance: float,
    sample_period: float,
) -> tuple[Array, Array, Array]:
    """Solve a task for one half.

    Parameters
    ----------
    rest
        Joint angles at the start [rad], shape (n,).
    tolerance
        Relative and absolute.

    Returns
    -------
    time, states, load
        At the samples, shapes (n_samples,), (n_samples, 2 n) and (n_samples,) [s, rad and
        rad/s, N].

    Raises
    ------
    OdeError
        The solver gave up.
    """
    n = len(rest)
    state = np.concatenate([np.cumsum(rest + system.rest), np.zeros(n)])
    times, states = [np.zeros(1)], [state[None, :]]
    start, travel = 0.0, 0.0
    for duration, velocity in task.parts:
        phase = Phase(system, start, travel, velocity)
        wanted = start + sample_period * np.arange(1, round(duration / sample_period) + 1)
        solution = solve_ivp(
            phase.rates,
            (start, wanted[-1]),
            state,
            method,
            t_eval=wanted,
            jac=phase.jacobian,
            rtol=tolerance,
            atol=tolerance,
            max_step=0.1,
        )
        if not solution.success:
            raise OdeError(f"{method}: {solution.message}")
        times.append(solution.t)
        states.append(solution.y.T)
        state = solution.y[:, -1]
        travel += velocity * duration
        start += duration
    time, rows = np.concatenate(times), np.concatenate(states)
    return time, rows, _loads(task, system, time, rows)


def _loads(task: Task, system: Equations, time: Array, states: Array) -> Array:
    load = np.empty(len(time))
    row, start, travel = 0, 0.0, 0.0
    for duration, velocity in task.parts:
        end = start + duration
        while row < len(time) and (time[row] <= end or row == len(time) - 1):
            height = -(travel + velocity * (time[row] - start))
            load[row] = base_load(system, height, -velocity, states[row])
            row += 1
        travel += velocity * duration
        start = end
    return load
