"""Results as tables for the terminal, a Markdown page, and JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict
from enum import Enum
from pathlib import Path
from typing import Any

from rich import box
from rich.table import Table

from hma_gripper_benchmarks import charts, population_page
from hma_gripper_benchmarks.hard_cases import CHAOTIC_CASES
from hma_gripper_benchmarks.results import Results
from hma_gripper_benchmarks.section import Section
from hma_gripper_benchmarks.work_precision import TaskResult, WorkRow

IMAGES = "images"
COLUMNS = 7  # that fit a terminal
ROUNDING = 1e-5  # difference of two references that needs no explanation
_FLAT = (
    " Where the tip's flank lies flat on a face, this package finds the centre of pressure; "
    "scipy's equations know a contact in one point."
)
_STUCK = " scipy's friction is regularised at 1e-6 m/s and creeps where this package's sticks."
EXPLANATIONS = {
    "box_continuous": _FLAT,
    "sharp_box_continuous": _FLAT,
    "hold": _STUCK,
    "reversal": _STUCK,
}


def terminal_tables(results: Results) -> list[Table]:
    """All sections as tables for a rich console."""
    tables = []
    for section in _sections(results):
        if not section.rows:
            continue
        table = Table(title=section.title, title_justify="left", box=box.SIMPLE_HEAD)
        for index, heading in enumerate(section.headings[:COLUMNS]):
            table.add_column(heading, justify="left" if index < section.texts else "right")
        for row in section.rows:
            bad = any(cell.startswith("NO") for cell in row)
            table.add_row(*row[:COLUMNS], style="bold red" if bad else None)
        tables.append(table)
    return tables


def write(directory: Path, results: Results) -> list[Path]:
    """Write ``benchmarks.md``, ``benchmarks.json`` and the plots; return their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    images = directory / IMAGES
    plots: list[tuple[str, Callable[[Path], None]]] = [
        (
            "benchmark_work_precision.png",
            lambda path: charts.plot_work_precision(path, [*results.tasks, *results.reduced]),
        ),
        (
            "benchmark_scaling.png",
            lambda path: charts.plot_scaling(path, results.scaling, results.cantilever),
        ),
        (
            "benchmark_convergence.png",
            lambda path: charts.plot_convergence(path, results.studies),
        ),
        (
            population_page.IMAGE,
            lambda path: charts.plot_populations(path, results.populations),
        ),
    ]
    paths = []
    for name, plot in plots:
        plot(images / name)
        paths.append(images / name)
    page, data = directory / "benchmarks.md", directory / "benchmarks.json"
    page.write_text(_markdown(results), encoding="utf-8")
    text = json.dumps(_plain(results), indent=2, ensure_ascii=False, allow_nan=False)
    data.write_text(text + "\n", encoding="utf-8")
    return [page, data, *paths]


