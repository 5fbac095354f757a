"""All discretisations, by name."""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from hma_gripper_sim.mechanics import discretisations
from hma_gripper_sim.mechanics.discretisations.base import Discretisation


def _all() -> Mapping[str, Discretisation]:
    for module in pkgutil.iter_modules(discretisations.__path__, f"{discretisations.__name__}."):
        if module.name != __name__:
            import_module(module.name)
    found = (kind() for kind in Discretisation.__subclasses__())
    return MappingProxyType(
        {each.name: each for each in sorted(found, key=lambda each: each.column_error[1])}
    )


DISCRETISATIONS = _all()
"""Those of all files in this room, the lowest order first."""
