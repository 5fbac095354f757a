"""A comparison in the terminal, and for programs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from rich.table import Table

from hma_gripper_sim.comparison.angles import ANGLE_HEADINGS
from hma_gripper_sim.comparison.bounds import BOUND_HEADINGS
from hma_gripper_sim.comparison.log_comparison import LogComparison
from hma_gripper_sim.comparison.provenance import Facts, program_version
from hma_gripper_sim.comparison.report import plain, terminal_table
from hma_gripper_sim.comparison.result_text import result_table
from hma_gripper_sim.comparison.signal_errors import Errors, InstantError, SignalErrors

ERROR_HEADINGS = ("signal", "over", "RMSE", "largest", "at", "bias", "relative", "spread")
INSTANT_HEADINGS = ("signal", "at", "simulated", "measured", "error", "relative", "spread")

WITHIN = "✓"
"""Marks an error that is within the experiment's own spread."""

SPREAD = f"{WITHIN}: no larger than the spread of the measured left and right angle"


def terminal_tables(result: LogComparison) -> Iterator[Table]:
    """Yield all there is to a comparison as tables for a rich console."""
    if result.angles:
        rows = [angles.cells() for angles in result.angles]
        yield _table("Angles of deflection (Table 5.3)", ANGLE_HEADINGS, rows)
    if result.criteria:
        yield terminal_table("Figures", result.criteria)
    if result.signals:
        rows = [row for signal in result.signals for row in error_rows(signal)]
        yield _table("Simulated - measured", ERROR_HEADINGS, rows, SPREAD)
    rows = [row for signal in result.signals for row in instant_rows(signal)]
    if rows:
        yield _table("At the asked instants", INSTANT_HEADINGS, rows, SPREAD)
    if result.verdicts:
        rows = [verdict.cells() for verdict in result.verdicts]
        yield _table("Bounds", BOUND_HEADINGS, rows)


def error_rows(signal: SignalErrors) -> Iterator[tuple[str, ...]]:
    """Yield the errors of a signal as text, as `ERROR_HEADINGS` names them."""
    shown = signal.quantity
    label = _label(signal)
    for name, errors in {"all of it": signal.overall, **signal.phases}.items():
        yield (
            label,
            name,
            shown.number(errors.rmse),
            shown.number(errors.maximum),
            f"{errors.time:.2f} s",
            shown.number(errors.bias),
            _percent(errors.relative),
            _spread(signal, errors),
        )
        label = ""


def instant_rows(signal: SignalErrors) -> Iterator[tuple[str, ...]]:
    """Yield a signal at the asked instants as text, as `INSTANT_HEADINGS` names it."""
    shown = signal.quantity
    for instant in signal.instants:
        yield (
            _label(signal),
            f"{instant.time:g} s",
            shown.number(instant.simulated),
            shown.number(instant.measured),
            shown.number(instant.error),
            _percent(instant.relative),
            _spread(signal, instant),
        )


def stated_facts(result: LogComparison) -> Facts:
    """Return what was compared, and what was simulated."""
    return (
        ("Simulated", result.simulated),
        ("Experiment", result.experiment),
        ("Signal map", result.signal_map or "as the node publishes, or as the experiment says"),
        ("Time", result.alignment),
        *result.simulation,
        ("Compared by", program_version()),
    )


def as_json(result: LogComparison) -> dict[str, Any]:
    """Return all there is to a comparison as JSON can hold it; SI."""
    return {
        "passed": result.passed,
        "title": result.title,
        "simulated": result.simulated,
        "experiment": result.experiment,
        "alignment": result.alignment,
        "signal_map": result.signal_map or None,
        "simulation": dict(result.simulation),
        "version": program_version(),
        "notes": list(result.notes),
        "angles": [
            {
                "time": row.time,
                "unit": "rad",
                "simulated": row.simulated,
                "left": row.left,
                "right": row.right,
                "average": row.average,
                "relative_error": row.relative_error,
                "spread": row.spread,
                "verdict": row.verdict,
            }
            for row in result.angles
        ],
        "figures": [plain(comparison) for comparison in result.criteria],
        "phases": None if result.phases is None else result.phases.definition,
        "touch": None if result.phases is None else result.phases.touch,
        "signals": {
            signal.name: {
                "unit": signal.quantity.unit,
                "largest_measured": signal.largest,
                "coverage": signal.coverage.share,
                "largest_gap": signal.coverage.largest_gap,
                "skipped": signal.skipped,
                "overall": _errors(signal.overall),
                "phases": {name: _errors(errors) for name, errors in signal.phases.items()},
                "instants": [
                    {
                        "time": instant.time,
                        "simulated": instant.simulated,
                        "measured": instant.measured,
                        "relative_error": instant.relative,
                        "spread": instant.spread,
                        "within_spread": instant.within_spread,
                    }
                    for instant in signal.instants
                ],
            }
            for signal in result.signals
        },
        "bounds": [
            {
                "signal": verdict.bound.name,
                "relative": verdict.bound.relative,
                "limit": verdict.bound.limit,
                "largest": verdict.largest,
                "coverage": None if verdict.coverage is None else verdict.coverage.share,
                "least_coverage": verdict.least,
                "largest_gap": None if verdict.coverage is None else verdict.coverage.largest_gap,
                "covers": verdict.covers,
                "inside": verdict.inside,
            }
            for verdict in result.verdicts
        ],
    }


def _errors(errors: Errors) -> dict[str, Any]:
    return {
        "count": errors.count,
        "rmse": errors.rmse,
        "maximum": errors.maximum,
        "time_of_maximum": errors.time,
        "bias": errors.bias,
        "relative": errors.relative,
        "spread": errors.spread,
        "within_spread": errors.within_spread,
    }


def _label(signal: SignalErrors) -> str:
    return f"{signal.quantity.label} [{signal.quantity.shown_unit}]"


def _percent(share: float | None) -> str:
    if share is None:
        return ""
    return "< 0.01 %" if 0.0 < share < 1e-4 else f"{100.0 * share:.3g} %"


def _spread(signal: SignalErrors, error: Errors | InstantError) -> str:
    if not error.spread or math.isnan(error.spread):
        return ""
    shown = signal.quantity.number(error.spread)
    return f"{shown} {WITHIN}" if error.within_spread else shown


def _table(
    title: str, headings: tuple[str, ...], rows: list[tuple[str, ...]], legend: str = ""
) -> Table:
    table = result_table(title, headings, rows, left=("signal", "over", "object"), wrapped="object")
    if any(WITHIN in cell for row in rows for cell in row):
        table.caption, table.caption_justify = legend, "left"
    return table
