"""Every hard case converges, is accurate, stays finite and keeps its energy balance."""

from __future__ import annotations

import pytest

from hma_gripper_sim import Outcome
from hma_gripper_sim.benchmark.hard_cases import HardCase, examine, hard_cases

KNOWN_DEFECTS = {
    "friction: 1, box, sampled": "1.3 % RMS: a self-excited vibration grows from less than the "
    "tolerance, so that it begins a little later than at a finer one; from 1e-4 on it agrees",
}


def parameters() -> list[object]:
    found = []
    for case in hard_cases():
        reason = KNOWN_DEFECTS.get(case.title)
        # Not strict: where the phase ends up is a matter of rounding.
        marks = [] if reason is None else [pytest.mark.xfail(reason=reason, strict=False)]
        found.append(pytest.param(case, id=case.title, marks=marks))
    return found


@pytest.mark.parametrize("case", parameters())
def test_converges_agrees_with_a_tighter_tolerance_and_balances_its_energy(case: HardCase) -> None:
    verdict = examine(case)
    assert verdict.outcome is Outcome.CONVERGED
    assert verdict.failures == ()


def test_the_list_above_names_cases_that_exist() -> None:
    titles = [case.title for case in hard_cases()]
    assert len(set(titles)) == len(titles)
    assert set(KNOWN_DEFECTS) <= set(titles)
