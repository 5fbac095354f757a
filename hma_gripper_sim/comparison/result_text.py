"""Results as text: tables of the terminal, and JSON that every program can read."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterable, Sequence
from typing import Any

from rich import box
from rich.markup import escape
from rich.table import Table

from hma_gripper_sim.errors import printable


def result_table(
    title: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    left: Collection[str],
    wrapped: str | None = None,
) -> Table:
    """Return a table for a rich console; rows with a cell that says NO stand out.

    Parameters
    ----------
    left
        Headings of the columns that are set to the left: words; numbers stand to the right.
    wrapped
        Heading of the column that may take several lines.
    """
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in headings:
        table.add_column(
            heading,
            justify="left" if heading in left else "right",
            no_wrap=heading != wrapped,
        )
    for row in rows:
        bad = any(cell == "NO" or cell.startswith("NO:") for cell in row)
        table.add_row(*(escape(printable(cell)) for cell in row), style="bold red" if bad else None)
    return table


def json_text(content: Any) -> str:
    """Return a result as JSON; null stands for what is not finite, which JSON cannot say."""
    text = json.dumps(_finite(content), indent=2, ensure_ascii=False, allow_nan=False)
    return text + "\n"


def _finite(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
