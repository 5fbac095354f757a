"""Runs of the same motion beside a run, whose differences from it show its error.

``verify=True`` repeats a run three times beside it (`Companions`):

tighter
    At a tolerance smaller by `TIGHTER`.  The error of a second-order method is proportional to
    its tolerance, so that the difference is all of the run's error but 1 / `TIGHTER` of it.
moved
    At the run's own tolerance, with the object a picometre elsewhere.  Where that alone
    changes the result by more than was asked, the scene is sensitive: no tolerance helps.
refined
    At the run's own tolerance with a finer ``gauss`` discretisation: the error of the model.
    Its start pose is its own, so only a run from the start pose is repeated with it.

Together with the run itself they take less than six times its CPU time: the tighter run
sqrt(`TIGHTER`) times as many steps, the other two about one run each.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.kernels.integrator import COARSEST
from hma_gripper_sim.mechanics.outcome import SimulationError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.results.error_estimate import (
    TIGHTER,
    ErrorEstimate,
    Samples,
    Spread,
    estimate_error,
)

if TYPE_CHECKING:
    from hma_gripper_sim.simulation.simulation import Simulation
    from hma_gripper_sim.simulation.trace import Trace

MOVE = (1e-12, 1e-12)
"""Displacement (x, z) of the object in the moved run [m], outwards in the frame of each half.

Mirror images move to opposite sides, so that a symmetric scene stays one.
"""

REFINED = (3, 6)
"""GBEs of half the top beam and of a side beam in the refined model, if the run's has no more.

In ``gauss`` they are within 1e-4 of the converged force unless the beams come close to buckling.
"""

MORE = (1, 2)
"""GBEs that the refined model of a ``gauss`` scene has more, at least."""


class Companions:
    """The runs beside a simulation that show its error, at any time at the same instant.

    Parameters
    ----------
    simulation
        Where it stands now, they start; it is not touched.
    series
        Whether to keep the error at every sample.
    """

    def __init__(self, simulation: Simulation, series: bool = False) -> None:
        self._tolerance = min(simulation.tolerance, COARSEST)
        self._failures: dict[str, str] = {}
        self._runs: dict[str, Simulation] = {
            "tighter": simulation.twin(tolerance=self._tolerance / TIGHTER),
            "moved": simulation.twin(move=MOVE),
        }
        if simulation.at_start:
            try:
                self._runs["refined"] = simulation.twin(scene=refined_scene(simulation.scene))
            except SimulationError as error:
                self._failures["refined"] = str(error)
        self._largest = 0.0
        self._spreads = {name: Spread(series and name == "tighter") for name in self._runs}

    def advance_along(self, motion: Motion, trace: Trace, kept: slice = slice(None)) -> None:
        """Follow a stretch of the motion, of which `trace` is the run's own result.

        Parameters
        ----------
        kept
            Samples of the trace that are new.
        """
        plain = _samples(trace, kept)
        self._largest = max(self._largest, float(np.abs(plain.force).max(initial=0.0)))
        tighter = plain
        for name, run in self._runs.items():
            if name in self._failures:
                continue
            result = run.solve_along(motion, trace.sample_period)
            samples = _samples(result, kept)
            self._spreads[name].add(tighter if name == "refined" else plain, samples)
            if name == "tighter":
                tighter = samples
            if not result.stats.converged:
                end = float(result.time[-1])
                self._failures[name] = str(SimulationError(result.stats.outcome, end))

    def estimate(self) -> ErrorEstimate:
        """Return what the runs so far show."""
        failures = (f"the {name} run ended early: {why}" for name, why in self._failures.items())
        return estimate_error(self._spreads, self._largest, self._tolerance, tuple(failures))


def refined_scene(scene: Scene) -> Scene:
    """Return the scene with a finer ``gauss`` model."""
    has = scene.resolution
    counts = REFINED
    if has.discretisation == "gauss":
        counts = (
            max(REFINED[0], has.elements_top + MORE[0]),
            max(REFINED[1], has.elements_beam + MORE[1]),
        )
    return scene.rediscretised("gauss", *counts)


def _samples(trace: Trace, kept: slice) -> Samples:
    angles = np.column_stack([trace.phi_right, trace.phi_left])
    return Samples(trace.time[kept], trace.actuator_force[kept], angles[kept])
