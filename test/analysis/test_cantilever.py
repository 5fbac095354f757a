"""The cantilever of the thesis (Table 2.1) against its printed figures and against the elastica."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from hma_gripper_sim import InputError, Outcome, SimulationError
from hma_gripper_sim.analysis import cantilever_deflection

LENGTH, STIFFNESS, FORCE = 0.03, 8.9e6 * 22e-12, 0.05  # m, N m^2, N: thesis 2.1.3


def elastica(length: float = LENGTH, stiffness: float = STIFFNESS, force: float = FORCE) -> float:
    """Tip deflection of the elastica, by shooting [m].

    E I theta'' = -P cos(theta), theta(0) = 0, theta'(L) = 0, y' = sin(theta), where the load P
    keeps its direction.
    """

    def shoot(curvature: float) -> np.ndarray:
        solution = solve_ivp(
            lambda _, y: [y[1], -force / stiffness * math.cos(y[0]), math.sin(y[0])],
            (0.0, length),
            [0.0, curvature, 0.0],
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        return solution.y[:, -1]

    linear = force * length / stiffness
    root = brentq(lambda c: shoot(c)[1], 0.2 * linear, 1.2 * linear, xtol=1e-13, rtol=1e-13)
    return float(shoot(root)[2])


@pytest.mark.parametrize(
    ("n", "printed"),
    [
        (2, "0.860"),
        (5, "1.65"),
        (10, "1.96"),
        (50, "2.22"),
        (100, "2.25"),
        (200, "2.27"),
        (500, "2.28"),
    ],
)
def test_table_2_1(n: int, printed: str) -> None:
    """All seven tip deflections of Table 2.1 [mm], to the digits the thesis prints."""
    digits = len(printed.partition(".")[2])
    deflection = 1e3 * cantilever_deflection(n, discretisation="thesis")
    assert f"{deflection:.{digits}f}" == printed


def test_elastica_is_solved_correctly() -> None:
    """For a small load the elastica is the linear beam: y = P L^3 / (3 E I).

    The first correction of the linear theory is of the order of the slope squared:
    (P L^2 / 2 E I)^2 = 1.3e-9 at this load.
    """
    force = 1e-4 * 2.0 * STIFFNESS / LENGTH**2 * 0.36
    linear = force * LENGTH**3 / (3.0 * STIFFNESS)
    assert elastica(force=force) == pytest.approx(linear, rel=1e-8)


def test_midpoint_against_the_elastica() -> None:
    """10 GBEs with their joints in the middle: within 0.26 % of the exact beam."""
    assert cantilever_deflection(10, discretisation="midpoint") == pytest.approx(
        elastica(), rel=2.6e-3
    )


@pytest.mark.parametrize("force", [0.05, 0.5, 2.0])
def test_midpoint_is_of_second_order(force: float) -> None:
    """Error against the elastica for n = 10, 20, 40, 80: observed order at least 1.9.

    The larger loads bend the beam by 40 and 70 degrees, far beyond the linear theory.
    """
    exact = elastica(force=force)
    errors = [
        abs(cantilever_deflection(n, discretisation="midpoint", force=force) - exact)
        for n in (10, 20, 40, 80)
    ]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders.min() >= 1.9


def test_gauss_is_exact_for_small_loads() -> None:
    """Two joints at Gauss points integrate P x^2 / (E I) exactly: y = P L^3 / (3 E I)."""
    force = 1e-6
    linear = force * LENGTH**3 / (3.0 * STIFFNESS)
    for n in (2, 3, 5):
        assert cantilever_deflection(n, "gauss", force=force) == pytest.approx(linear, rel=1e-8)


@pytest.mark.parametrize(("force", "accuracy"), [(0.05, 1e-5), (0.2, 2e-3)])
def test_gauss_against_the_elastica(force: float, accuracy: float) -> None:
    """Two GBEs within the stated share, and from 4 to 8 to 16 an observed order of at least 3.

    The joints' slides correct foreshortening to second order of the angles: what is left is of
    fourth order.
    """
    exact = elastica(force=force)
    assert cantilever_deflection(2, "gauss", force=force) == pytest.approx(exact, rel=accuracy)
    errors = [abs(cantilever_deflection(n, "gauss", force=force) / exact - 1.0) for n in (4, 8, 16)]
    assert errors[0] < 1e-3
    assert np.log2(np.array(errors[:-1]) / np.array(errors[1:])).min() >= 3.0


def test_thesis_discretisation_is_of_first_order() -> None:
    """Error against the elastica for n = 50 to 400: order 1, so its 500 GBEs still miss 0.30 %."""
    exact = elastica()
    errors = [abs(cantilever_deflection(n) - exact) for n in (50, 100, 200, 400)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(orders, 1.0, atol=0.05)
    assert abs(cantilever_deflection(500) / exact - 1.0) == pytest.approx(0.0030, abs=5e-5)
    assert abs(cantilever_deflection(10) / exact - 1.0) == pytest.approx(0.144, abs=5e-4)


def test_one_joint_by_hand() -> None:
    """Two GBEs of the thesis have one joint at L/2: k q = P (L/2) cos(q), y = (L/2) sin(q)."""
    spring = STIFFNESS / (LENGTH / 2.0)
    angle = brentq(lambda q: spring * q - FORCE * LENGTH / 2.0 * math.cos(q), 0.0, 1.0, xtol=1e-15)
    assert cantilever_deflection(2) == pytest.approx(LENGTH / 2.0 * math.sin(angle), rel=1e-12)


def test_deflection_is_odd_in_the_force() -> None:
    """Turning the load round turns the deflection round."""
    assert cantilever_deflection(10, force=-FORCE) == pytest.approx(
        -cantilever_deflection(10), rel=1e-12
    )
    assert cantilever_deflection(10, force=0.0) == 0.0


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"n": 1}, "n"),
        ({"n": 0, "discretisation": "midpoint"}, "n"),
        ({"n": -3}, "n"),
        ({"n": 2.5}, "n"),
        ({"n": math.nan}, "n"),
        ({"n": math.inf}, "n"),
        ({"n": "10"}, "n"),
        ({"n": True}, "n"),
        ({"n": None}, "n"),
        ({"n": 10, "discretisation": "spline"}, "discretisation"),
        ({"n": 10, "discretisation": None}, "discretisation"),
        ({"n": 10, "length": 0.0}, "length"),
        ({"n": 10, "length": -0.03}, "length"),
        ({"n": 10, "length": "30 kg"}, "length"),
        ({"n": 10, "bending_stiffness": math.inf}, "bending_stiffness"),
        ({"n": 10, "force": math.nan}, "force"),
        ({"n": 10, "force": [0.05]}, "force"),
    ],
)
def test_bad_arguments(arguments: dict, field: str) -> None:
    """Whatever cannot be used is refused with its name and a reason."""
    with pytest.raises(InputError, match="cantilever_deflection") as refusal:
        cantilever_deflection(**arguments)
    assert refusal.value.field == field
    assert refusal.value.reason


def test_absurd_load_has_a_named_outcome() -> None:
    """A load a million times beyond what folds the beam ends in an answer or a named outcome."""
    outcome = Outcome.CONVERGED
    try:
        deflection = cantilever_deflection(10, force=5e4)
    except SimulationError as error:
        outcome = error.outcome
    if outcome is Outcome.CONVERGED:
        assert 0.0 < deflection <= LENGTH
    else:
        assert outcome is Outcome.NO_EQUILIBRIUM
