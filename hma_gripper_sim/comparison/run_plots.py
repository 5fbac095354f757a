"""Pictures of a run: actuator force and φ over time, and the gripper closing on the object."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from hma_gripper_sim.experiments.experiment import Criterion, Experiment
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.recordings.recording import FloatArray
from hma_gripper_sim.recordings.run_figures import Run
from hma_gripper_sim.results.gripper_outline import gripper_outline

# Okabe and Ito's palette, told apart by colour-blind readers too.
BLUE, VERMILLION, BLACK, GREY, AMBER = "#0072B2", "#D55E00", "#222222", "#8A8A8A", "#E69F00"

STYLE: dict[Any, Any] = {
    "axes.edgecolor": BLACK,
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "font.size": 10.0,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "savefig.dpi": 160,
}


def plot_force(file: Path | BinaryIO, run: Run, experiment: Experiment) -> None:
    """Draw the actuator force over time with the published figures (thesis Fig. 5.4)."""
    force = run.recording["actuator_force"]
    with _axes(file, "Time [s]", "Actuator force $F_{act}$ [N]") as axes:
        axes.axhline(0.0, color=BLACK, linewidth=0.8)
        axes.plot(force.time, force.value, color=BLUE, label="simulated")
        for criterion in _published(experiment, "peak_actuator_force"):
            axes.fill_between(
                [0.0, criterion.time],
                criterion.lower,
                criterion.upper,
                color=GREY,
                alpha=0.25,
                linewidth=0.0,
                label=f"peak in the thesis, {criterion.source}",
            )
        _finish(axes, experiment)


def plot_phi(file: Path | BinaryIO, run: Run, experiment: Experiment) -> None:
    """Draw φ over time with the measured angles and the published figures (thesis Fig. 5.5)."""
    sides = (("left", BLUE, "-", "<"), ("right", VERMILLION, "--", ">"))
    with _axes(file, "Time [s]", "Angle of deflection φ [°]") as axes:
        for side, colour, line, _ in sides:
            phi = run.recording[f"phi_{side}"]
            axes.plot(
                phi.time,
                np.degrees(phi.value),
                line,
                color=colour,
                label=f"simulated, {side}",
            )
        for side, colour, _, marker in sides:
            points = [m for m in experiment.measurements if m.figure == f"phi_{side}"]
            axes.errorbar(
                [m.time for m in points],
                np.degrees([m.value for m in points]),
                np.degrees([m.uncertainty for m in points]),
                fmt=marker,
                color=colour,
                markersize=7,
                capsize=4,
                label=f"real gripper, {side}",
            )
        for criterion in _published(experiment, "phi_mean"):
            if criterion.expected is not None:
                axes.plot(
                    criterion.time,
                    np.degrees(criterion.expected),
                    "D",
                    color=BLACK,
                    markerfacecolor="none",
                    label=f"thesis, {criterion.source}",
                )
        _finish(axes, experiment)


def plot_snapshots(
    path: Path, scene: Scene, times: Sequence[float], poses: Sequence[FloatArray]
) -> None:
    """Draw the gripper at several instants, the object fixed.

    Parameters
    ----------
    scene
        What the gripper is and what it presses on.
    times
        [s]
    poses
        Joint positions at each of them [rad; m], each of shape (n_joints,).
    """
    frames = [gripper_outline(scene, pose).bodies for pose in poses]
    object_outline = 1e3 * (scene.contour.outline() + np.asarray(scene.object_position))
    everything = np.vstack([*(1e3 * body for bodies in frames for body in bodies), object_outline])
    (left, bottom), (right, top) = everything.min(axis=0) - 3.0, everything.max(axis=0) + 3.0
    columns = (len(frames) + 1) // 2
    width = 2.4 * columns
    height = 2 * (width / columns * (top - bottom) / (right - left) + 0.3)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        panels = figure.subplots(2, columns, sharex=True, sharey=True, squeeze=False)
        for axes in panels.flat:
            axes.set_axis_off()
        for axes, time, bodies in zip(panels.flat, times, frames, strict=False):
            axes.add_patch(Polygon(object_outline, facecolor="#D9D9D9", edgecolor=GREY))
            for body in bodies:
                axes.add_patch(
                    Polygon(1e3 * body, facecolor=AMBER, edgecolor="#9C6A00", linewidth=0.4)
                )
            axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
            axes.set_title(f"{time:.2g} s")
        _scale_bar(panels[-1, 0], left, bottom)
        figure.savefig(path)


@contextmanager
def _axes(file: Path | BinaryIO, x_label: str, y_label: str) -> Iterator[Axes]:
    """Provide axes in this module's style and save their figure."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        axes = figure.subplots()
        axes.set(xlabel=x_label, ylabel=y_label)
        yield axes
        figure.savefig(file)


def _published(experiment: Experiment, figure: str) -> list[Criterion]:
    return [criterion for criterion in experiment.published if criterion.figure == figure]


def _finish(axes: Axes, experiment: Experiment) -> None:
    axes.axvline(experiment.approach, color=GREY, linewidth=0.8, linestyle=":", zorder=0)
    axes.annotate(
        "lowest position",
        (experiment.approach, 1.0),
        (4, -2),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        va="top",
        color=GREY,
        fontsize=8,
    )
    axes.set_xlim(0.0, experiment.way_points[-1][0])
    axes.set_title(experiment.title, loc="left")
    axes.legend(fontsize=8)


def _scale_bar(axes: Axes, left: float, bottom: float) -> None:
    axes.plot([left + 2.0, left + 12.0], [bottom + 2.0] * 2, color=BLACK, linewidth=2.0)
    axes.text(left + 7.0, bottom + 3.0, "10 mm", ha="center", va="bottom", fontsize=8)