def _plain(results: Results) -> dict[str, Any]:
    """For JSON; scenes and motions of hard cases are their titles."""
    names = ("machine", "holding", "startup")
    lists = (
        "tasks",
        "reduced",
        "cantilever",
        "scaling",
        "studies",
        "against_dense",
        "against_mujoco",
        "claims",
    )
    content: dict[str, Any] = {"full": results.full, "rounds": results.rounds}
    content.update({name: asdict(getattr(results, name)) for name in names})
    content.update({name: [asdict(item) for item in getattr(results, name)] for name in lists})
    content["hard_cases"] = [
        {"title": case.title, "tolerance": case.tolerance, **asdict(verdict)}
        for case, verdict in results.hard_cases
    ]
    content["populations"] = [population_page.plain(one) for one in results.populations]
    return {key: _finite(value) for key, value in content.items()}


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _markdown(results: Results) -> str:
    machine = results.machine
    mode = "full" if results.full else "quick"
    versions = ", ".join(
        f"{name} {number or 'not installed'}" for name, number in machine.versions.items()
    )
    lines = [
        "# Benchmarks: speed against error",
        "",
        f"Written by `hma_gripper benchmark --{mode}` on {machine.date}. Do not edit.",
        "",
        f"- {machine.processor}, one of {machine.cores} cores; {machine.system}",
        f"- {versions}",
        f"- CPU times are medians of {results.rounds} rounds in which all solvers took turns, "
        "after one run that is not counted. A result is checked against its reference before its "
        f"time counts. Errors are relative to the largest force (or moment) of the reference.",
        "- Times of this package are of `simulate` up to the sampled forces: all stages of the "
        "run, and the search for parts that touch although they are not modelled. Times of the "
        "peers are of their steps and the samples' storage. All models were built before, this "
        "package's with its pose at the start.",
        "",
    ]
    for section in _sections(results):
        lines += [f"## {section.title}", ""]
        if section.text:
            lines += [section.text, ""]
        if section.image:
            lines += [f"![{section.title}]({IMAGES}/{section.image})", ""]
        if section.rows:
            lines.append("| " + " | ".join(section.headings) + " |")
            numbers = len(section.headings) - section.texts
            lines.append("|" + section.texts * "---|" + numbers * "---:|")
            lines += ["| " + " | ".join(row) + " |" for row in section.rows]
            lines.append("")
    return "\n".join(lines)


def _sections(results: Results) -> list[Section]:
    found = [_claims(results), *population_page.sections(results.populations)]
    found += population_page.rivals(results.against_dense, results.against_mujoco)
    found.append(_plot_section(results))
    found += [_task(task) for task in (*results.tasks, *results.reduced)]
    found += [_cantilever(results), _scaling(results), *_studies(results)]
    if results.hard_cases:
        found.append(_hard_cases(results))
    return found


def _claims(results: Results) -> Section:
    verdicts = {True: "yes", False: "NO", None: "–"}
    rows = [
        (claim.text, claim.wanted, claim.found, verdicts[claim.holds]) for claim in results.claims
    ]
    return Section("Claims", "", ("figure", "wanted", "measured", "holds"), rows, texts=4)


def _plot_section(results: Results) -> Section:
    missing = [
        name
        for name, number in results.machine.versions.items()
        if number is None and name != "hma_gripper_sim"
    ]
    text = "Further down and further to the left is better."
    if missing:
        text += f" Not installed, so not measured: {', '.join(missing)}."
    return Section("Work and precision", text, (), [], "benchmark_work_precision.png")


def _task(task: TaskResult) -> Section:
    text = f"Errors to: {task.reference}."
    if task.agreement is not None:
        text += (
            " That reference and scipy's Radau on independently derived equations differ by "
            f"{100 * task.agreement:.2g} % RMS."
        )
        if task.agreement > ROUNDING:
            text += EXPLANATIONS.get(task.key, "")
    headings = (
        "solver",
        "setting",
        "CPU [ms]",
        "times real time",
        "F RMS [%]",
        "F max [%]",
        "φ max [°]",
        "φ RMS [°]",
        "M RMS [%]",
        "M max [%]",
    )
    rows = [_work_row(task, row) for row in task.rows]
    return Section(task.title, text, headings, rows, texts=2)


def _work_row(task: TaskResult, row: WorkRow) -> tuple[str, ...]:
    error = row.error
    if row.cpu_time is None:
        times = (row.failure or "failed", "–")
    else:
        times = (f"{1e3 * row.cpu_time:.3g}", f"{task.duration / row.cpu_time:,.0f}")
    if error is None:
        return (row.solver, row.setting, *times, *(6 * ("–",)))
    return (
        row.solver,
        row.setting,
        *times,
        f"{100 * error.force_rms:.2g}",
        f"{100 * error.force_max:.2g}",
        f"{error.phi_max:.2g}",
        f"{error.phi_rms:.2g}",
        f"{100 * error.moment_rms:.2g}",
        f"{100 * error.moment_max:.2g}",
    )


