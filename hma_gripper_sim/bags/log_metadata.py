"""What the metadata of a rosbag2 directory say about the log in it."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from hma_gripper_sim.bags.message_batches import absolute
from hma_gripper_sim.errors import InputError, printable
from hma_gripper_sim.yaml_reading import read_yaml

METADATA = "metadata.yaml"
"""Name of the file that holds them."""

PARAMETERS_KEY = "hma_gripper_sim.parameters"
"""Under which they hold what was simulated, by the names of the node's parameters, in JSON."""

REMARKS_KEY = "hma_gripper_sim.remarks"
"""Under which they hold how far what was simulated can be trusted: a list of texts in JSON."""


_Kind = TypeVar("_Kind", "dict[str, Any]", "list[Any]")


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


def custom_data(path: str | Path, key: str, kind: type[_Kind]) -> _Kind | None:
    """Return what the metadata of a log hold under a key of this project's, if anything.

    Raises
    ------
    InputError
        That is not JSON of the expected kind, a mapping or a list.
    """
    entries = bag_information(path).get("custom_data")
    text = entries.get(key) if isinstance(entries, dict) else None
    if text is None:
        return None
    try:
        content = json.loads(text)
    except (ValueError, TypeError, RecursionError):
        content = None
    if not isinstance(content, kind):
        name = "mapping" if kind is dict else "list"
        raise InputError(f"is no JSON {name}", field=key, source=str(path))
    return content


def logged_parameters(path: str | Path) -> dict[str, Any]:
    """Return what the log at `path` says that it was simulated with; empty if it does not say.

    Raises
    ------
    InputError
        It is no JSON mapping.
    """
    return custom_data(path, PARAMETERS_KEY, dict) or {}


def counted_messages(path: str | Path) -> dict[str, int]:
    """Return how many messages of each topic a log's metadata count, as far as they say."""
    topics = bag_information(path).get("topics_with_message_count")
    counts: Counter[str] = Counter()
    for entry in topics if isinstance(topics, list) else ():
        try:
            name, count = entry["topic_metadata"]["name"], entry["message_count"]
        except (KeyError, TypeError):
            continue
        if isinstance(name, str) and isinstance(count, int):
            counts[absolute(name)] += count
    return dict(counts)


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
    remarks = custom_data(path, REMARKS_KEY, list) or []
    if not all(isinstance(remark, str) for remark in remarks):
        raise InputError("is no JSON list of texts", field=REMARKS_KEY, source=str(path))
    return tuple(map(printable, remarks))
