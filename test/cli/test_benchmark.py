"""The command, what it imports, and what it writes."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from click.testing import CliRunner
from patience import patience

from hma_gripper_benchmarks import (
    against_dense,
    against_mujoco,
    cantilever,
    convergence,
    hard_cases,
    holding,
    peers,
    results,
    running,
    scaling,
    startup,
    this_package,
    work_precision,
)
from hma_gripper_benchmarks.asked_error import Judgement, Level, PopulationResult
from hma_gripper_benchmarks.scenes import tasks
from hma_gripper_benchmarks.series import Deviation
from hma_gripper_benchmarks.work_precision import TaskResult, WorkRow
from hma_gripper_sim.cli.benchmark import benchmark


def made_up_population():
    """One scene that is got right, one twice as wrong as asked, one that ended early."""
    levels = []
    for asked, spent in ((1e-2, 0.001), (1e-3, 0.002)):
        judgements = [
            Judgement(0, asked, None, spent, 1e-4, 0.1 * asked, 0.1 * asked, asked, 0.0, 0.0),
            Judgement(1, asked, None, spent, 1e-4, 2.0 * asked, 2.0 * asked, asked, 0.0, 0.0),
            Judgement(2, asked, "STEP_TOO_SMALL"),
        ]
        levels.append(Level(asked, judgements))
    return PopulationResult("general", "Scenes of all kinds", levels)


def small_run(full, progress):
    """A run of every part at its smallest."""
    error = Deviation(0.001, 0.01, 0.01, 0.02, 0.001, 0.01)
    worse = Deviation(0.003, 0.03, 0.01, 0.02, 0.001, 0.01)
    rows = [
        WorkRow("this package, both halves", "tolerance 1e-03", 0.004, error),
        WorkRow("MuJoCo", results.ROBUST, 0.3, worse),
        WorkRow("MuJoCo", results.ACCURATE, None, None, "gave up"),
    ]
    known = tasks()
    case = hard_cases.hard_cases()[0]
    progress("small")
    return results.Results(
        results.this_machine(),
        full,
        1,
        [TaskResult("cylinder_sampled", "Cylinder", 7.0, "made up", 1e-6, rows)],
        [],
        holding.measure(known["hold"]),
        cantilever.measure((10,), 1, lambda: None),
        scaling.measure(((5, 25), (10, 50)), 1, lambda: None),
        startup.Startup(None, 1.0),
        convergence.cantilever_studies(False, lambda: None),
        [(case, hard_cases.examine(case))],
        [made_up_population()],
        [against_dense.Difference("seed_0", "circle, constant", False, None, 1e-7, 1e-6, 1e-8)],
        [
            against_mujoco.Comparison("seed_0", "circle", results.ROBUST, 0.004, 0.3, 0.002),
            against_mujoco.Comparison("seed_1", "box", results.ROBUST, 0.4),
        ],
    )


@pytest.fixture
def written(tmp_path, monkeypatch):
    monkeypatch.setattr(running, "run", small_run)
    result = CliRunner().invoke(benchmark, ["--out", str(tmp_path / "out")])
    assert result.exit_code == 0, result.output
    return tmp_path / "out", result.output


def test_it_writes_a_page_data_and_plots(written):
    folder, _ = written
    data = json.loads((folder / "benchmarks.json").read_text(encoding="utf-8"))
    assert data["tasks"][0]["rows"][1]["cpu_time"] == 0.3
    assert data["machine"]["versions"]["numpy"]
    page = (folder / "benchmarks.md").read_text(encoding="utf-8")
    for name in ("work_precision", "scaling", "convergence", "population"):
        assert (folder / "images" / f"benchmark_{name}.png").stat().st_size > 0
    assert "images/benchmark_work_precision.png" in page
    assert "gave up" in page


def test_ratios_are_of_runs_that_were_accurate_enough(written):
    folder, _ = written
    data = json.loads((folder / "benchmarks.json").read_text(encoding="utf-8"))
    claim = data["claims"][0]
    assert claim["found"].startswith("75 ")
    assert claim["holds"] is True
    assert data["claims"][1]["holds"] is None


def test_the_populations_are_on_the_page_and_in_the_data(written):
    folder, _ = written
    page = (folder / "benchmarks.md").read_text(encoding="utf-8")
    assert "images/benchmark_population.png" in page
    assert "| Scenes of all kinds | 1e-03 | 3 | 50.0 | 100.0 | 100.0 | 1 |" in page
    data = json.loads((folder / "benchmarks.json").read_text(encoding="utf-8"))
    level = data["populations"][0]["levels"][1]
    assert level["beyond"] == {"1": 2.0}
    assert level["failures"] == {"2": "STEP_TOO_SMALL"}
    claims = {claim["text"]: claim for claim in data["claims"]}
    kept = next(claim for text, claim in claims.items() if "1e-03: runs whose error" in text)
    assert kept["holds"] is False
    faster = next(claim for text, claim in claims.items() if "random scenes: times" in text)
    assert faster["found"].startswith("median 150")
    assert faster["found"].endswith("too wrong to be timed in 1")


def test_missing_peers_are_named(monkeypatch, tmp_path):
    monkeypatch.setattr(peers, "installed_version", lambda name: None)
    monkeypatch.setattr(running, "run", small_run)
    result = CliRunner().invoke(benchmark, ["--out", str(tmp_path)])
    assert "MuJoCo is not installed and skipped" in result.output


def test_a_wrong_result_is_not_timed():
    task = tasks()["cylinder_continuous"]
    loose = this_package.candidate(task, task.scene, 1e-3)
    other = tasks()["sharp_box_continuous"]
    reference = this_package.reference_of(other, other.scene, 1e-3)
    (row,) = work_precision.timed_rows([(loose, reference)], 1, lambda text: None)
    assert row.cpu_time is None
    assert "RMS off" in row.failure


def test_the_command_imports_nothing_heavy():
    script = (
        "import sys; import hma_gripper_sim.cli.benchmark; "
        "print([name for name in ('mujoco', 'exudyn', 'matplotlib', 'numba', 'rich') "
        "if name in sys.modules and name not in before])"
    )
    script = "import sys; import hma_gripper_sim; before = set(sys.modules); " + script
    done = subprocess.run(
        [sys.executable, "-c", script],
        check=True,
        capture_output=True,
        text=True,
        timeout=patience(120.0),
    )
    assert done.stdout.strip() == "[]"
