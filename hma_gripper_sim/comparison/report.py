"""Comparisons as text: for the terminal, for people and for programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from hma_gripper_sim.bags.log_metadata import logged_parameters
from hma_gripper_sim.comparison.experiment_criteria import Comparison
from hma_gripper_sim.comparison.provenance import Facts, program_version, simulation_facts
from hma_gripper_sim.comparison.result_text import json_text, result_table
from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.recordings.run_figures import FIGURES

HEADINGS = ("figure", "simulated", "expected", "error", "inside", "source")


@dataclass(frozen=True)
class Result:
    """An experiment, what a run of it is compared with, and where the run was logged.

    `remarks` say how far the simulation can be trusted.
    """

    experiment: Experiment
    comparisons: tuple[Comparison, ...]
    log: Path
    pictures: tuple[Path, ...]
    remarks: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every figure is inside its stated bound."""
        return all(comparison.inside for comparison in self.comparisons)


def terminal_table(title: str, comparisons: Sequence[Comparison]) -> Table:
    """Return comparisons as a table for a rich console."""
    rows = [cells(comparison) for comparison in comparisons]
    words = ("figure", "expected", "inside", "source")
    return result_table(title, HEADINGS, rows, left=words, wrapped="source")


def write_report(directory: Path, results: Sequence[Result]) -> None:
    """Write ``summary.md`` for people and ``report.json`` for programs."""
    (directory / "summary.md").write_text(_markdown(directory, results), encoding="utf-8")
    content = {
        "passed": all(result.passed for result in results),
        "experiments": [_plain(directory, result) for result in results],
    }
    (directory / "report.json").write_text(json_text(content), encoding="utf-8")


def cells(comparison: Comparison) -> tuple[str, ...]:
    """Return a comparison as text, as `HEADINGS` names it."""
    criterion = comparison.criterion
    figure = FIGURES[criterion.figure]
    error = comparison.relative_error
    verdict = "yes" if comparison.inside else "NO"
    return (
        f"{figure.label} at {criterion.time:g} s" if figure.timed else figure.label,
        figure.shown(comparison.value),
        _expected(comparison),
        "" if error is None else f"{error:.1%}",
        verdict if comparison.judged else "–",
        criterion.source,
    )


def _expected(comparison: Comparison) -> str:
    """Return what is expected with its bounds, such as "107.4 ° ± 0.5 %" or "0.6 … 0.8 N"."""
    criterion = comparison.criterion
    figure = FIGURES[criterion.figure]
    lower, upper = (f"{end * figure.shown_per_si:g}" for end in (criterion.lower, criterion.upper))
    if criterion.expected is None:
        return f"{lower} … {upper} {figure.shown_unit}"
    expected = f"{criterion.expected * figure.shown_per_si:g} {figure.shown_unit}"
    if not comparison.judged:
        return expected
    margin = (criterion.upper - criterion.expected) / abs(criterion.expected)
    return f"{expected} ± {margin * 100:.3g} %"


def _markdown(directory: Path, results: Sequence[Result]) -> str:
    lines = ["# Simulated pick-ups compared with the real gripper", ""]
    for result in results:
        lines += [
            f"## {result.experiment.title}",
            "",
            result.experiment.source,
            "",
            _row(HEADINGS),
            _row(["---"] * len(HEADINGS)),
            *(_row(cells(comparison)) for comparison in result.comparisons),
            "",
            *(f"- {remark}" for remark in result.remarks),
            "",
            *(f"- {term}: {text}" for term, text in _facts(result)),
            "",
            f"Log: `{result.log.relative_to(directory)}` ({program_version()})",
            "",
            *(f"![{p.stem}]({p.relative_to(directory).as_posix()})" for p in result.pictures),
            "",
        ]
    return "\n".join(lines)


def _facts(result: Result) -> Facts:
    return simulation_facts(logged_parameters(result.log))


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _plain(directory: Path, result: Result) -> dict[str, object]:
    return {
        "name": result.experiment.name,
        "source": result.experiment.source,
        "log": str(result.log.relative_to(directory)),
        "passed": result.passed,
        "simulation": dict(_facts(result)),
        "version": program_version(),
        "comparisons": [plain(comparison) for comparison in result.comparisons],
        "remarks": list(result.remarks),
    }


def plain(comparison: Comparison) -> dict[str, object]:
    """Return a comparison as JSON can hold it, SI."""
    criterion = comparison.criterion
    return {
        "figure": criterion.figure,
        "time": criterion.time,
        "unit": FIGURES[criterion.figure].unit,
        "value": comparison.value,
        "expected": criterion.expected,
        "relative_error": comparison.relative_error,
        "lower": criterion.lower,
        "upper": criterion.upper,
        "judged": comparison.judged,
        "inside": comparison.inside,
        "source": criterion.source,
    }
