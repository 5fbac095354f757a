"""Names of the gripper's joints: the contract with everybody who reads joint states."""

from __future__ import annotations

import re

from hma_gripper_sim.errors import InputError

SLIDE = "slide"
"""Name of the prismatic joint; all others are revolute."""

SIDES = ("right", "left")
PARTS = ("top", "beam", "tip")
"""Parts of a half, from the middle outwards."""


def check_prefix(prefix: str, *, field: str) -> None:
    """Raise `InputError` unless names of joints and frames can begin with it; it may be empty."""
    if re.fullmatch("([A-Za-z][A-Za-z0-9_]*)?", prefix) is None:
        raise InputError(
            f"must be of letters, digits and _, and begin with a letter, got {prefix!r}",
            field=field,
        )


def joint_name(part: str, side: str, number: int) -> str:
    """Return the name of a revolute joint; a tip has only one, which has no number."""
    return f"{part}_{side}" if part == "tip" else f"{part}_{side}_{number}"
