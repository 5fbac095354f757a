"""What is promised for scenes that nobody chose."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hma_gripper_benchmarks.against_dense import Difference
from hma_gripper_benchmarks.against_mujoco import Comparison
from hma_gripper_benchmarks.asked_error import Level, PopulationResult
from hma_gripper_benchmarks.claim import Claim

DEFAULT = 1e-3  # tolerance of the claims that are about one
NOT_TIGHTER_THAN_NEEDED = (1e-2, 1e-3)  # tolerances at which over-solving is looked for
WITHIN = ((1.0, 0.95), (3.0, 0.99), (10.0, 1.0))
WITHIN_ACCURACY = WITHIN[:2]
ENDED, UNKNOWN, NOISY, SENSITIVE = 0.003, 0.01, 0.01, 0.1  # shares of the scenes, at most
MEDIAN = 0.05  # of what was asked, at least
LARGEST = 20.0  # times what was asked, at most
ENERGY, ENERGY_SHARE = 0.005, 0.99
CPU = ((0.5, 8e-3, "median"), (0.95, 60e-3, "95 %"), (1.0, 2.0, "largest"))  # s
DENSE = 1e-5  # RMS of the force; tenfold the tolerance of the runs that are compared
TIMES_FASTER = 100.0


def of_population(result: PopulationResult) -> list[Claim]:
    """Claims about the error that is got."""
    return [claim for level in result.levels for claim in _of_level(result, level)]


def _of_level(result: PopulationResult, level: Level) -> Iterator[Claim]:
    by_accuracy = result.key == "accuracy"
    asked = f"{'accuracy' if by_accuracy else 'tolerance'} {level.asked:.0e}"
    subject = f"{result.title}, {asked}"
    bounds = WITHIN_ACCURACY if by_accuracy else WITHIN
    times = ", ".join(f"{factor:g}×" for factor, _ in bounds)
    yield Claim(
        f"{subject}: runs whose error is within {times} what was asked",
        ", ".join(f"≥ {100 * share:g} %" for _, share in bounds),
        ", ".join(f"{100 * level.within(factor):.1f} %" for factor, _ in bounds),
        all(level.within(factor) >= share for factor, share in bounds),
    )
    count = len(level.judgements)
    shares = [number / count for number in (level.ended_early, level.without_reference)]
    if by_accuracy:
        return
    noisy = level.noisy / max(1, len(level.judged))
    yield Claim(
        f"{subject}: ended early, without reference, noisy; grossly wrong",
        f"≤ {100 * ENDED:g} %, ≤ {100 * UNKNOWN:g} %, ≤ {100 * NOISY:g} %; 0",
        ", ".join(f"{100 * share:.1f} %" for share in (*shares, noisy)) + f"; {level.gross}",
        shares[0] <= ENDED and shares[1] <= UNKNOWN and noisy <= NOISY and level.gross == 0,
    )
    yield Claim(
        f"{subject}: largest error of F at any sample farther than 2 ms from an event",
        f"≤ {LARGEST:g}× what was asked",
        f"{level.largest_ratio:.1f}×",
        level.largest_ratio <= LARGEST,
    )
    if level.asked in NOT_TIGHTER_THAN_NEEDED:
        yield Claim(
            f"{subject}: median error, so that it is not bought by too short steps",
            f"≥ {MEDIAN:g}× what was asked",
            f"{level.median_ratio:.2f}×",
            level.median_ratio >= MEDIAN,
        )
    if level.asked == DEFAULT:
        yield from _at_default(subject, level)


def _at_default(subject: str, level: Level) -> Iterator[Claim]:
    sensitive = level.sensitive / max(1, len(level.judged))
    yield Claim(
        f"{subject}: scenes in which a picometre matters",
        f"≤ {100 * SENSITIVE:g} %",
        f"{100 * sensitive:.1f} %",
        sensitive <= SENSITIVE,
    )
    kept = level.energy_kept(ENERGY)
    yield Claim(
        f"{subject}: runs whose balance of energy is closed to {100 * ENERGY:g} %",
        f"≥ {100 * ENERGY_SHARE:g} %",
        f"{100 * kept:.1f} %",
        kept >= ENERGY_SHARE,
    )
    yield Claim(
        f"{subject}: CPU time of one run, " + ", ".join(name for *_, name in CPU),
        ", ".join(f"≤ {1e3 * bound:g} ms" for _, bound, _ in CPU),
        ", ".join(f"{1e3 * level.cpu_time(share):.3g} ms" for share, *_ in CPU),
        all(level.cpu_time(share) <= bound for share, bound, _ in CPU),
    )


def of_dense(differences: list[Difference]) -> list[Claim]:
    """Claim about the references."""
    exact = [one.force_rms for one in differences if not one.flat and one.failure is None]
    if not exact:
        return []
    return [
        Claim(
            f"{len(exact)} random scenes, contact in points: RMS difference of F to scipy's Radau "
            "on independently derived equations, largest",
            f"≤ {100 * DENSE:g} %",
            f"{100 * max(exact):.1g} %",
            max(exact) <= DENSE,
        )
    ]


def of_mujoco(comparisons: list[Comparison]) -> list[Claim]:
    """Claims about speed at the same error, one for each of MuJoCo's settings."""
    claims = []
    for setting in dict.fromkeys(one.setting for one in comparisons):
        rows = [one for one in comparisons if one.setting == setting]
        ratios = ratios_of(rows)
        text = f"{len(rows)} random scenes: times faster than MuJoCo, {setting}, at its error"
        if not ratios:
            claims.append(Claim(text, f"median ≥ {TIMES_FASTER:g}", "not measured", None))
            continue
        low, median, high = np.quantile(ratios, (0.25, 0.5, 0.75))
        found = f"median {median:.0f}, quartiles {low:.0f} and {high:.0f}"
        if len(ratios) < len(rows):
            found += f"; MuJoCo too wrong to be timed in {len(rows) - len(ratios)}"
        claims.append(
            Claim(text, f"median ≥ {TIMES_FASTER:g}", found, bool(median >= TIMES_FASTER))
        )
    return claims


def ratios_of(comparisons: list[Comparison]) -> list[float]:
    """How many times faster this package is, where MuJoCo's result counts."""
    found = [one.ratio for one in comparisons if one.ratio is not None]
    return [ratio for ratio in found if not math.isnan(ratio)]
