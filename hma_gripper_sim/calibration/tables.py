"""A calibration in the terminal, and for programs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from rich.table import Table

from hma_gripper_sim.calibration.fitting import Calibration, Direction
from hma_gripper_sim.comparison.result_text import result_table
from hma_gripper_sim.comparison.signal_errors import QUANTITIES

CORRELATED = 0.9
"""Correlation from which on two parameters are said to be hard to tell apart."""

HARDLY = 0.05
"""Share by which the residual has to fall for the search to have found something."""

UNEXPLAINED, OF_RANGE = 5.0, 0.1
"""Times its noise, and share of its range, that a signal may be missed by if the model holds."""


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
        "Identifiability: directions, in units of the room between the bounds",
        ("direction", "singular value", "standard error", "told"),
        [
            (
                direction_text(direction, names),
                f"{direction.singular_value:.4g}",
                f"{direction.standard_error:.2g}",
                "yes" if direction.is_told else "NO",
            )
            for direction in result.directions
        ],
    )
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


def direction_text(direction: Direction, names: Sequence[str]) -> str:
    """Return a direction as a sum of parameters."""
    parts = [
        f"{'-' if share < 0.0 else '+'} {abs(share):.2g} {name}"
        for share, name in zip(direction.shares, names, strict=True)
        if abs(share) >= 0.01
    ]
    return " ".join(parts).removeprefix("+ ")


def remarks(result: Calibration) -> Iterator[str]:
    """Yield what to be careful about."""
    if not result.converged:
        yield "the search was given up before it had converged"
    for fitted in result.parameters:
        if fitted.at_bound:
            yield f"{fitted.free.parameter.name} is held by its bound: its error means nothing"
    fell = 1.0 - result.residual_after / (result.residual_before or 1.0)
    if fell < HARDLY:
        yield (
            f"the residual hardly fell, by {100.0 * max(0.0, fell):.2g} %: the start values were "
            "as good, or the parameters are not what the simulation misses"
        )
    for signal in result.signals:
        quantity = QUANTITIES[signal.name]
        if signal.rmse_after > max(UNEXPLAINED * signal.noise, OF_RANGE * signal.span):
            yield (
                f"the model does not explain {quantity.label}: it is missed by "
                f"{quantity.number(signal.rmse_after)} {quantity.shown_unit}, of a range of "
                f"{quantity.number(signal.span)} and with a noise of "
                f"{quantity.number(signal.noise)}"
            )
    names = [fitted.free.parameter.name for fitted in result.parameters]
    for i, name in enumerate(names):
        for j in range(i):
            if abs(result.correlation[i, j]) >= CORRELATED:
                yield (
                    f"{names[j]} and {name} can hardly be told apart by this experiment: their "
                    f"errors are correlated by {result.correlation[i, j]:+.3f}"
                )
    for delay in result.delays:
        if delay.matters:
            signals = "the force" if delay.name == "force_delay" else "φ"
            side = "late" if delay.value > 0.0 else "early"
            moved = " and ".join(
                f"{name} by {move:+.2g}" for name, move in zip(names, delay.moves, strict=True)
            )
            yield (
                f"{signals} seems to come {1e3 * abs(delay.value):.3g} ± "
                f"{1e3 * delay.standard_error:.2g} ms {side} in the log; that would move {moved} "
                f"standard errors: free {delay.name} as well, or state a 'delay' in the signal map"
            )
    for direction in result.directions:
        if not direction.is_told:
            yield f"the experiment cannot tell {direction_text(direction, names)}"


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
                "told": fitted.is_told,
            }
            for fitted in result.parameters
        },
        "correlation": result.correlation.tolist(),
        "directions": [
            {
                "shares": list(direction.shares),
                "singular_value": direction.singular_value,
                "standard_error": direction.standard_error,
                "told": direction.is_told,
            }
            for direction in result.directions
        ],
        "delays": {
            delay.name: {
                "unit": "s",
                "value": delay.value,
                "standard_error": delay.standard_error,
                "matters": delay.matters,
            }
            for delay in result.delays
        },
        "residual_before": result.residual_before,
        "residual_after": result.residual_after,
        "signals": {
            signal.name: {
                "unit": QUANTITIES[signal.name].unit,
                "count": signal.count,
                "noise": signal.noise,
                "rmse_before": signal.rmse_before,
                "rmse_after": signal.rmse_after,
                "autocorrelation": signal.autocorrelation,
            }
            for signal in result.signals
        },
        "remarks": list(remarks(result)),
    }


def _table(title: str, headings: tuple[str, ...], rows: list[tuple[str, ...]]) -> Table:
    return result_table(title, headings, rows, left=headings[:1])
