"""What was simulated, in words: what tells two reports apart."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

Facts = tuple[tuple[str, str], ...]
"""Pairs of what it is and what it was."""

_STATED: Mapping[str, tuple[str, str]] = {
    "friction": ("Friction", ""),
    "clearance": ("Clearance", "m"),
    "offset": ("Offset", "m"),
    "design": ("Design", ""),
    "contact": ("Contact", ""),
    "sampled_normal": ("Normals of sampled contact", ""),
    "discretisation": ("Discretisation", ""),
    "elements_top": ("Elements of the top", ""),
    "elements_beam": ("Elements of a beam", ""),
    "accuracy": ("Accuracy", ""),
    "tolerance": ("Tolerance", ""),
    "gravity": ("Gravity", "m/s²"),
    "normal_stiffness": ("Contact stiffness", "N/m"),
    "normal_damping": ("Contact damping", "N s/m"),
    "slip_velocity": ("Slip velocity", "m/s"),
}
"""Parameters by name: what a report calls them, and their unit."""

_WORDS: Mapping[tuple[str, str], str] = {
    ("design", ""): "of the thesis",
    ("elements_top", "0"): "",
    ("elements_beam", "0"): "",
}
"""Values that stand for something else; for what need not be said if that is empty."""


def simulation_facts(parameters: Mapping[str, object]) -> Facts:
    """Return what parameters, by the node's names and in SI, say of a simulation."""
    if not parameters:
        return (("Simulation", "the log does not say what was simulated"),)
    name = str(parameters.get("contour", ""))
    begin = f"contours.{name}."
    shape = {k.removeprefix(begin): v for k, v in parameters.items() if k.startswith(begin)}
    placed: dict[str, object] = {k: shape.pop(k) for k in ("clearance", "offset") if k in shape}
    sizes = ", ".join(f"{k.replace('_', ' ')} {_shown(v)}" for k, v in sorted(shape.items()))
    facts = [("Object", f"{name} ({sizes}; SI)" if sizes else name)]
    for key, value in {**placed, **parameters}.items():
        if key in _STATED:
            term, unit = _STATED[key]
            text = _WORDS.get((key, str(value)), f"{_shown(value)} {unit}".strip())
            facts += [(term, text)] if text else []
    return tuple(facts)


def program_version() -> str:
    """Return which version of this package compares."""
    try:
        return f"hma_gripper_sim {version('hma_gripper_sim')}"
    except PackageNotFoundError:
        return "hma_gripper_sim, not installed"


def _shown(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return f"{value:.12g}"
