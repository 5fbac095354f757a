"""Beam theory references, convergence and error measures."""

from __future__ import annotations

from hma_gripper_sim.analysis.cantilever import cantilever_deflection

__all__ = ["cantilever_deflection"]
