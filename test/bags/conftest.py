"""Logs made up message by message."""

from __future__ import annotations

from made_up_logs import (
    as_ros1,
    by_mcap,
    by_two_callers,
    entries,
    five_ticks,
    make_ticks,
    serialise,
    storages,
    stored_log,
    write_log,
)

__all__ = [
    "as_ros1",
    "by_mcap",
    "by_two_callers",
    "entries",
    "five_ticks",
    "make_ticks",
    "serialise",
    "storages",
    "stored_log",
    "write_log",
]
