"""A calibration in the terminal, and for programs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich import box
from rich.markup import escape
from rich.table import Table

from hma_gripper_sim.calibration.fitting import Calibration
from hma_gripper_sim.comparison.signal_errors import QUANTITIES

CORRELATED = 0.95
"""Correlation beyond which two parameters are said to be hard to tell apart."""


def terminal_tables(result: Calibration) -> Iterator[Table]:
    """Yield values, correlations and errors as tables for a rich console."""
    yield _table(
        "Parameters",
        ("parameter", "start", "found", "standard error", "unit", "between"),
        [
            (
                fitted.free.parameter.name,
                f"{fitted.free.start:.6g}",
                f"{fitted.value:.6g}",
                f"{fitted.standard_error:.2g}",
                fitted.free.parameter.unit or "1",
                f"{fitted.free.lower:.4g} … {fitted.free.upper:.4g}",
            )
            for fitted in result.parameters
        ],
    )
    names = [fitted.free.parameter.name for fitted in result.parameters]
    if len(names) > 1:
        rows = [
            (name, *(f"{value:+.3f}" for value in row))
            for name, row in zip(names, result.correlation, strict=True)
        ]
        yield _table("Correlation of their errors", ("", *names), rows)
    yield _table(
        "Simulated - measured, RMS of the averages",
        ("signal", "averages", "before", "after", "unit", "that count as one"),
        [
            (
                QUANTITIES[signal.name].label,
                str(signal.count),
                QUANTITIES[signal.name].number(signal.rmse_before),
                QUANTITIES[signal.name].number(signal.rmse_after),
                QUANTITIES[signal.name].shown_unit,
                f"{signal.autocorrelation:.1f}",
            )
            for signal in result.signals
        ],
    )


def remarks(result: Calibration) -> Iterator[str]:
    """Yield what to be careful about."""
    if not result.converged:
        yield "the search was given up before it had converged"
    for fitted in result.parameters:
        if fitted.at_bound:
            yield f"{fitted.free.parameter.name} is held by its bound: its error means nothing"
    names = [fitted.free.parameter.name for fitted in result.parameters]
    for i, name in enumerate(names):
        for j in range(i):
            if abs(result.correlation[i, j]) > CORRELATED:
                yield f"{names[j]} and {name} can hardly be told apart by this experiment"


def as_json(result: Calibration) -> dict[str, Any]:
    """Return all there is to a calibration as JSON can hold it; SI."""
    return {
        "converged": result.converged,
        "simulations": result.simulations,
        "parameters": {
            fitted.free.parameter.name: {
                "unit": fitted.free.parameter.unit,
                "start": fitted.free.start,
                "value": fitted.value,
                "standard_error": fitted.standard_error,
                "lower": fitted.free.lower,
                "upper": fitted.free.upper,
                "at_bound": fitted.at_bound,
            }
            for fitted in result.parameters
        },
        "correlation": result.correlation.tolist(),
        "signals": {
            signal.name: {
                "unit": QUANTITIES[signal.name].unit,
                "count": signal.count,
                "rmse_before": signal.rmse_before,
                "rmse_after": signal.rmse_after,
                "autocorrelation": signal.autocorrelation,
            }
            for signal in result.signals
        },
        "remarks": list(remarks(result)),
    }


def _table(title: str, headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for column, heading in enumerate(headings):
        table.add_column(heading, justify="right" if column else "left")
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table
