"""Simulation of a passive compliant gripper of hot-melt adhesive, in 2D."""

from __future__ import annotations

from hma_gripper_sim.contour import Circle, Contour, Polygon, RoundedBox
from hma_gripper_sim.design import GripperDesign, Material, Tip
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.outcome import Outcome, SimulationError, SolverStats
from hma_gripper_sim.scene import Scene
from hma_gripper_sim.shipped import config_directory
from hma_gripper_sim.simulation import Simulation, SimulationState, Snapshot, simulate
from hma_gripper_sim.trace import Trace, UnmodelledContactWarning

__all__ = [
    "Circle",
    "Contour",
    "GripperDesign",
    "InputError",
    "Material",
    "Outcome",
    "Polygon",
    "RoundedBox",
    "Scene",
    "Simulation",
    "SimulationError",
    "SimulationState",
    "Snapshot",
    "SolverStats",
    "Tip",
    "Trace",
    "UnmodelledContactWarning",
    "config_directory",
    "simulate",
]
