"""What the metadata of a rosbag2 directory say about the log in it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hma_gripper_sim.bags.message_batches import absolute
from hma_gripper_sim.errors import InputError, printable
from hma_gripper_sim.units import read_yaml

METADATA = "metadata.yaml"
"""Name of the file that holds them."""

REMARKS_KEY = "hma_gripper_sim.remarks"
"""Under which they hold how far what was simulated can be trusted: a list of texts in JSON."""


def is_blank(file: Path) -> bool:
    """Return whether a file holds nothing, or nothing but NUL: what a crash leaves behind."""
    if not file.is_file():
        return False
    with file.open("rb") as stream:
        while piece := stream.read(2**20):
            if piece.strip(b"\0"):
                return False
    return True


def bag_information(path: str | Path) -> dict[str, Any]:
    """Return the metadata of the log at `path`; empty if it has none."""
    metadata = Path(path) / METADATA
    if not metadata.is_file() or is_blank(metadata):
        return {}
    information = read_yaml(metadata).get("rosbag2_bagfile_information") or {}
    if not isinstance(information, dict):
        reason = "expected a mapping of fields"
        raise InputError(reason, field="rosbag2_bagfile_information", source=str(metadata))
    return information


def custom_data(path: str | Path, key: str) -> Any:
    """Return what the metadata of a log hold under a key of this project's, as JSON; or None.

    Raises
    ------
    InputError
        That is no JSON.
    """
    entries = bag_information(path).get("custom_data")
    text = entries.get(key) if isinstance(entries, dict) else None
    if text is None:
        return None
    try:
        return json.loads(text)
    except (ValueError, TypeError, RecursionError):
        raise InputError("is no JSON", field=key, source=str(path)) from None


def counted_messages(path: str | Path, topic: str) -> int | None:
    """Return how many messages of a topic a log's metadata count; None if they do not say."""
    topics = bag_information(path).get("topics_with_message_count")
    for entry in topics if isinstance(topics, list) else ():
        try:
            if absolute(entry["topic_metadata"]["name"]) == topic:
                return int(entry["message_count"])
        except (AttributeError, KeyError, TypeError, ValueError):
            return None
    return None


def remarks_text(remarks: Sequence[str]) -> str:
    """Return remarks as `read_remarks` finds them again."""
    return json.dumps(list(remarks), ensure_ascii=False)


def read_remarks(path: str | Path) -> tuple[str, ...]:
    """Return what a log says about the error and validity of its simulation, if it does.

    Raises
    ------
    InputError
        It is not what a replay writes.
    """
    remarks = custom_data(path, REMARKS_KEY)
    if remarks is None:
        return ()
    if not isinstance(remarks, list) or not all(isinstance(remark, str) for remark in remarks):
        raise InputError("is no JSON list of texts", field=REMARKS_KEY, source=str(path))
    return tuple(map(printable, remarks))
