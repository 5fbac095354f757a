"""What the benchmark checks its figures against."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """One figure that this package promises.

    Parameters
    ----------
    text
        What is promised.
    wanted, found
        The bound and what was measured, with their units.
    holds
        None: not measured in this run.
    """

    text: str
    wanted: str
    found: str
    holds: bool | None
