"""Pictures, looked at through what is drawn in them."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from hma_gripper_sim import GripperDesign, config_directory
from hma_gripper_sim.comparison.run_plots import plot_force, plot_phi, plot_snapshots
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.recordings.recording import Recording, Series
from hma_gripper_sim.recordings.run_figures import Run

EXPERIMENT = read_experiment(config_directory() / "experiments" / "thesis_2013_box.yaml")
DESIGN = GripperDesign.thesis_2013()
TIME = np.linspace(0.0, 14.0, 50)
SIGNALS = {
    "phi_left": Series(TIME, np.radians(100.0 + TIME)),
    "phi_right": Series(TIME, np.radians(100.0 - TIME)),
    "actuator_force": Series(TIME, 0.1 * TIME),
}
RUN = Run(Recording("made up", SIGNALS, 0), DESIGN, 0.0)


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that were saved, in order; they are still written."""
    saved: list[Figure] = []
    save = Figure.savefig

    def keep(self: Figure, path: Path) -> None:
        save(self, path)
        saved.append(self)

    monkeypatch.setattr(Figure, "savefig", keep)
    return saved


def error_bars(axes: Axes) -> list[ErrorbarContainer]:
    return [bars for bars in axes.containers if isinstance(bars, ErrorbarContainer)]


def drawn(axes: Axes) -> dict[str, list[tuple[float, float]]]:
    """What has a label, with its points: curves, and measured values in their middle."""
    lines: dict[object, Any] = {line.get_label(): line for line in axes.get_lines()}
    lines |= {bars.get_label(): bars.lines[0] for bars in error_bars(axes)}
    return {str(label): list(zip(*line.get_data(), strict=True)) for label, line in lines.items()}


def test_phi_shows_both_sides_measured_angles_and_the_thesis(
    tmp_path: Path, figures: list[Figure]
) -> None:
    """Table 5.3, in degrees."""
    plot_phi(tmp_path / "phi.png", RUN, EXPERIMENT)
    axes = figures[0].axes[0]
    shown = drawn(axes)
    assert shown["simulated, left"][-1] == pytest.approx((14.0, 114.0))
    assert shown["simulated, right"][-1] == pytest.approx((14.0, 86.0))
    assert shown["real gripper, left"] == [pytest.approx((7.0, 112.1))]
    assert shown["real gripper, right"] == [pytest.approx((7.0, 106.9))]
    assert shown["thesis, Table 5.3, model"] == [pytest.approx((7.0, 107.4))]
    (bar,) = error_bars(axes)[0].lines[2][0].get_segments()
    assert bar[:, 1] == pytest.approx([111.6, 112.6])  # the uncertainty of ± 0.5°
    assert (axes.get_xlabel(), axes.get_ylabel()[-3:]) == ("Time [s]", "[°]")


def test_force_shows_the_published_window(tmp_path: Path, figures: list[Figure]) -> None:
    """Fig. 5.4 (b): the peak lies between 0.6 and 0.8 N."""
    plot_force(tmp_path / "force.png", RUN, EXPERIMENT)
    axes = figures[0].axes[0]
    assert drawn(axes)["simulated"][-1] == pytest.approx((14.0, 1.4))
    (window,) = (shape for shape in axes.collections if "thesis" in str(shape.get_label()))
    (path,) = window.get_paths()
    assert path.get_extents().extents == pytest.approx((0.0, 0.6, 7.0, 0.8))
    assert axes.get_ylabel().endswith("[N]")


def test_snapshots_show_the_gripper_coming_down(tmp_path: Path, figures: list[Figure]) -> None:
    """Every panel has the same limits; the object stays, and 4 mm of travel go down."""
    scene = EXPERIMENT.scene(DESIGN)
    start = np.zeros(len(scene.joint_names))
    lower = start.copy()
    lower[scene.joint_names.index("slide")] += 0.004
    plot_snapshots(tmp_path / "snapshots.png", scene, [0.0, 1.0, 2.0], [start, lower, start])
    panels = [axes for axes in figures[0].axes if axes.patches]
    assert [axes.get_title() for axes in panels] == ["0 s", "1 s", "2 s"]
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in panels}) == 1
    first, second = ([p.get_xy() for p in a.patches if isinstance(p, Polygon)] for a in panels[:2])
    np.testing.assert_array_equal(first[0], second[0])
    assert len(first) > 63  # the object, and a polygon for each GBE
    for before, after in zip(first[1:], second[1:], strict=True):
        np.testing.assert_allclose(
            after - before, np.tile([0.0, -4.0], (len(before), 1)), atol=1e-9
        )


def test_pictures_are_written_as_png(tmp_path: Path) -> None:
    path = tmp_path / "phi.png"
    plot_phi(path, RUN, EXPERIMENT)
    header = path.read_bytes()[:24]
    assert header[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", header[16:]) == (1024, 640)
