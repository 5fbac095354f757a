"""The page about the node's interface, docs/ros_interface.md."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from hma_gripper_sim.device.setting_definitions import CONTOUR_FIELDS, GROUPS, Field
from hma_gripper_sim.ros.interface_docs.endpoints import Endpoint, Interface
from hma_gripper_sim.ros.interface_docs.explanations import (
    COMMANDS,
    DIAGNOSTICS,
    EVERY_NODES,
    INTRODUCTION,
    MEANINGS,
    OBJECTS,
    PARAMETERS,
    ROBOT_DESCRIPTION,
    SECURITY,
    SELECT_CONTOUR,
    STATES,
)

_SELECT = "~/select_contour/"


def interface_page(interface: Interface) -> str:
    """Return the page as Markdown.

    Raises
    ------
    ValueError
        The node has a topic or service that the text does not explain.
    """
    sections = [
        INTRODUCTION,
        "## Topics it listens to",
        _endpoints(interface.subscriptions),
        COMMANDS,
        "## Topics it publishes",
        _endpoints(interface.publishers),
        STATES,
        "## Services",
        _endpoints(interface.services),
        SELECT_CONTOUR,
        "## Parameters",
        PARAMETERS,
    ]
    for title, fields in GROUPS.items():
        sections += [f"### {title}", _parameter_rows(fields)]
    sections += ["### Objects: contours.NAME.*", OBJECTS, _objects()]
    sections += [DIAGNOSTICS, ROBOT_DESCRIPTION, SECURITY]
    return "\n\n".join(section.strip() for section in sections) + "\n"


def _endpoints(endpoints: Iterable[Endpoint]) -> str:
    """A table of the node's own, and a sentence about what every node has."""
    common = [item.name for item in endpoints if item.name in EVERY_NODES]
    own = {_title(item): item for item in endpoints if item.name not in EVERY_NODES}
    head = ["name", "type", "QoS", "meaning"]
    rows = [
        [f"`{title}`", own[title].kind, own[title].qos, MEANINGS[title]]
        for title in sorted(own, key=list(MEANINGS).index)
    ]
    if not any(item.qos for item in own.values()):
        for row in (head, *rows):
            del row[2]
    text = _table(head, rows)
    if common:
        text += f"\n\nAnd, as every node: {', '.join(f'`{name}`' for name in common)}."
    return text


def _title(endpoint: Endpoint) -> str:
    return f"{_SELECT}NAME" if endpoint.name.startswith(_SELECT) else endpoint.name


def _parameter_rows(fields: Mapping[str, Field]) -> str:
    rows = [
        (
            f"`{name}`",
            _value(field.default),
            _range(field),
            "at start" if field.read_only else "any time",
            field.description,
        )
        for name, field in fields.items()
    ]
    return _table(("parameter", "default", "range", "set", "meaning"), rows)


def _objects() -> str:
    rows = [(f"`{name}`", _range(item), item.description) for name, item in CONTOUR_FIELDS.items()]
    return _table(("parameter", "range", "meaning"), rows)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value) or "(none)"


def _range(field: Field) -> str:
    if field.options:
        return ", ".join(field.options)
    if math.isinf(field.minimum):
        return ""
    start = "above " if field.exclusive else ""
    return f"{start}{field.minimum:g} to {field.maximum:g}"


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *(map(str, row) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
