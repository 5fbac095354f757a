"""All shapes of objects, by what files and parameters call them.

A new shape is a new file in this room: it is found there.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Any

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model import contours
from hma_gripper_sim.model.contours.base import Contour
from hma_gripper_sim.model.numbers import read_numbers
from hma_gripper_sim.units import choice


@cache
def shapes() -> Mapping[str, type[Contour]]:
    """Return the shapes of all files in this room, in alphabetical order."""
    for module in pkgutil.iter_modules(contours.__path__, f"{contours.__name__}."):
        import_module(module.name)
    found = {shape.kind: shape for shape in Contour.__subclasses__()}
    return MappingProxyType(dict(sorted(found.items())))


def contour_from_mapping(
    mapping: Mapping[str, Any], *, source: str | None = None, field: str | None = None
) -> Contour:
    """Build a contour from fields such as ``{"type": "box", "width": "28 mm", ...}``.

    Raises
    ------
    InputError
        An unknown type or field, a missing one, or a value that cannot be used.
    """
    known = shapes()
    try:
        if not isinstance(mapping, Mapping):
            raise InputError("expected a mapping of fields")
        if "type" not in mapping:
            raise InputError(f"is missing: one of {', '.join(known)}", field="type")
        shape = known[choice(mapping["type"], tuple(known), field="type")]
        return shape(**read_numbers(shape, mapping, beside=("type",)))
    except InputError as error:
        plain = InputError(error.reason, field=error.field)
        raise plain.within(source=source, field_prefix=field) from None
