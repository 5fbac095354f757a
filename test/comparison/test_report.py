"""Comparisons as text."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import pytest
from rich.console import Console

from hma_gripper_sim import config_directory
from hma_gripper_sim.comparison.experiment_criteria import Comparison
from hma_gripper_sim.comparison.report import Result, terminal_table, write_report
from hma_gripper_sim.experiments.experiment import Criterion
from hma_gripper_sim.experiments.experiment_file import read_experiment

EXPERIMENT = read_experiment(config_directory() / "experiments" / "thesis_2013_box.yaml")

GOOD = Comparison(Criterion("max_bending_moment", 7.0, 5e-3, 4.75e-3, 5.25e-3, "A | B"), 5.1e-3)
WINDOW = Comparison(Criterion("peak_actuator_force", 7.0, None, 0.6, 0.8, "C"), 0.7)
DOWN = Comparison(Criterion("actuator_force", 7.0, -0.1, -0.11, -0.09, "F"), -0.105)
FREE = Comparison(
    Criterion("phi_left", 7.0, math.radians(112.1), -math.inf, math.inf, "D"), math.radians(107.1)
)
BAD = Comparison(Criterion("actuator_force", 0.0, None, -0.2, 0.0, "E"), math.nan)


def result(directory: Path, *comparisons: Comparison) -> Result:
    log = directory / "box" / "log"
    return Result(EXPERIMENT, comparisons, log, (log.parent / "phi.png",), ("within 1 %",))


def printed(shown: Result) -> list[list[str]]:
    console = Console(file=io.StringIO(), width=120)
    console.print(terminal_table(shown.experiment.title, shown.comparisons))
    assert isinstance(console.file, io.StringIO)
    return [line.split() for line in console.file.getvalue().splitlines()]


def test_table_shows_value_expectation_error_and_verdict(tmp_path: Path) -> None:
    lines = printed(result(tmp_path, GOOD, WINDOW, DOWN, FREE, BAD))
    for row in (
        "M max 5.100 mN m 5 mN m ± 5 % 2.0% yes A | B",
        "F_act peak 0.700 N 0.6 … 0.8 N yes C",
        "F_act at 7 s -0.105 N -0.1 N ± 10 % 5.0% yes F",
        "φ left at 7 s 107.10 ° 112.1 ° 4.5% – D",
        "F_act at 0 s nan N -0.2 … 0 N NO E",
    ):
        assert row.split() in lines


@pytest.mark.parametrize(("comparisons", "passed"), [((GOOD, FREE), True), ((GOOD, BAD), False)])
def test_one_figure_outside_fails_the_result(
    tmp_path: Path, comparisons: tuple[Comparison, ...], passed: bool
) -> None:
    shown = result(tmp_path, *comparisons)
    assert shown.passed is passed
    write_report(tmp_path, [result(tmp_path, GOOD), shown])
    content = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert content["passed"] is passed
    assert [entry["passed"] for entry in content["experiments"]] == [True, passed]


def test_json_holds_every_comparison_in_si(tmp_path: Path) -> None:
    """JSON has neither NaN nor infinity: null stands for both."""
    write_report(tmp_path, [result(tmp_path, GOOD, FREE, BAD)])
    (experiment,) = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))[
        "experiments"
    ]
    good, free, bad = experiment["comparisons"]
    assert (good["value"], good["lower"], good["upper"], good["unit"]) == (
        5.1e-3,
        4.75e-3,
        5.25e-3,
        "N*m",
    )
    assert good["relative_error"] == pytest.approx(0.02)
    assert (free["upper"], free["judged"]) == (None, False)
    assert (bad["value"], bad["inside"]) == (None, False)
    assert experiment["log"] == "box/log"


def test_summary_shows_tables_and_pictures(tmp_path: Path) -> None:
    write_report(tmp_path, [result(tmp_path, GOOD)])
    summary = (tmp_path / "summary.md").read_text(encoding="utf-8")
    assert "| M max | 5.100 mN m | 5 mN m ± 5 % | 2.0% | yes | A \\| B |" in summary
    assert "![phi](box/phi.png)" in summary
    assert "- within 1 %" in summary
    (experiment,) = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))[
        "experiments"
    ]
    assert experiment["remarks"] == ["within 1 %"]
