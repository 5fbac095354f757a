"""Names of the gripper's joints: the contract with everybody who reads joint states."""

from __future__ import annotations

SLIDE = "slide"
"""Name of the prismatic joint; all others are revolute."""

SIDES = ("right", "left")
PARTS = ("top", "beam", "tip")
"""Parts of a half, from the middle outwards."""


def joint_name(part: str, side: str, number: int) -> str:
    """Return the name of a revolute joint; a tip has only one, which has no number."""
    return f"{part}_{side}" if part == "tip" else f"{part}_{side}_{number}"
