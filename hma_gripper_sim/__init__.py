"""Simulation of a passive compliant gripper of hot-melt adhesive, in 2D.

The names below are imported when they are first used: a program that needs none of them, or is
still to prepare for signals, does not wait for the solver to load.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.mechanics.outcome import (
        Outcome,
        SimulationError,
        SolverStats,
        ToleranceWarning,
    )
    from hma_gripper_sim.mechanics.scene import Scene
    from hma_gripper_sim.mechanics.states import Snapshot
    from hma_gripper_sim.model.contours.base import Contour
    from hma_gripper_sim.model.contours.circle import Circle
    from hma_gripper_sim.model.contours.polygon import Polygon
    from hma_gripper_sim.model.contours.rounded_box import RoundedBox
    from hma_gripper_sim.model.gripper import GripperDesign, Material, Tip
    from hma_gripper_sim.results.contact_warnings import (
        PenetrationWarning,
        UnmodelledContactWarning,
    )
    from hma_gripper_sim.results.error_estimate import ErrorEstimate
    from hma_gripper_sim.results.validity import Finding, Severity
    from hma_gripper_sim.simulation.simulation import Simulation, simulate
    from hma_gripper_sim.simulation.state import SimulationState
    from hma_gripper_sim.simulation.trace import Trace
    from hma_gripper_sim.yaml_reading import config_directory

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
    "ToleranceWarning",
    "Trace",
    "UnmodelledContactWarning",
    "config_directory",
    "simulate",
]

_MODULES = {
    "yaml_reading": ("config_directory",),
    "errors": ("InputError",),
    "model.contours.base": ("Contour",),
    "model.contours.circle": ("Circle",),
    "model.contours.polygon": ("Polygon",),
    "model.contours.rounded_box": ("RoundedBox",),
    "model.gripper": ("GripperDesign", "Material", "Tip"),
    "mechanics.scene": ("Scene",),
    "results.contact_warnings": ("PenetrationWarning", "UnmodelledContactWarning"),
    "results.validity": ("Finding", "Severity"),
    "results.error_estimate": ("ErrorEstimate",),
    "mechanics.states": ("Snapshot",),
    "mechanics.outcome": ("Outcome", "SimulationError", "SolverStats", "ToleranceWarning"),
    "simulation.simulation": ("Simulation", "simulate"),
    "simulation.state": ("SimulationState",),
    "simulation.trace": ("Trace",),
}

# What the documentation of earlier versions imports, and where it is now.
_MOVED = {
    f"{__name__}.{old}": f"{__name__}.{new}"
    for old, new in {
        "logs": "recordings (`reading`, `signal_map`)",
        "reduced": "analysis.thesis_joints",
    }.items()
}


class _MovedModules:
    """A finder that finds nothing, but says where a module is that has moved."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> None:
        if name in _MOVED:
            raise ModuleNotFoundError(f"{name} is now {_MOVED[name]}")


sys.meta_path.insert(0, _MovedModules)


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            value = getattr(import_module(f"{__name__}.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
