"""Only what a scene needs: how fine a model an asked accuracy takes, and why.

The model's error is estimated from the design alone, before anything is simulated: a node changes
the object under a gripper and steps in ticks, so neither object nor motion may decide.  The hardest
that contact does to a gripper is to thrust a side beam along its axis, held at the tip by friction,
until it buckles.  Force and shape are then those of a column, clamped at one end and pinned at
the other, and wrong by as much as its buckling load, 20.19 E I / l^2, is: by its `column_error`.
Gentler scenes are closer to the continuum by one to three orders of magnitude, and a finer model
costs less than a second run that would tell them apart.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hma_gripper_sim.mechanics.discretisations.base import Discretisation
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.model.gripper import GripperDesign

# The top beam's error acts on the tip as its length times the square of the angle that it turns by,
# which is itself proportional to its length; relative to the side beam:
TOP_ORDER = 3
# Of the accuracy that the estimate may take.  Where a beam snaps through or a tip falls off an
# edge, at a time that depends on the model, errors were mostly up to four times the estimate.
# They are independent of the time stepping's: the squares add, and little is taken from that.
MODEL_SHARE = 0.25
LEAST_STEPPING_SHARE = 0.5  # where a given model is too coarse, finer steps are no help
DEFAULT = 0.1  # accuracy that GBEs are chosen for when neither it nor they are given


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
    """Discretisation of the gripper and GBEs of half the top beam and of a side beam.

    `model_error` estimates the error of force, relative to its largest, and of angles [rad],
    against the continuum: that of the load that buckles a beam.
    """

    discretisation: str
    elements_top: int
    elements_beam: int
    model_error: float = field(compare=False)
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
    scheme = DISCRETISATIONS[kind]
    usual = scheme.usual_elements(design, accuracy is not None)
    counts, errors = [], []
    top_weight = (design.top_length / design.beam_length) ** TOP_ORDER
    for part, (subject, given, weight, of_part) in enumerate(
        (
            ("elements_top", elements_top, top_weight, scheme.of_top_beam()),
            ("elements_beam", elements_beam, 1.0, scheme),
        )
    ):
        if given is not None:
            count, why = given, "given"
        elif usual is not None:
            count, why = usual[0][part], usual[1]
        else:
            count, why = _elements(scheme, weight, accuracy)
        coefficient, order = of_part.column_error
        errors.append(weight * coefficient / count**order)
        counts.append(count)
        choices.append(Choice(subject, str(count), why))
    error = max(errors)
    choices.append(
        Choice(
            "model error",
            f"{100 * error:.2g} %",
            "estimated: that of the load that buckles a beam",
        )
    )
    if accuracy is not None:
        choices.append(
            Choice(
                "tolerance",
                f"{100 * stepping_tolerance(accuracy, error):.2g} %",
                "what the model's error leaves of the accuracy to the time stepping",
            )
        )
    return Resolution(kind, counts[0], counts[1], error, tuple(choices))


def stepping_tolerance(accuracy: float, model_error: float) -> float:
    """What a model's error leaves of the accuracy to the time stepping."""
    left = math.sqrt(max(0.0, accuracy**2 - model_error**2))
    return max(left, LEAST_STEPPING_SHARE * accuracy)


def _elements(scheme: Discretisation, weight: float, accuracy: float | None) -> tuple[int, str]:
    """How many GBEs a part takes whose error counts by a weight, and why."""
    wanted = MODEL_SHARE * (DEFAULT if accuracy is None else accuracy)
    coefficient, order = scheme.column_error
    count = math.ceil((weight * coefficient / wanted) ** (1.0 / order) - 1e-9)
    if count <= scheme.fewest:
        return scheme.fewest, "the fewest that bend as a beam does"
    if accuracy is None:
        return count, f"the default of the {scheme.name} discretisation"
    return count, f"for {100 * wanted:.2g} % of a beam's buckling load"


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
