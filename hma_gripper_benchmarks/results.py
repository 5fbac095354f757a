"""Everything that one run of the benchmark found, and the claims that follow from it."""

from __future__ import annotations

import os
import platform
from dataclasses import dataclass
from datetime import datetime, timezone
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from hma_gripper_benchmarks import peers, population_claims, this_package
from hma_gripper_benchmarks.against_dense import Difference
from hma_gripper_benchmarks.against_mujoco import Comparison
from hma_gripper_benchmarks.asked_error import PopulationResult
from hma_gripper_benchmarks.cantilever import CantileverRow
from hma_gripper_benchmarks.claim import Claim
from hma_gripper_benchmarks.convergence import Study
from hma_gripper_benchmarks.hard_cases import HardCase, Verdict
from hma_gripper_benchmarks.holding import Holding
from hma_gripper_benchmarks.scaling import ScalingRow
from hma_gripper_benchmarks.scenes import tasks as known_tasks
from hma_gripper_benchmarks.startup import Startup
from hma_gripper_benchmarks.work_precision import TaskResult, WorkRow
from hma_gripper_sim.mechanics.outcome import Outcome

ROBUST = "discrete + PGS, 1 ms"  # MuJoCo's settings that the claims compare with
ACCURATE = "implicitfast + PGS, 0.2 ms"
DEFAULT_TOLERANCE = "tolerance 1e-03"


@dataclass(frozen=True)
class Machine:
    """Where and with what was measured.

    Parameters
    ----------
    processor, system, date
        For people; the date is UTC.
    cores
        Of which one was used.
    versions
        Of the packages that matter; None where one is not installed.
    """

    processor: str
    system: str
    cores: int
    date: str
    versions: dict[str, str | None]


@dataclass(frozen=True)
class Results:
    """All sections; empty ones were left out of the run."""

    machine: Machine
    full: bool
    rounds: int
    tasks: list[TaskResult]
    reduced: list[TaskResult]
    holding: Holding
    cantilever: list[CantileverRow]
    scaling: list[ScalingRow]
    startup: Startup
    studies: list[Study]
    hard_cases: list[tuple[HardCase, Verdict]]
    populations: list[PopulationResult]
    against_dense: list[Difference]
    against_mujoco: list[Comparison]

    @property
    def claims(self) -> list[Claim]:
        """The promised figures and what was found."""
        return _claims(self)


def this_machine() -> Machine:
    """Describe the machine that runs this."""
    names = ["hma_gripper_sim", "numba", "numpy", *(entry[0] for entry in peers.PEERS.values())]
    return Machine(
        _processor(),
        f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        os.cpu_count() or 1,
        datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        {name: _version(name) for name in names},
    )


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown processor"


def _claims(results: Results) -> list[Claim]:
    tasks = {task.key: task for task in results.tasks}
    titles = {key: task.title for key, task in known_tasks().items()}
    claims = []
    for key, setting, error in (
        ("cylinder_sampled", ROBUST, 0.004),
        ("cylinder_sampled", ACCURATE, 0.0005),
    ):
        claims.append(_speed_up(titles[key], tasks.get(key), setting, 50.0, error))
        claims.append(_box_row(tasks, error))
    for key in ("cylinder_continuous", "sharp_box_continuous"):
        for setting in (ROBUST, ACCURATE):
            claims.append(_speed_up(titles[key], tasks.get(key), setting, 100.0, None))
    for reduced in results.reduced:
        claims.append(_reduction(reduced, tasks.get(reduced.key.removesuffix("_reduced"))))
    claims += _scaling(results.scaling)
    claims += _cantilever(results.cantilever)
    claims += _holding(results.holding, tasks.get("reversal"))
    claims.append(_hard_cases(results.hard_cases))
    for population in results.populations:
        claims += population_claims.of_population(population)
    claims += population_claims.of_dense(results.against_dense)
    claims += population_claims.of_mujoco(results.against_mujoco)
    claims += _startup(results.startup)
    return claims


def _speed_up(
    title: str, task: TaskResult | None, setting: str, wanted: float, error: float | None
) -> Claim:
    """Compare with one setting of MuJoCo, at a given error or at its own."""
    bound = "at its error" if error is None else f"at ≤ {100 * error:g} % RMS"
    text = f"{title}: times faster than MuJoCo, {setting}, {bound}"
    peer = task.find("MuJoCo", setting) if task is not None else None
    if task is None or peer is None or peer.error is None or peer.cpu_time is None:
        return Claim(text, f"≥ {wanted:g}", "not measured", None)
    mine = task.fastest(this_package.BOTH, peer.error.force_rms if error is None else error)
    if mine is None or mine.cpu_time is None:
        return Claim(text, f"≥ {wanted:g}", "no run was that accurate", False)
    ratio = peer.cpu_time / mine.cpu_time
    return Claim(text, f"≥ {wanted:g}", f"{ratio:.0f} ({_pair(mine, peer)})", ratio >= wanted)


def _pair(mine: WorkRow, peer: WorkRow) -> str:
    errors = [row.error.force_rms if row.error else 0.0 for row in (mine, peer)]
    times = [row.cpu_time or 0.0 for row in (mine, peer)]
    return (
        f"{1e3 * times[0]:.3g} ms at {100 * errors[0]:.2g} % against "
        f"{1e3 * times[1]:.3g} ms at {100 * errors[1]:.2g} %"
    )


