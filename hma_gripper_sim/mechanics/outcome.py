"""How a simulation ended, and what to do when it did not end well."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Outcome(Enum):
    """Result of a solve; ``remedy`` says what to change when it is not ``CONVERGED``."""

    CONVERGED = "converged"
    STEP_TOO_SMALL = "the step size fell below its limit without convergence"
    NOT_FINITE = "the state became infinite"
    NO_EQUILIBRIUM = "no static equilibrium was found"

    @property
    def remedy(self) -> str:
        """What to do about it, in one sentence."""
        return _REMEDIES[self]


_REMEDIES = {
    Outcome.CONVERGED: "nothing to do",
    Outcome.STEP_TOO_SMALL: (
        "loosen the tolerance, lower the contact stiffness, or set a small slip_velocity "
        "(1e-6 m/s) in the scene"
    ),
    Outcome.NOT_FINITE: "check the design's masses and stiffnesses and the commanded velocity",
    Outcome.NO_EQUILIBRIUM: (
        "make the beams stiffer (Young's modulus, width) so that they carry the gripper's weight, "
        "or raise the clearance so that the gripper hangs freely at the start"
    ),
}


class SimulationError(RuntimeError):
    """A step or an equilibrium that could not be computed.

    Attributes
    ----------
    outcome
        Its name and remedy.
    time
        Simulated time reached [s].
    """

    def __init__(self, outcome: Outcome, time: float) -> None:
        self.outcome = outcome
        self.time = time
        super().__init__(f"{outcome.value} at t = {time:.6g} s: {outcome.remedy}")


@dataclass(frozen=True)
class SolverStats:
    """What a run cost and how it ended.

    Parameters
    ----------
    outcome
        How it ended.
    steps, rejected
        Accepted and rejected time steps, of all halves that were stepped.
    newton_iterations
        Of all accepted steps.
    wall_time
        [s]
    """

    outcome: Outcome
    steps: int
    rejected: int
    newton_iterations: int
    wall_time: float

    @property
    def converged(self) -> bool:
        """Whether the whole motion was simulated."""
        return self.outcome is Outcome.CONVERGED
