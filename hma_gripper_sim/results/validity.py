"""Where a run leaves what its model describes: all of it in one list, `Trace.validity`."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError, ToleranceWarning
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.results.contact_warnings import PenetrationWarning, is_deep
from hma_gripper_sim.results.error_estimate import ErrorEstimate
from hma_gripper_sim.results.observation import Observed
from hma_gripper_sim.results.sampled_contour import hidden_depth, largest_spacing, smallest_width

THESIS_ERROR = (
    "over random scenes the thesis' discretisation is a median 2.2 % and at most 48 % of the force "
    "away from the continuum; accuracy=0.01 takes a model that is within 1 %"
)
"""What the first-order discretisation costs, measured against a refined ``gauss`` on 200 scenes."""


class Severity(Enum):
    """How much a finding matters."""

    NOTE = "note"  # worth knowing, the results hold
    WARNING = "warning"  # from there on the results are not to be trusted
    ERROR = "error"  # there is no result


@dataclass(frozen=True)
class Finding:
    """One thing to know about the validity of a run.

    Parameters
    ----------
    name
        Which of them it is: ``outcome``, ``tolerance``, ``unmodelled_contact``, ``penetration``,
        ``stress``, ``no_contact``, ``sampled_contour``, ``discretisation``, ``sensitive``,
        ``verification``.
    severity
        How much it matters.
    message
        One sentence with figures.
    time
        When it first was so, or was worst [s]; None where it holds for all of the run.
    """

    name: str
    severity: Severity
    message: str
    time: float | None = None

    def __str__(self) -> str:
        return f"{self.severity.value}: {self.message}"


def findings(
    scene: Scene, observed: Observed, estimate: ErrorEstimate | None = None
) -> tuple[Finding, ...]:
    """Return all there is to know about the validity of a run, what matters most first."""
    found = [*_of_run(scene, observed), *_of_scene(scene, estimate)]
    if estimate is not None:
        found += _of_estimate(estimate)
    order = list(Severity)[::-1]
    return tuple(sorted(found, key=lambda finding: order.index(finding.severity)))


def remarks(validity: tuple[Finding, ...], estimate: ErrorEstimate) -> tuple[str, ...]:
    """Return how far a verified run can be trusted, one line each."""
    return (f"estimated error of the simulation: {estimate}", *map(str, validity))


def _of_run(scene: Scene, observed: Observed) -> list[Finding]:
    found = []
    if observed.outcome is not Outcome.CONVERGED:
        text = str(SimulationError(observed.outcome, observed.end))
        found.append(Finding("outcome", Severity.ERROR, text, observed.end))
    if observed.excess > 1.0:
        text = str(ToleranceWarning(observed.excess))
        found.append(Finding("tolerance", Severity.WARNING, text))
    for touch in observed.touches:
        found.append(Finding("unmodelled_contact", Severity.WARNING, str(touch), touch.time))
    if is_deep(scene, observed.penetration):
        time = observed.penetration_time
        text = str(PenetrationWarning(scene, observed.penetration, time))
        found.append(Finding("penetration", Severity.WARNING, text, time))
    if observed.overstress_time is not None:
        text = (
            f"the material's linear range is left from t = {observed.overstress_time:.4g} s on: "
            f"the largest stress is {observed.stress_ratio:.3g} times its end"
        )
        found.append(Finding("stress", Severity.WARNING, text, observed.overstress_time))
    if not observed.touched:
        found.append(Finding("no_contact", Severity.NOTE, _missed(observed)))
    return found


def _missed(observed: Observed) -> str:
    gap = f"{1e3 * observed.nearest:.3g} mm"
    if observed.beyond <= 0.0:
        return f"the object was never touched: the tips came within {gap} of it"
    where = "between" if observed.between else "beside"
    return (
        f"the object passed {where} the tips without a touch: {1e3 * observed.beyond:.3g} mm "
        f"beyond the clearance they were {gap} off it"
    )


def _of_scene(scene: Scene, estimate: ErrorEstimate | None) -> list[Finding]:
    found = []
    if scene.contact == "sampled":
        found += _of_sampled_contour(scene)
    plain = scene.resolution.discretisation == "thesis"
    if plain and scene.design != GripperDesign.thesis_2013():
        error = THESIS_ERROR
        if estimate is not None and estimate.model_force_rms is not None:
            error += f"; here it is {100.0 * estimate.model_force_rms:.2g} %"
        text = f"this is not the design of the thesis, and {error}"
        found.append(Finding("discretisation", Severity.NOTE, text))
    return found


def _of_sampled_contour(scene: Scene) -> list[Finding]:
    spacing = largest_spacing(scene.design.tip)
    width = smallest_width(scene.contour)
    said = f"the sampled contact points are up to {1e3 * spacing:.3g} mm apart"
    if width < spacing:
        text = f"{said}: the object, {1e3 * width:.3g} mm thin, can pass between them unseen"
        return [Finding("sampled_contour", Severity.WARNING, text)]
    if 2.0 * scene.contour.core_radius < spacing:
        depth = hidden_depth(scene.contour, spacing)
        text = f"{said}: a corner of the object can sink {1e3 * depth:.3g} mm in between unseen"
        return [Finding("sampled_contour", Severity.NOTE, text)]
    return []


def _of_estimate(estimate: ErrorEstimate) -> list[Finding]:
    found = []
    if estimate.sensitive_from is not None:
        text = (
            "the object a picometre elsewhere changes the results by more than was asked from "
            f"t = {estimate.sensitive_from:.4g} s on: no tolerance helps there"
        )
        found.append(Finding("sensitive", Severity.WARNING, text, estimate.sensitive_from))
    found += [Finding("verification", Severity.WARNING, failure) for failure in estimate.failures]
    return found
