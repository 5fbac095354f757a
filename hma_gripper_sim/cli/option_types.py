"""Types of options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from hma_gripper_sim.units import typed_quantity

FILE = click.Path(path_type=Path)


class Quantity(click.ParamType):  # type: ignore[type-arg]  # generic from click 8.3 on
    """A quantity with its unit, such as ``20 um``; a bare number is in the SI unit.

    Parameters
    ----------
    unit
        SI, in pint's notation.
    bounds
        As `units.quantity` takes them.
    """

    name = "quantity"

    def __init__(self, unit: str, **bounds: Any) -> None:
        self.unit = unit
        self.bounds = bounds

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the value in the SI unit; raise `InputError` with the option's name."""
        field = param.opts[0] if param is not None else None
        return typed_quantity(str(value), self.unit, field=field, **self.bounds)
