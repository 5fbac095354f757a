"""Every hard case converges, is accurate, stays finite and keeps its energy balance."""

from __future__ import annotations

import pytest

from hma_gripper_benchmarks.hard_cases import (
    CHAOTIC_CASES,
    DEVIATION_BOUND,
    HardCase,
    examine,
    hard_cases,
)
from hma_gripper_sim import Outcome


@pytest.mark.parametrize("case", hard_cases(), ids=lambda case: case.title)
def test_converges_agrees_with_a_tighter_tolerance_and_balances_its_energy(case: HardCase) -> None:
    verdict = examine(case)
    assert verdict.outcome is Outcome.CONVERGED
    assert verdict.failures == ()
    if case.title in CHAOTIC_CASES:
        assert verdict.sensitivity > DEVIATION_BOUND, "chaotic no longer: take it off the list"


def test_titles_tell_cases_apart() -> None:
    titles = [case.title for case in hard_cases()]
    assert len(set(titles)) == len(titles)
    assert set(CHAOTIC_CASES) <= set(titles)
