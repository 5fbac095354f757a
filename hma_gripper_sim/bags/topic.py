"""What a log says of a topic."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Topic:
    """A topic, its message type and whether late subscribers get the last message."""

    name: str
    msgtype: str
    latched: bool = False
