"""One part of the benchmark's page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Section:
    """A table with its title and a sentence about it."""

    title: str
    text: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    image: str | None = None
    texts: int = 1  # leading columns that are no numbers
