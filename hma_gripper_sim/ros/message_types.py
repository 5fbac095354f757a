"""Message classes by the names that logs and the table of topics have for them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from hma_gripper_sim.bags.topic import Topic


def message_type(topic: Topic) -> Any:
    """Return the class of a topic's messages."""
    package, _, name = topic.msgtype.partition("/msg/")
    return getattr(import_module(f"{package}.msg"), name)
