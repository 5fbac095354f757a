"""A ROS parameter file, read without ROS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from hma_gripper_sim.device.topics import NODE
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.yaml_reading import read_yaml

_SECTION = "ros__parameters"


def read_parameter_file(path: str | Path, node: str = NODE.strip("/")) -> dict[str, Any]:
    """Return what a parameter file gives a node, by the parameters' dotted names.

    A section counts if the last part of its name is `node` or a wildcard, in any namespace; of
    sections that set the same parameter the last one counts.

    Raises
    ------
    InputError
        The file cannot be read, or holds no parameters of this node.
    """
    content = read_yaml(path)
    sections = list(_sections(content, node))
    if not sections:
        reason = f"holds no {_SECTION} of {node!r} or '/**'"
        raise InputError(reason, source=str(path))
    return {name: value for section in sections for name, value in _flat(section)}


def _sections(content: Mapping[str, Any], node: str) -> Iterator[Mapping[str, Any]]:
    for key, value in content.items():
        if not isinstance(value, Mapping):
            continue
        section = value.get(_SECTION)
        if not isinstance(section, Mapping):
            yield from _sections(value, node)
        elif str(key).rsplit("/", 1)[-1] in (node, "*", "**"):
            yield section


def _flat(section: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in section.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            yield from _flat(value, f"{name}.")
        else:
            yield name, value
