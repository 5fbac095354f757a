"""What the metadata of a rosbag2 directory say about the log in it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.yaml_reading import read_yaml

REMARKS_KEY = "hma_gripper_sim.remarks"
"""Under which they hold how far what was simulated can be trusted: a list of texts in JSON."""


def bag_information(path: str | Path) -> dict[str, Any]:
    """Return the metadata of the log at `path`; empty if it has none."""
    metadata = Path(path) / "metadata.yaml"
    if not metadata.is_file():
        return {}
    return read_yaml(metadata).get("rosbag2_bagfile_information") or {}


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
    text = (bag_information(path).get("custom_data") or {}).get(REMARKS_KEY)
    if text is None:
        return ()
    try:
        remarks = json.loads(text)
    except ValueError:
        remarks = None
    if not isinstance(remarks, list) or not all(isinstance(remark, str) for remark in remarks):
        raise InputError("is no JSON list of texts", field=REMARKS_KEY, source=str(path))
    return tuple(remarks)
