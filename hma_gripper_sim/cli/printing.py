"""Printing tables and notes: nothing is cut, and no name from outside steers the terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from hma_gripper_sim.errors import printable

_BESIDE = 3
"""Characters between two columns: their padding and a line."""


def print_tables(console: Console, tables: Iterable[Table]) -> None:
    """Print tables, each as wide as its numbers need, whatever the width of the terminal."""
    width = console.width
    for table in tables:
        least = 1
        for column in table.columns:
            texts = [Text.from_markup(str(cell)).plain for cell in (column.header, *column.cells)]
            parts = texts if column.no_wrap else " ".join(texts).split()
            # rich takes it as a mere wish that a column is not wrapped.
            column.min_width = max(map(cell_len, parts), default=1)
            least += column.min_width + _BESIDE
        console.width = max(width, least)
        console.print(table, crop=False)
    console.width = width


def print_line(console: Console, text: str) -> None:
    """Print a text in one line."""
    console.print(printable(text), markup=False, highlight=False, soft_wrap=True)


def print_notes(console: Console, notes: Iterable[str]) -> None:
    """Print notes, a line each."""
    for note in notes:
        print_line(console, f"note: {note}")
