"""The errors that a comparison may have, for a program to judge it by."""

from __future__ import annotations

from dataclasses import dataclass

from hma_gripper_sim.comparison.coverage import ENOUGH, Coverage
from hma_gripper_sim.comparison.signal_errors import QUANTITIES
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.units import quantity

ALIASES = {"phi": "phi_mean", "force": "actuator_force"}


@dataclass(frozen=True)
class Bound:
    """The largest error that a signal may have anywhere.

    Attributes
    ----------
    name
        Of the signal.
    limit
        [SI], or relative to the largest magnitude of the experiment's signal.
    relative
        Which of both.
    """

    name: str
    limit: float
    relative: bool

    @property
    def text(self) -> str:
        """The limit, in words."""
        shown = QUANTITIES[self.name]
        if self.relative:
            return f"{100.0 * self.limit:g} %"
        return f"{self.limit * shown.shown_per_si:g} {shown.shown_unit}"


@dataclass(frozen=True)
class Verdict:
    """A bound, and what was found.

    Attributes
    ----------
    bound
        What is allowed.
    largest
        Error that was found [SI, or relative].
    coverage
        How much of the measured signal was compared; None where it was measured at instants.
    least
        Share of it that has to be covered for the bound to be judged.
    """

    bound: Bound
    largest: float
    coverage: Coverage | None = None
    least: float = ENOUGH

    @property
    def covers(self) -> bool:
        """Whether enough was compared to judge by."""
        return self.coverage is None or self.coverage.is_enough(self.least)

    @property
    def inside(self) -> bool:
        """Whether the bound is kept (NaN never is), wherever the signal was measured."""
        return self.largest <= self.bound.limit and self.covers

    def cells(self) -> tuple[str, ...]:
        """Return it as text, as `BOUND_HEADINGS` names it."""
        shown = QUANTITIES[self.bound.name]
        found = f"{self.largest * shown.shown_per_si:.3g} {shown.shown_unit}"
        if self.bound.relative:
            found = f"{100.0 * self.largest:.3g} %"
        covered, gap = "", ""
        if self.coverage is not None:
            covered = f"{100.0 * self.coverage.share:.3g} %"
            gap = f"{self.coverage.largest_gap:.3g} s"
        verdict = "yes" if self.inside else "NO"
        if not self.covers:
            verdict = "NO: not covered"
        return self.bound.name, self.bound.text, found, covered, gap, verdict


BOUND_HEADINGS = ("signal", "largest error allowed", "found", "covered", "largest gap", "inside")


def read_bound(text: str) -> Bound:
    """Read a bound such as ``phi=2%``, ``actuator_force=0.02N`` or ``travel=0.1mm``."""
    name, _, limit = (part.strip() for part in text.partition("="))
    name = ALIASES.get(name, name)
    field = "--max-error"
    if name not in QUANTITIES:
        known = ", ".join((*ALIASES, *QUANTITIES))
        raise InputError(f"expected SIGNAL=LIMIT with one of {known}; got {text!r}", field=field)
    field = f"{field} {name}"
    unit = QUANTITIES[name].unit
    try:
        number = float(limit.removesuffix("%"))
    except ValueError:
        if "%" in limit:
            raise InputError(f"expected a share such as 2%, got {limit!r}", field=field) from None
        return Bound(name, quantity(limit, unit, field=field, minimum=0.0), False)
    if not limit.endswith("%"):
        raise InputError(f"expected a share such as 2%, or a unit such as {unit}", field=field)
    return Bound(name, quantity(0.01 * number, "", field=field, minimum=0.0), True)