def _box_row(tasks: dict[str, TaskResult], error: float) -> Claim:
    """Compare both sampled rows at the tolerance with which the cylinder's is fastest."""
    text = (
        "Box, sampled: time relative to the cylinder at the tolerance that gives "
        f"≤ {100 * error:g} % RMS there"
    )
    box, cylinder = (tasks.get(f"{name}_sampled") for name in ("box", "cylinder"))
    row = cylinder.fastest(this_package.BOTH, error) if cylinder is not None else None
    other = (
        box.find(this_package.BOTH, row.setting) if box is not None and row is not None else None
    )
    if row is None or other is None or row.cpu_time is None or other.cpu_time is None:
        return Claim(text, "≤ 2", "not measured", None)
    ratio = other.cpu_time / row.cpu_time
    return Claim(text, "≤ 2", f"{ratio:.2f} ({row.setting})", ratio <= 2.0)


def _reduction(reduced: TaskResult, plain: TaskResult | None) -> Claim:
    text = (
        f"{reduced.title}: times faster than both halves of the thesis' model, "
        "at ≤ 1 % RMS and ≤ 0.05° of the continuum"
    )
    allowed = [
        row
        for row in reduced.rows
        if row.cpu_time is not None
        and row.error is not None
        and row.error.force_rms <= 0.01
        and row.error.phi_max <= 0.05
    ]
    best = min(allowed, key=lambda row: row.cpu_time or 0.0, default=None)
    robust = plain.find("MuJoCo", ROBUST) if plain is not None else None
    bound = robust.error.force_rms if robust is not None and robust.error is not None else 0.004
    mine = plain.fastest(this_package.BOTH, bound) if plain is not None else None
    if mine is None or mine.cpu_time is None:
        return Claim(text, "≥ 5", "not measured", None)
    if best is None or best.cpu_time is None:
        return Claim(text, "≥ 5", "no run was that accurate", False)
    ratio = mine.cpu_time / best.cpu_time
    found = f"{ratio:.1f} ({best.setting}: {_pair(best, mine)})"
    return Claim(text, "≥ 5", found, ratio >= 5.0)


def _scaling(rows: list[ScalingRow]) -> list[Claim]:
    if len(rows) < 2:
        return []
    times = [row.time_per_joint for row in rows]
    spread = max(times) / min(times) - 1.0
    memory = [row.memory_per_joint for row in rows]
    span = f"{rows[0].joints} to {rows[-1].joints} joints"
    return [
        Claim(
            f"Newton iteration: spread of the cost per joint, {span}",
            "≤ 25 %",
            f"{100 * spread:.0f} % ({1e9 * min(times):.0f} to {1e9 * max(times):.0f} ns)",
            spread <= 0.25,
        ),
        Claim(
            f"Memory per joint, {span}",
            "not growing",
            f"{memory[0]:.0f} to {memory[-1]:.0f} byte",
            memory[-1] <= 1.25 * memory[0],
        ),
    ]


def _cantilever(rows: list[CantileverRow]) -> list[Claim]:
    if not rows:
        return []
    row = rows[-1]
    claims = [
        Claim(
            f"Cantilever of {row.elements} GBEs, static: time, with the error to the exact chain",
            "≤ 1 ms, ≤ 1e-6",
            f"{1e3 * row.static_time:.2g} ms, {row.static_error:.0e}",
            row.static_time <= 1e-3 and row.static_error <= 1e-6,
        )
    ]
    times = [spent for name, (spent, _) in row.peers.items() if spent and "MuJoCo" in name]
    if times:
        ratio = min(times) / row.dynamic_time
        claims.append(
            Claim(
                f"Cantilever of {row.elements} GBEs, to rest: times faster than MuJoCo",
                "≥ 20",
                f"{ratio:.0f} ({1e3 * row.dynamic_time:.2g} against {1e3 * min(times):.3g} ms)",
                ratio >= 20.0,
            )
        )
    return claims


def _holding(holding: Holding, reversal: TaskResult | None) -> list[Claim]:
    claims = [
        Claim(
            "Hold for 5 s with set-valued friction: change of F once the beams have relaxed",
            "< 1e-6 N",
            f"{holding.creep:.1e} N",
            holding.creep < 1e-6,
        )
    ]
    row = reversal.find(this_package.BOTH, DEFAULT_TOLERANCE) if reversal is not None else None
    if row is not None and row.error is not None:
        claims.append(
            Claim(
                "Reversal: F to the set-valued limit at the default tolerance, RMS and largest",
                "≤ 0.5 %, no spike",
                f"{100 * row.error.force_rms:.2g} %, {100 * row.error.force_max:.2g} %",
                row.error.force_rms <= 0.005 and row.error.force_max <= 0.05,
            )
        )
    return claims


def _hard_cases(found: list[tuple[HardCase, Verdict]]) -> Claim:
    text = "Hard cases: failures of the solver at the default tolerance, and other defects"
    if not found:
        return Claim(text, "0, 0", "not measured", None)
    failed = sum(verdict.outcome is not Outcome.CONVERGED for _, verdict in found)
    defects = sum(bool(verdict.failures) for _, verdict in found)
    return Claim(text, "0, 0", f"{failed}, {defects} of {len(found)}", not failed and not defects)


def _startup(startup: Startup) -> list[Claim]:
    claims = []
    if startup.first is not None:
        claims.append(
            Claim(
                "First process after an installation, to its first step",
                "< 20 s",
                f"{startup.first:.1f} s",
                startup.first < 20.0,
            )
        )
    claims.append(
        Claim(
            "Later processes, to their first step",
            "< 1.5 s",
            f"{startup.later:.2f} s",
            startup.later < 1.5,
        )
    )
    return claims
