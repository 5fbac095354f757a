"""The populations on the benchmark's page and in its data."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hma_gripper_benchmarks.against_dense import Difference
from hma_gripper_benchmarks.against_mujoco import Comparison
from hma_gripper_benchmarks.asked_error import Level, PopulationResult
from hma_gripper_benchmarks.population_claims import ENERGY, ratios_of
from hma_gripper_benchmarks.section import Section

IMAGE = "benchmark_population.png"
DECILES = tuple(share / 10 for share in range(1, 10))
TRUE_ERRORS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
TITLE = "Random scenes: the error that is got for the error that is asked for"
TEXT = (
    "Each scene is drawn from a seed: circles, boxes and polygons of any size on and off the axis, "
    "friction 0 to 1.4, sampled and continuous contact, all discretisations, the thesis' design "
    "and others, motions of all kinds, declared or as bare functions of time. The error is the RMS "
    "over a run of F relative to its largest or of φ to a radian, whichever is larger, to the same "
    "scene at a tolerance at least 30 times tighter; for an accuracy, to the continuum. Where "
    "moving the object by a picometre changes that reference by a tenth of what was asked, the "
    "scene is sensitive; ten times that change is allowed. Noisy is a run that a picometre changes "
    "by half of what was asked although the scene is not sensitive. CPU times are of one run, "
    "without the motion's own function. Worst, median, largest and energy are of scenes that are "
    "not sensitive. In the picture dashed lines are the error that was asked for, dotted ones 95 % "
    "of the scenes; below, so many of the scenes are that accurate within that time."
)
HEADINGS = (
    "population",
    "asked",
    "scenes",
    "within 1× [%]",
    "3× [%]",
    "10× [%]",
    "ended early",
    "without reference",
    "sensitive",
    "noisy",
    "gross",
    "median / asked",
    "worst / asked (seed)",
    "largest F / asked",
    f"energy ≤ {100 * ENERGY:g} % [%]",
    "CPU median [ms]",
    "95 % [ms]",
    "largest [ms]",
)


def sections(populations: list[PopulationResult]) -> list[Section]:
    """How errors compare with what was asked, and the work that true errors take."""
    if not populations:
        return []
    rows = [_row(result, level) for result in populations for level in result.levels]
    return [Section(TITLE, TEXT, HEADINGS, rows, IMAGE), _work(populations)]


def _row(result: PopulationResult, level: Level) -> tuple[str, ...]:
    worst = level.worst
    return (
        result.title,
        f"{level.asked:.0e}",
        f"{len(level.judgements)}",
        *(f"{100 * level.within(factor):.1f}" for factor in (1.0, 3.0, 10.0)),
        f"{level.ended_early}",
        f"{level.without_reference}",
        f"{level.sensitive}",
        f"{level.noisy}",
        f"{level.gross}",
        f"{level.median_ratio:.2g}",
        "–" if worst is None else f"{worst.ratio:.2g} ({worst.seed})",
        f"{level.largest_ratio:.2g}",
        f"{100 * level.energy_kept(ENERGY):.1f}",
        *(f"{1e3 * level.cpu_time(share):.3g}" for share in (0.5, 0.95, 1.0)),
    )


def _work(populations: list[PopulationResult]) -> Section:
    rows = []
    for result in populations:
        for error in TRUE_ERRORS:
            times = deciles(result, error)
            cells = [f"{1e3 * spent:.3g}" if math.isfinite(spent) else "not got" for spent in times]
            rows.append((result.title, f"{100 * error:g}", *cells))
    return Section(
        "Random scenes: CPU time against true error",
        "Deciles over the scenes of the CPU time in ms that a run takes to be as accurate as that, "
        "interpolated between the tolerances. What no run reached is slower than all others.",
        ("population", "true error [%]", *(f"{100 * share:.0f} %" for share in DECILES)),
        rows,
    )


def deciles(result: PopulationResult, error: float) -> list[float]:
    """Of the CPU times to a true error [s]; infinite where less of the population got there."""
    spent = result.work(error)
    if not len(spent):
        return [math.nan for _ in DECILES]
    return [float(np.quantile(spent, share, method="higher")) for share in DECILES]


def rivals(differences: list[Difference], comparisons: list[Comparison]) -> list[Section]:
    """The references' own check, and MuJoCo."""
    found = []
    if differences:
        found.append(_dense(differences))
    if comparisons:
        found.append(_mujoco(comparisons))
    return found


