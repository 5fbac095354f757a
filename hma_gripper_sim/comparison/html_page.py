"""A comparison as one self-contained HTML page.

Every text is escaped, wherever it comes from, and the page's own policy lets a browser load
nothing and run nothing.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from html import escape

from hma_gripper_sim.comparison.angles import ANGLE_HEADINGS
from hma_gripper_sim.comparison.bounds import BOUND_HEADINGS
from hma_gripper_sim.comparison.log_comparison import LogComparison
from hma_gripper_sim.comparison.report import HEADINGS, cells
from hma_gripper_sim.comparison.run_plots import plot_force, plot_phi
from hma_gripper_sim.comparison.signal_errors import RELATIVE
from hma_gripper_sim.comparison.signal_plots import signal_svg
from hma_gripper_sim.comparison.tables import (
    ERROR_HEADINGS,
    INSTANT_HEADINGS,
    SPREAD,
    error_rows,
    instant_rows,
    stated_facts,
)

_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff;
       max-width: 62em; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: .2em; }
h2 { font-size: 1.15em; margin: 2em 0 .5em; }
table { border-collapse: collapse; font-size: .93em; }
th, td { padding: .25em .8em .25em 0; text-align: left; vertical-align: top; }
th { border-bottom: 1px solid #999; font-weight: 600; }
td { font-variant-numeric: tabular-nums; border-bottom: 1px solid #eee; }
td.number, th.number { text-align: right; }
tr.outside td { color: #b00020; font-weight: 600; }
p.verdict { font-weight: 600; }
p.good { color: #00694a; }
p.bad { color: #b00020; }
p.small, li { color: #555; font-size: .9em; }
img { width: 100%; margin: .6em 0; }
dt { float: left; clear: left; width: 7em; color: #555; }
dd { margin-left: 7.5em; overflow-wrap: anywhere; }
"""

_TEXT_COLUMNS = (
    "signal",
    "over",
    "figure",
    "expected",
    "inside",
    "source",
    "object",
)


def html_page(result: LogComparison) -> str:
    """Return the whole page."""
    return "\n".join(_lines(result)) + "\n"


def _lines(result: LogComparison) -> Iterator[str]:
    title = escape(result.title)
    yield "<!DOCTYPE html>"
    yield '<html lang="en"><head><meta charset="utf-8">'
    yield f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    yield '<meta name="viewport" content="width=device-width">'
    yield f"<title>{title}</title><style>{_STYLE}</style></head><body>"
    yield f"<h1>{title}</h1>"
    yield from _verdict(result)
    yield "<dl>"
    for term, text in stated_facts(result):
        yield f"<dt>{escape(term)}</dt><dd>{escape(text)}</dd>"
    yield "</dl>"
    if result.angles:
        yield "<h2>Angles of deflection (Table 5.3)</h2>"
        yield from _table(ANGLE_HEADINGS, [row.cells() for row in result.angles])
    if result.verdicts:
        yield "<h2>Bounds</h2>"
        yield from _table(BOUND_HEADINGS, [verdict.cells() for verdict in result.verdicts])
    if result.criteria:
        yield "<h2>Figures</h2>"
        yield from _table(HEADINGS, [cells(comparison) for comparison in result.criteria])
    if result.signals:
        yield "<h2>Simulated − measured</h2>"
        rows = [row for signal in result.signals for row in error_rows(signal)]
        yield from _table(ERROR_HEADINGS, rows)
        yield f'<p class="small">{escape(RELATIVE)}'
        yield f"<br>Spread: of the measured left and right angle. {SPREAD}."
        if result.phases is not None:
            yield f"<br>{escape(result.phases.definition)}"
        yield "</p>"
    instants = [row for signal in result.signals for row in instant_rows(signal)]
    if instants:
        yield "<h2>At the asked instants</h2>"
        yield from _table(INSTANT_HEADINGS, instants)
    if result.run is not None and result.stated is not None:
        for plot, text in ((plot_phi, "φ at the instants"), (plot_force, "F_act")):
            picture = io.BytesIO()
            plot(picture, result.run, result.stated)
            yield f"<h2>{text}</h2>"
            yield _image("png", picture.getvalue(), f"{text}, simulated and stated")
    for signal in result.signals:
        label = signal.quantity.label
        yield f"<h2>{escape(label)}</h2>"
        picture_of_both = signal_svg(signal, result.phases)
        yield _image("svg+xml", picture_of_both, f"{label}, measured, simulated and difference")
    if result.notes:
        yield "<h2>Notes</h2><ul>"
        yield from (f"<li>{escape(note)}</li>" for note in result.notes)
        yield "</ul>"
    yield "</body></html>"


def _image(kind: str, content: bytes, alternative: str) -> str:
    data = base64.b64encode(content).decode("ascii")
    return f'<img alt="{escape(alternative)}" src="data:image/{kind};base64,{data}">'


def _verdict(result: LogComparison) -> Iterator[str]:
    judged = [verdict.inside for verdict in result.verdicts]
    judged += [comparison.inside for comparison in result.criteria if comparison.judged]
    if not judged:
        return
    outside = judged.count(False)
    if outside:
        yield f'<p class="verdict bad">{outside} of {len(judged)} bounds are not kept.</p>'
    else:
        yield f'<p class="verdict good">All {len(judged)} bounds are kept.</p>'


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    kinds = ["" if heading in _TEXT_COLUMNS else ' class="number"' for heading in headings]
    yield "<table><thead><tr>"
    for heading, kind in zip(headings, kinds, strict=True):
        yield f"<th{kind}>{escape(heading)}</th>"
    yield "</tr></thead><tbody>"
    for row in rows:
        outside = ' class="outside"' if any(cell.startswith("NO") for cell in row) else ""
        line = (f"<td{kind}>{escape(cell)}</td>" for cell, kind in zip(row, kinds, strict=True))
        yield f"<tr{outside}>{''.join(line)}</tr>"
    yield "</tbody></table>"