def _cantilever(results: Results) -> Section:
    names = list(dict.fromkeys(name for row in results.cantilever for name in row.peers))
    rows = []
    for row in results.cantilever:
        cells = [
            f"{row.elements}",
            f"{1e3 * row.deflection:.5f}",
            f"{1e3 * row.static_time:.2g} ({row.static_error:.0e})",
            f"{1e3 * row.dynamic_time:.2g} ({row.dynamic_error:.0e})",
        ]
        for name in names:
            spent, error = row.peers[name]
            cells.append(f"{1e3 * spent:.3g} ({error:.0e})" if spent else f"missed ({error:.0e})")
        rows.append(tuple(cells))
    headings = ("GBEs", "exact [mm]", "static [ms]", "to rest [ms]", *names)
    return Section(
        "Cantilever (thesis, Table 2.1)",
        "CPU time in ms, in brackets the relative error of the deflection to the exact chain. "
        "To rest: 1 s under a small body's weight on the beam's end, from straight.",
        headings,
        rows,
    )


def _scaling(results: Results) -> Section:
    rows = [
        (
            f"{row.joints}",
            f"{1e6 * row.iteration_time:.2f}",
            f"{1e9 * row.time_per_joint:.1f}",
            f"{row.memory / 1024:.0f}",
            f"{row.memory_per_joint:.0f}",
        )
        for row in results.scaling
    ]
    headings = (
        "joints of one half",
        "iteration [µs]",
        "per joint [ns]",
        "memory [KiB]",
        "per joint [B]",
    )
    return Section("Cost per joint", "", headings, rows, "benchmark_scaling.png")


def _studies(results: Results) -> list[Section]:
    headings = ("model", "F RMS [%]", "φ max [°]", "peak [N]", "last [N]", "CPU [ms]")
    found = []
    for index, study in enumerate(results.studies):
        text = study.text
        if study.order is not None:
            text += f" Observed order {study.order:.2f}."
        rows = [
            (
                row.label,
                f"{100 * row.force_rms:.2g}",
                _number(row.phi_max, ".2g"),
                _number(row.peak, ".4f"),
                _number(row.final, ".4f"),
                f"{1e3 * row.cpu_time:.2g}",
            )
            for row in study.rows
        ]
        image = "benchmark_convergence.png" if index == 0 else None
        found.append(Section(study.title, text, headings, rows, image))
    return found


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "–"


def _hard_cases(results: Results) -> Section:
    rows = []
    for case, verdict in results.hard_cases:
        wrong = "; ".join(verdict.failures)
        rows.append(
            (
                case.title,
                verdict.outcome.name.lower().replace("_", " "),
                "–" if verdict.deviation is None else f"{100 * verdict.deviation:.2g}",
                "" if verdict.sensitivity is None else f"{100 * verdict.sensitivity:.2g}",
                "–" if verdict.energy_residual is None else f"{100 * verdict.energy_residual:.2g}",
                f"{verdict.steps}",
                f"{1e3 * verdict.cpu_time:.3g}",
                f"NO: {wrong}" if wrong else "yes",
            )
        )
    return Section(
        "Hard cases",
        "Each at its tolerance (1e-3 unless said) against a run at a 10 times tighter one. They "
        "may deviate by 2 %; of a case on the list of chaotic ones the tighter run is repeated "
        "with the object a few picometres lower, and they may deviate by twice what that changes. "
        + " ".join(f"Chaotic: {title} ({why})." for title, why in CHAOTIC_CASES.items()),
        ("case", "outcome", "F RMS [%]", "by pm [%]", "energy [%]", "steps", "CPU [ms]", "passes"),
        rows,
    )


def summary(results: Results) -> str:
    """One line: how many claims hold."""
    verdicts: Sequence[bool | None] = [claim.holds for claim in results.claims]
    return (
        f"{sum(v is True for v in verdicts)} of {len(verdicts)} claims hold, "
        f"{sum(v is False for v in verdicts)} do not, "
        f"{sum(v is None for v in verdicts)} were not measured"
    )
