"""Only what a scene needs: how fine a model an asked accuracy takes, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hma_gripper_sim.design import GripperDesign

# The midpoint discretisation's error falls with the square of the GBEs' length.  With these
# lengths, relative to half the gripper's flexible length, the actuator force is within 1 %
# (RMS over a run, relative to its largest) of a model with 40 + 200 GBEs per half.
REFERENCE_ACCURACY = 0.01
TOP_ELEMENT, BEAM_ELEMENT = 0.0655, 0.081


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
        kind, why = "midpoint", "second order: the fewest GBEs for an accuracy"
    choices = [Choice("discretisation", kind, why)]
    total = design.top_length + design.beam_length
    counts = []
    for subject, given, length, relative, of_design, plain in (
        ("elements_top", elements_top, design.top_length, TOP_ELEMENT, design.top_elements, 2),
        ("elements_beam", elements_beam, design.beam_length, BEAM_ELEMENT, design.beam_elements, 8),
    ):
        if given is not None:
            count, why = given, "given"
        elif kind == "thesis":
            count, why = of_design, "as in the design"
        elif accuracy is None:
            count, why = plain, "the default of the midpoint discretisation"
        else:
            longest = relative * total * math.sqrt(accuracy / REFERENCE_ACCURACY)
            count = max(1, math.ceil(length / longest - 1e-9))
            why = f"GBEs of at most {1e3 * longest:.2g} mm for {100 * accuracy:.2g} % of the force"
        counts.append(count)
        choices.append(Choice(subject, str(count), why))
    return Resolution(kind, counts[0], counts[1], tuple(choices))


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
