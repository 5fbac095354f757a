"""A short course on a coarse gripper, replayed once."""

from __future__ import annotations

from short_replay import course, parameters, replayed

__all__ = ["course", "parameters", "replayed"]