def _dense(differences: list[Difference]) -> Section:
    rows = [
        (
            one.title,
            one.key.removeprefix("seed_"),
            "may lie flat" if one.flat else "points",
            one.failure or f"{100 * one.force_rms:.1g}",
            f"{100 * one.force_max:.1g}",
            f"{math.degrees(one.phi_rms):.1g}",
        )
        for one in differences
    ]
    return Section(
        "Random scenes: the reference itself",
        "This package against scipy's Radau on independently derived equations, friction "
        "regularised in both. Where the tip's flank lies on a face, this package finds the centre "
        "of pressure; the other equations know a contact in one point.",
        ("scene", "seed", "contact", "F RMS [%]", "F max [%]", "φ RMS [°]"),
        rows,
        texts=3,
    )


def _mujoco(comparisons: list[Comparison]) -> Section:
    rows = []
    for setting in dict.fromkeys(one.setting for one in comparisons):
        those = [one for one in comparisons if one.setting == setting]
        counted = [one for one in those if one.ratio is not None]
        ratios = ratios_of(those)
        shares = (0.0, 0.25, 0.5, 0.75, 1.0)
        quartiles = [float(np.quantile(ratios, share)) for share in shares if ratios]
        error = np.median([one.error for one in counted]) if counted else math.nan
        rows.append(
            (
                setting,
                f"{len(those)}",
                f"{len(those) - len(counted)}",
                f"{100 * error:.2g}",
                *(f"{ratio:.0f}" for ratio in quartiles),
            )
        )
    return Section(
        "Random scenes: times faster than MuJoCo at its own error",
        "Circles and boxes of the population in phases of constant velocity, continuous contact, "
        "both halves stepped, all in turns; this package's time is interpolated between its "
        "tolerances to MuJoCo's RMS error of F, and is that at tolerance 2e-2 where MuJoCo's is "
        "larger. Where the base only goes down, friction is regularised at 1e-4 m/s in both; where "
        "it rests or turns back, the reference has set-valued friction. MuJoCo's has its slope at "
        "half of the largest force. Where MuJoCo is more than 5 % off, its speed does not count; "
        "scenes that take longer than two minutes are left out.",
        (
            "MuJoCo's setting",
            "scenes",
            "too wrong",
            "F RMS, median [%]",
            "least",
            "quartile",
            "median",
            "quartile",
            "most",
        ),
        rows,
    )


def plain(result: PopulationResult) -> dict[str, Any]:
    """For JSON; single scenes can be drawn again from their seeds."""
    return {
        "key": result.key,
        "title": result.title,
        "levels": [_plain_level(level) for level in result.levels],
        "cpu_time_deciles": {f"{error:g}": deciles(result, error) for error in TRUE_ERRORS},
    }


def _plain_level(level: Level) -> dict[str, Any]:
    return {
        "asked": level.asked,
        "scenes": len(level.judgements),
        "within": {f"{factor:g}": level.within(factor) for factor in (1.0, 3.0, 10.0)},
        "ended_early": level.ended_early,
        "without_reference": level.without_reference,
        "sensitive": level.sensitive,
        "noisy": level.noisy,
        "gross": level.gross,
        "median_ratio": level.median_ratio,
        "largest_ratio": level.largest_ratio,
        "energy_kept": level.energy_kept(ENERGY),
        "cpu_time": {f"{share:g}": level.cpu_time(share) for share in (0.5, 0.95, 1.0)},
        "beyond": {str(one.seed): one.ratio for one in level.judged if not one.is_within(1.0)},
        "failures": {str(one.seed): one.failure for one in level.judgements if one.failure},
    }
