"""Only what a scene needs: how fine a model an asked accuracy takes, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hma_gripper_sim.design import GripperDesign

# Lengths of GBEs, as shares of half the gripper's flexible length, with which the actuator force
# is within an accuracy of the converged continuum (RMS over a run, relative to its largest), and
# the orders at which the error falls from there.  For ``gauss`` this holds for the hardest of the
# scenes that were tried, a beam bent by a radian and close to buckling.
GAUSS_ELEMENT, GAUSS_ACCURACY, GAUSS_ORDER = 0.21, 1e-3, 4.0
GAUSS_FEWEST = 2  # a single GBE bends as a beam does under one kind of load only
MIDPOINT_ELEMENT = {"elements_top": 0.0655, "elements_beam": 0.081}
MIDPOINT_ACCURACY, MIDPOINT_ORDER = 0.01, 2.0
MIDPOINT_DEFAULT = {"elements_top": 2, "elements_beam": 8}


@dataclass(frozen=True)
class Choice:
    """One decision about how a scene is simulated.

    Parameters
    ----------
    subject
        What was decided.
    value
        What it was decided to be.
    reason
        Why.
    """

    subject: str
    value: str
    reason: str


@dataclass(frozen=True)
class Resolution:
    """Discretisation of the gripper and GBEs of half the top beam and of a side beam."""

    discretisation: str
    elements_top: int
    elements_beam: int
    choices: tuple[Choice, ...] = field(compare=False)


def choose_resolution(
    design: GripperDesign,
    accuracy: float | None,
    discretisation: str | None,
    elements_top: int | None,
    elements_beam: int | None,
) -> Resolution:
    """Settle what was left open (None); what was given stays."""
    if discretisation is not None:
        kind, why = discretisation, "given"
    elif accuracy is None:
        kind, why = "thesis", "the default"
    else:
        kind, why = "gauss", "fourth order: the fewest GBEs for an accuracy"
    choices = [Choice("discretisation", kind, why)]
    total = design.top_length + design.beam_length
    counts = []
    for subject, given, length, of_design in (
        ("elements_top", elements_top, design.top_length, design.top_elements),
        ("elements_beam", elements_beam, design.beam_length, design.beam_elements),
    ):
        if given is not None:
            count, why = given, "given"
        elif kind == "thesis":
            count, why = of_design, "as in the design"
        elif kind == "gauss":
            count, why = _gauss_elements(length / total, accuracy)
        else:
            count, why = _midpoint_elements(subject, length / total, accuracy)
        counts.append(count)
        choices.append(Choice(subject, str(count), why))
    return Resolution(kind, counts[0], counts[1], tuple(choices))


def _gauss_elements(share: float, accuracy: float | None) -> tuple[int, str]:
    """How many GBEs a share of the flexible length takes, and why."""
    wanted = GAUSS_ACCURACY if accuracy is None else min(GAUSS_ACCURACY, accuracy)
    longest = GAUSS_ELEMENT * (wanted / GAUSS_ACCURACY) ** (1.0 / GAUSS_ORDER)
    count = max(GAUSS_FEWEST, math.ceil(share / longest - 1e-9))
    if count == GAUSS_FEWEST:
        return count, "the fewest that bend as a beam does under any load"
    return count, f"for {100 * wanted:.2g} % of the force"


def _midpoint_elements(subject: str, share: float, accuracy: float | None) -> tuple[int, str]:
    if accuracy is None:
        return MIDPOINT_DEFAULT[subject], "the default of the midpoint discretisation"
    longest = MIDPOINT_ELEMENT[subject] * (accuracy / MIDPOINT_ACCURACY) ** (1.0 / MIDPOINT_ORDER)
    count = max(1, math.ceil(share / longest - 1e-9))
    return count, f"for {100 * accuracy:.2g} % of the force"


def explain_stepping(asymmetry: str | None) -> tuple[Choice, ...]:
    """Choices of the time stepping; `asymmetry` says why both halves are stepped, if so."""
    if asymmetry is None:
        halves = Choice("halves", "1", "object and command are mirror symmetric")
    else:
        halves = Choice("halves", "2", asymmetry)
    return (
        halves,
        Choice(
            "inertia",
            "kept",
            "leaving it out would save nothing: its tangent rides on the same sweeps",
        ),
        Choice(
            "contact",
            "when in reach",
            "candidates that are seen at a glance to be outside are not measured",
        ),
    )
