"""Plots of a comparison: both courses of a signal, and their difference."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from hma_gripper_sim.comparison.phases import NONE, PHASES, Phases
from hma_gripper_sim.comparison.run_plots import AMBER, BLACK, BLUE, GREY, STYLE, VERMILLION
from hma_gripper_sim.comparison.signal_errors import SignalErrors
from hma_gripper_sim.recordings.recording import FloatArray

POINTS = 2000
"""Stretches of time of which a long signal shows the lowest and the highest value."""

MOST_SPANS = 60
"""Stretches of phases beyond which they are not shaded: they would be too narrow to see."""

_SHADES = ("#56B4E9", AMBER, "#009E73", "#CC79A7")


def signal_svg(signal: SignalErrors, phases: Phases | None) -> bytes:
    """Draw a signal as measured and as simulated, and below it the difference; SVG."""
    shown = signal.quantity
    scale = shown.shown_per_si
    with mpl.rc_context({**STYLE, "svg.hashsalt": "hma_gripper_sim", "svg.fonttype": "path"}):
        figure = Figure(figsize=(8.0, 4.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        shades = _shade((upper, lower), phases, signal.time)
        _line(upper, signal.time, scale * signal.measured, BLACK, "measured", "-")
        _line(upper, signal.time, scale * signal.simulated, BLUE, "simulated", "--")
        lower.axhline(0.0, color=GREY, linewidth=0.8)
        difference = scale * (signal.simulated - signal.measured)
        _line(lower, signal.time, difference, VERMILLION, None, "-")
        upper.set_ylabel(f"{shown.label} [{shown.shown_unit}]")
        lower.set_ylabel(f"difference [{shown.shown_unit}]")
        lower.set_xlabel("Time of the experiment [s]")
        lines, _ = upper.get_legend_handles_labels()
        figure.legend(handles=[*lines, *shades], loc="outside upper right", ncols=6, fontsize=8)
        content = io.BytesIO()
        figure.savefig(content, format="svg", metadata={"Date": None})
    return content.getvalue()


def _line(
    axes: Axes, time: FloatArray, value: FloatArray, colour: str, label: str | None, style: str
) -> None:
    time, value = _envelope(time, value)
    axes.plot(time, value, style, color=colour, label=label, linewidth=1.3)


def _envelope(time: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a signal as it is, or the extremes of `POINTS` stretches of a long one."""
    if len(time) <= 2 * POINTS:
        return time, value
    starts = np.linspace(0, len(time), POINTS, endpoint=False).astype(np.intp)
    lowest, highest = (f.reduceat(value, starts) for f in (np.minimum, np.maximum))
    return np.repeat(time[starts], 2), np.column_stack([lowest, highest]).ravel()


def _shade(panels: tuple[Axes, ...], phases: Phases | None, time: FloatArray) -> list[Patch]:
    """Shade the phases; return what the legend shows for them."""
    spans = [] if phases is None else [span for span in phases.spans() if span[0] != NONE]
    if len(spans) > MOST_SPANS:
        return []
    for phase, start, end in spans:
        for axes in panels:
            axes.axvspan(start, end, color=_SHADES[phase], alpha=0.13, linewidth=0.0)
    for axes in panels:
        axes.set_xlim(float(time[0]), float(time[-1]))
    present = sorted({phase for phase, _, _ in spans})
    return [Patch(color=_SHADES[phase], alpha=0.3, label=PHASES[phase]) for phase in present]
