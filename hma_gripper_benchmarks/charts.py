"""Pictures of the results, log-log."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hma_gripper_benchmarks import this_package
from hma_gripper_benchmarks.asked_error import PopulationResult
from hma_gripper_benchmarks.cantilever import CantileverRow
from hma_gripper_benchmarks.convergence import Study
from hma_gripper_benchmarks.scaling import ScalingRow
from hma_gripper_benchmarks.work_precision import TaskResult

# Okabe and Ito's palette, told apart by colour-blind readers too.
_SOLVERS = {
    this_package.BOTH: ("#0072B2", "o-"),
    this_package.ONE: ("#56B4E9", "s-"),
    this_package.REDUCED: ("#009E73", "^"),
    "MuJoCo": ("#D55E00", "D--"),
    "Exudyn": ("#CC79A7", "v--"),
    "scipy, one half": ("#E69F00", "x:"),
}
_OTHERS = ("#222222", "o-")
_LEVELS = ("#0072B2", "#D55E00", "#009E73")  # of asked errors
_DECILES = {0.9: "#A63603", 0.7: "#E6550D", 0.5: "#222222", 0.3: "#3182BD", 0.1: "#9ECAE1"}
SMALLEST_RATIO = 1e-4  # of error and asked error that is drawn
_STYLE: dict[Any, Any] = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.size": 9.0,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "lines.markersize": 5.0,
    "savefig.dpi": 160,
}


def plot_work_precision(path: Path, results: list[TaskResult]) -> None:
    """CPU time over the RMS error of the force, one panel for each task."""
    columns = min(3, len(results))
    rows = -(-len(results) // columns)
    with _figure(path, rows, columns) as panels:
        for axes, task in zip(panels, results, strict=False):
            solvers = dict.fromkeys(row.solver for row in task.rows)
            for solver in solvers:
                points = sorted(
                    (row.error.force_rms, row.cpu_time)
                    for row in task.rows
                    if row.solver == solver and row.cpu_time is not None and row.error is not None
                )
                colour, style = _SOLVERS.get(solver, _OTHERS)
                if points:
                    axes.loglog(
                        [100.0 * error for error, _ in points],
                        [spent for _, spent in points],
                        style,
                        color=colour,
                        label=solver,
                    )
            axes.set_title(task.title)
            axes.set_xlabel("RMS error of $F$ [% of its peak]")
            axes.set_ylabel(f"CPU time for {task.duration:g} s [s]")
        panels[0].legend(fontsize=7.0)


def plot_scaling(path: Path, scaling: list[ScalingRow], cantilever: list[CantileverRow]) -> None:
    """Cost of a Newton iteration over joints; the cantilever over GBEs."""
    with _figure(path, 1, 2) as (left, right):
        left.loglog(
            [row.joints for row in scaling],
            [1e6 * row.iteration_time for row in scaling],
            "o-",
            color=_SOLVERS[this_package.BOTH][0],
        )
        left.set_xlabel("joints of one half")
        left.set_ylabel("Newton iteration [µs]")
        counts = [row.elements for row in cantilever]
        right.loglog(
            counts,
            [1e3 * row.dynamic_time for row in cantilever],
            "o-",
            label="this package, to rest",
        )
        right.loglog(
            counts,
            [1e3 * row.static_time for row in cantilever],
            "s-",
            label="this package, static",
        )
        for name in dict.fromkeys(name for row in cantilever for name in row.peers):
            points = [
                (row.elements, spent)
                for row in cantilever
                for spent in [row.peers[name][0]]
                if spent is not None
            ]
            right.loglog(
                [n for n, _ in points], [1e3 * spent for _, spent in points], "D--", label=name
            )
        right.set_xlabel("GBEs of the cantilever")
        right.set_ylabel("CPU time [ms]")
        right.legend(fontsize=7.0)


def plot_convergence(path: Path, studies: list[Study]) -> None:
    """Errors over steps and GBEs, with the fitted orders."""
    groups = ("Order in time", "Order in GBEs, cantilever", "Order in GBEs, gripper")
    labels = ("accepted steps", "GBEs", "GBEs of one half")
    with _figure(path, 1, len(groups)) as panels:
        for axes, group, label in zip(panels, groups, labels, strict=True):
            for study in studies:
                if study.title.startswith(group) and study.order is not None:
                    name = study.title.removeprefix(group).lstrip(", ") or study.text
                    axes.loglog(
                        [row.size for row in study.rows],
                        [100.0 * row.force_rms for row in study.rows],
                        "o-",
                        label=f"{name}: order {study.order:.1f}",
                    )
            axes.set_title(group)
            axes.set_xlabel(label)
            axes.set_ylabel("error [%]")
            if axes.has_data():
                axes.legend(fontsize=7.0)


def plot_populations(path: Path, populations: list[PopulationResult]) -> None:
    """Distribution of the errors over what was asked; below, CPU time over true errors."""
    with _figure(path, 2, max(1, len(populations))) as panels:
        above, below = panels[: len(panels) // 2], panels[len(panels) // 2 :]
        for axes, result in zip(above, populations, strict=False):
            _plot_errors(axes, result)
        for axes, result in zip(below, populations, strict=False):
            _plot_work(axes, result)


def _plot_errors(axes: Axes, result: PopulationResult) -> None:
    for level, colour in zip(result.levels, _LEVELS, strict=False):
        ratios = np.sort([max(one.ratio, SMALLEST_RATIO) for one in level.calm])
        if len(ratios):
            shares = 100.0 * np.arange(1, len(ratios) + 1) / len(ratios)
            axes.step(ratios, shares, where="post", color=colour, label=f"{level.asked:.0e}")
    axes.axvline(1.0, color="#222222", linestyle="--", linewidth=1.0)
    axes.axhline(95.0, color="#222222", linestyle=":", linewidth=1.0)
    axes.set_xscale("log")
    axes.set_xlim(SMALLEST_RATIO, None)
    axes.set_ylim(0.0, 101.0)
    axes.set_title(result.title)
    axes.set_xlabel("error / asked")
    axes.set_ylabel("runs with at most that [%]")
    axes.legend(title="asked", fontsize=7.0, loc="center left")


def _plot_work(axes: Axes, result: PopulationResult) -> None:
    errors = np.geomspace(3e-2, 1e-5, 60)
    spent = np.array([result.work(error) for error in errors])
    if spent.size == 0:
        return
    for share, colour in _DECILES.items():
        times = np.quantile(spent, share, axis=1, method="higher")
        times[~np.isfinite(times)] = np.nan  # so accurate were fewer of the scenes
        axes.plot(100.0 * errors, 1e3 * times, color=colour, label=f"{100 * share:.0f} % of scenes")
    axes.set_xlim(1e-3, 3.0)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("true error [%]")
    axes.set_ylabel("CPU time of a run [ms]")
    axes.legend(fontsize=7.0)


@contextmanager
def _figure(path: Path, rows: int, columns: int) -> Iterator[list[Axes]]:
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(4.2 * columns, 3.4 * rows), layout="constrained")
        panels = list(figure.subplots(rows, columns, squeeze=False).flat)
        yield panels
        for axes in panels:
            if not axes.has_data():
                axes.set_visible(False)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)
