"""Simulation of a passive compliant gripper of hot-melt adhesive, in 2D.

The names below are imported when they are first used: a program that needs none of them, or is
still to prepare for signals, does not wait for the solver to load.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hma_gripper_sim.contact_warnings import PenetrationWarning, UnmodelledContactWarning
    from hma_gripper_sim.contour import Circle, Contour, Polygon, RoundedBox
    from hma_gripper_sim.design import GripperDesign, Material, Tip
    from hma_gripper_sim.error_estimate import ErrorEstimate
    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.outcome import Outcome, SimulationError, SolverStats
    from hma_gripper_sim.scene import Scene
    from hma_gripper_sim.shipped import config_directory
    from hma_gripper_sim.simulation import Simulation, SimulationState, Snapshot, simulate
    from hma_gripper_sim.trace import Trace
    from hma_gripper_sim.validity import Finding, Severity

__all__ = [
    "Circle",
    "Contour",
    "ErrorEstimate",
    "Finding",
    "GripperDesign",
    "InputError",
    "Material",
    "Outcome",
    "PenetrationWarning",
    "Polygon",
    "RoundedBox",
    "Scene",
    "Severity",
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

_MODULES = {
    "contact_warnings": ("PenetrationWarning", "UnmodelledContactWarning"),
    "contour": ("Circle", "Contour", "Polygon", "RoundedBox"),
    "design": ("GripperDesign", "Material", "Tip"),
    "error_estimate": ("ErrorEstimate",),
    "errors": ("InputError",),
    "outcome": ("Outcome", "SimulationError", "SolverStats"),
    "scene": ("Scene",),
    "shipped": ("config_directory",),
    "simulation": ("Simulation", "SimulationState", "Snapshot", "simulate"),
    "trace": ("Trace",),
    "validity": ("Finding", "Severity"),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            value = getattr(import_module(f"{__name__}.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
