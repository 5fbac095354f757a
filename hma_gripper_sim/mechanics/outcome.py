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
        super().__init__(outcome, time)

    def __str__(self) -> str:
        return f"{self.outcome.value} at t = {self.time:.6g} s: {self.outcome.remedy}"


class ToleranceWarning(UserWarning):
    """A run whose estimated error is beyond its tolerance, whatever smaller steps did.

    Attributes
    ----------
    excess
        Estimated error relative to the tolerance.
    """

    def __init__(self, excess: float) -> None:
        self.excess = excess
        super().__init__(excess)

    def __str__(self) -> str:
        return (
            f"the error is estimated as {self.excess:.2g} times the tolerance: the scene makes "
            "small errors grow by more than smaller steps could make up for"
        )


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
        Of all steps.
    repeats
        Runs before this one, of the half with the most, that were not accurate enough.
    estimated_error
        Of the run: root mean square of the actuator force relative to its largest magnitude, or
        of the angles of the beams [rad], whichever is larger.  It is the embedded estimates of
        the steps carried to the end of the run by its linearisation, of the worse half.
    tolerance
        What was asked of it.
    wall_time
        [s]
    """

    outcome: Outcome
    steps: int
    rejected: int
    newton_iterations: int
    repeats: int
    estimated_error: float
    tolerance: float
    wall_time: float

    @property
    def excess(self) -> float:
        """Estimated error relative to the tolerance."""
        return self.estimated_error / self.tolerance

    @property
    def converged(self) -> bool:
        """Whether the whole motion was simulated."""
        return self.outcome is Outcome.CONVERGED
