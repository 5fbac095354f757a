"""The thesis' cantilever (Table 2.1): a chain of up to 500 GBEs, statically and to rest.

To rest: the load is the weight of a small body on the beam's end, let go with the beam
straight; the beam is all but weightless and as viscous as the gripper's.  Its rest is the
static solution, and other simulators can express it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from hma_gripper_benchmarks import peers
from hma_gripper_benchmarks.measuring import interleaved
from hma_gripper_sim.analysis import cantilever_deflection
from hma_gripper_sim.analysis.cantilever import (
    FORCE,
    LENGTH,
    SECOND_MOMENT_OF_AREA,
    YOUNGS_MODULUS,
)
from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.stage import Model
from hma_gripper_sim.mechanics.half_gripper import cantilever
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.start_pose import start_state
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.motion.prescribed_motion import ramp
from hma_gripper_sim.simulation.simulation import Half

Array = NDArray[np.float64]

STIFFNESS = YOUNGS_MODULUS * SECOND_MOMENT_OF_AREA
ELASTICA = 2.284544285732849e-3  # m; inextensible continuous beam
PRINTED = {2: 0.860, 5: 1.65, 10: 1.96, 50: 2.22, 100: 2.25, 200: 2.27, 500: 2.28}  # mm
GRAVITY = 9.81  # m/s^2
BEAM_MASS = 1e-6  # of the load's
SMALLEST_INERTIA = 1e-14  # kg m^2; that MuJoCo accepts
DURATION = 1.0  # s
TOLERANCE = 1e-4
AT_REST = 1e-3  # error of the deflection that a run to rest may have


@dataclass(frozen=True)
class CantileverRow:
    """One number of GBEs; times are CPU times [s], errors relative to the exact chain.

    Parameters
    ----------
    elements
        Number of GBEs.
    deflection
        Of the exact chain, by shooting [m].
    static_time, static_error
        This package's static solution.
    dynamic_time, dynamic_error
        This package's run to rest.
    peers
        For each peer's setting its time and error to rest; no time where it missed.
    """

    elements: int
    deflection: float
    static_time: float
    static_error: float
    dynamic_time: float
    dynamic_error: float
    peers: dict[str, tuple[float | None, float]]


def exact_deflection(elements: int) -> float:
    """Tip deflection of the thesis' chain by shooting from its free end [m]."""
    length = LENGTH / elements
    stiffness = STIFFNESS / length

    def shoot(tip_angle: float) -> tuple[float, float]:
        angle, moment, drop = tip_angle, 0.0, 0.0
        for _ in range(elements - 1):
            moment += FORCE * length * math.cos(angle)
            drop += length * math.sin(angle)
            angle -= moment / stiffness
        return angle, drop

    tip = brentq(lambda angle: shoot(angle)[0], 0.0, 1.0, xtol=1e-15)
    return shoot(float(tip))[1]


def loaded_chain(elements: int) -> Chain:
    """The chain with the load as a body on its end."""
    chain = cantilever(LENGTH, elements, STIFFNESS, "thesis")
    design = GripperDesign.thesis_2013()
    n = elements - 1
    load = FORCE / GRAVITY
    mass = np.full(n, BEAM_MASS * load / n)
    centre = 0.5 * chain.link
    mass[-1], centre[-1] = load, chain.link[-1]
    inertia = np.maximum(mass * (LENGTH / elements) ** 2 / 12.0, SMALLEST_INERTIA)
    inertia[-1] = load * 1e-6 * LENGTH**2
    damping = np.full(n, design.joint_damping * design.damping_length * elements / LENGTH)
    return chain._replace(mass=mass, centre=centre, inertia=inertia, damping=damping)


def rest_run(elements: int) -> Callable[[], float]:
    """Run to rest with this package; it returns the deflection."""
    chain = loaded_chain(elements)
    template = Scene(GripperDesign.thesis_2013(), Circle(radius=0.001)).models[0]
    obstacle = template.obstacle._replace(
        vertices=template.obstacle.vertices + 10.0, centre=template.obstacle.centre + 10.0
    )
    model: Model = template._replace(chain=chain, obstacle=obstacle, gravity=GRAVITY)
    motion = ramp(0.0, 0.0, DURATION, 0.0, 0.0, True)
    straight = start_state(model)
    straight.q[:] = 0.0

    def run() -> float:
        half = Half(model, straight)
        half.run(motion, TOLERANCE)
        return _deflection(chain, half.state.q)

    return run


def _deflection(chain: Chain, q: Array) -> float:
    return -float(np.sin(np.cumsum(q)) @ chain.link[:, 0])


def measure(counts: tuple[int, ...], rounds: int, tick: Callable[[], None]) -> list[CantileverRow]:
    """Time the static solution and the run to rest."""
    modules = [peers.load(name) for name in ("MuJoCo", "Exudyn") if peers.installed_version(name)]
    rows = []
    for n in counts:
        exact = exact_deflection(n)

        def static(n: int = n) -> float:
            return cantilever_deflection(n)

        dynamic = rest_run(n)
        others: dict[str, Callable[[], float]] = {}
        for module in modules:
            others.update(module.cantilever_runs(loaded_chain(n), GRAVITY, DURATION))
        runs = [static, dynamic, *others.values()]
        errors = [abs(run() / exact - 1.0) for run in runs]
        times = interleaved(runs, rounds, tick)
        rows.append(
            CantileverRow(
                n,
                exact,
                times[0],
                errors[0],
                times[1],
                errors[1],
                {
                    name: (spent if error <= AT_REST else None, error)
                    for name, spent, error in zip(others, times[2:], errors[2:], strict=True)
                },
            )
        )
    return rows
