"""The thesis' cantilever under an end load, for chains of any number of GBEs."""

from __future__ import annotations

import numpy as np

from hma_gripper_sim.kernels.chain import chain_workspace, tip_response
from hma_gripper_sim.kernels.static_equilibrium import solve_dead_load
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.mechanics.half_gripper import cantilever
from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError
from hma_gripper_sim.units import choice, quantity, whole_number

LENGTH = 0.030  # m
SECOND_MOMENT_OF_AREA = 22e-12  # m^4
YOUNGS_MODULUS = 8.9e6  # Pa
FORCE = 0.05  # N


def cantilever_deflection(
    n: int,
    discretisation: str = "thesis",
    *,
    length: float = LENGTH,
    bending_stiffness: float = YOUNGS_MODULUS * SECOND_MOMENT_OF_AREA,
    force: float = FORCE,
) -> float:
    """Static tip deflection of a clamped weightless beam of `n` GBEs (thesis Table 2.1) [m].

    The chain is solved geometrically exactly; the load keeps its direction.

    Parameters
    ----------
    n
        Number of GBEs; in the ``thesis`` discretisation the first is welded to the clamp.
    discretisation
        ``thesis``, ``midpoint`` or ``gauss``.
    length
        [m]
    bending_stiffness
        E I [N m^2].
    force
        End load across the undeformed beam [N].

    Raises
    ------
    InputError
        An argument is out of range.
    SimulationError
        No equilibrium was found: the load is far beyond what bends such a beam once.
    """
    known = tuple(DISCRETISATIONS)
    choice(discretisation, known, field="discretisation", source="cantilever_deflection")
    minimum = 2 if DISCRETISATIONS[discretisation].joints_at_sections else 1
    count = whole_number(n, field="n", source="cantilever_deflection", minimum=minimum)
    length, bending_stiffness = (
        quantity(
            value, unit, field=name, source="cantilever_deflection", minimum=0.0, exclusive=True
        )
        for name, value, unit in (
            ("length", length, "m"),
            ("bending_stiffness", bending_stiffness, "N*m^2"),
        )
    )
    force = quantity(force, "N", field="force", source="cantilever_deflection")
    chain = cantilever(length, count, bending_stiffness, discretisation)
    joints = len(chain.rest)
    q, at_rest, increment = np.zeros((3, joints))
    tip = tip_response()
    solved = solve_dead_load(
        chain,
        np.array([0.0, -force]),
        np.zeros(3),
        q,
        at_rest,
        increment,
        np.zeros(3),
        chain_workspace(joints),
        tip,
    )
    if not solved:
        raise SimulationError(Outcome.NO_EQUILIBRIUM, 0.0)
    return -float(tip.pose[1] + np.sin(tip.pose[2]) * chain.link[-1, 0])
