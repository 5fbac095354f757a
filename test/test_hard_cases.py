"""Every hard case converges, is accurate, stays finite and keeps its energy balance."""

from __future__ import annotations

import pytest

from hma_gripper_sim import Outcome
from hma_gripper_sim.benchmark.hard_cases import HardCase, examine, hard_cases

_STICK_SLIP = "a self-excited stick-slip oscillation gets out of phase; finer tolerances converge"
KNOWN_DEFECTS = {
    "friction: 1, box, continuous": _STICK_SLIP,
    "friction: 1.3, box, continuous": _STICK_SLIP,
    "friction: 1.3, box, sampled": "the instant of buckling is sensitive: tolerances from 1e-3 "
    "to 1e-6 are all about 2 % RMS off 1e-8, and 1e-7 is 1 % off",
    "friction: 1.3, cylinder, continuous": _STICK_SLIP,
    "sharp corners: radius 0 mm, sampled": _STICK_SLIP,
    "sharp corners: radius 0.1 mm, sampled": _STICK_SLIP,
    "joint damping: times 0, box": "undamped beams go on vibrating after the first slip: runs at "
    "any two tolerances down to 1e-8 differ by 7 to 25 % RMS",
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
