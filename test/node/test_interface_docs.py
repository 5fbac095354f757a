"""docs/ros_interface.md and config/sros2/policy.xml say what the running node has."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from patience import patience

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from diagnostic_msgs.msg import DiagnosticArray

from hma_gripper_sim import config_directory

NODE = "/hma_gripper_sim"
ROOT = config_directory().parent
PAGE = (ROOT / "docs" / "ros_interface.md").read_text(encoding="utf-8")
POLICY = ET.parse(ROOT / "config" / "sros2" / "policy.xml").getroot()


def test_the_files_are_what_the_command_writes(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hma_gripper_sim.ros.interface_docs", str(tmp_path)]
    subprocess.run(command, check=True, timeout=patience(120.0))
    for path in ("docs/ros_interface.md", "config/sros2/policy.xml"):
        assert (tmp_path / path).read_text() == (ROOT / path).read_text(), (
            f"run `make docs`: {path}"
        )


class Section(NamedTuple):
    title: str
    kind: str


SECTIONS = {
    "subscribe": Section("Topics it listens to", "subscriptions"),
    "publish": Section("Topics it publishes", "publishers"),
    "reply": Section("Services", "services"),
}
"""Where the page and the graph tell what the policy grants by each right."""

RIGHTS = set(SECTIONS)


def rows(section: str) -> Iterator[list[str]]:
    """Cells of the tables below a heading of the page, without the heads."""
    text = PAGE.split(f"## {section}\n")[1].split("\n## ")[0]
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if line.startswith("| `"):
            yield cells


def names(section: str) -> set[str]:
    """Names that a section documents: of its table, and of what every node has."""
    text = PAGE.split(f"## {section}\n")[1].split("\n## ")[0]
    common = re.findall(r"as every node: (.*)\.", text)
    return {cells[0].strip("`") for cells in rows(section)} | {
        name for line in common for name in re.findall("`(.*?)`", line)
    }


def granted(right: str, namespace: str) -> set[str]:
    """Full names that the policy grants a node in a namespace."""
    (profile,) = POLICY.iter("profile")
    assert f"{profile.get('ns')}{profile.get('node')}" == NODE
    return {
        expanded(item.text, namespace)
        for element in profile
        if element.get(right) == "ALLOW"
        for item in element
    }


def expanded(name: str, namespace: str) -> str:
    if name.startswith("~"):
        return namespace + NODE + name[1:]
    return name if name.startswith("/") else f"{namespace}/{name}"


def documented(section: str, contours: set[str]) -> set[str]:
    found = names(section)
    if "~/select_contour/NAME" in found:
        found.remove("~/select_contour/NAME")
        found |= {f"~/select_contour/{name}" for name in (*contours, "outline")}
    return {expanded(name, "") for name in found}


def test_page_and_policy_name_all_that_running_nodes_have_and_no_more(start_node, connect) -> None:
    """One node is the clock; the other, in the namespace /other, follows it."""
    file = str(config_directory() / "sim_node.yaml")
    follower = start_node("--params-file", file, "-r", "__ns:=/other", use_sim_time="true")
    client = connect(start_node("--params-file", file, publish_clock="true"))
    follower.wait_until_ready()

    contours = {name.split(".")[1] for name in client.parameter_names() if "contours." in name}
    for right, section in SECTIONS.items():
        listed = documented(section.title, contours)

        def seen(section=section) -> dict[str, str]:
            other = getattr(client.graph("/other"), section.kind)
            shortened = {name.removeprefix("/other"): kind for name, kind in other.items()}
            return shortened | getattr(client.graph("/"), section.kind)

        client.wait(lambda seen=seen, listed=listed: listed <= set(seen()))
        together, other = seen(), getattr(client.graph("/other"), section.kind)
        assert listed == set(together)
        assert granted(right, "") == set(together)
        assert set(other) <= granted(right, "/other")
        for name, kind, *rest in rows(section.title):
            full = expanded(name.strip("`").replace("NAME", "box"), "")
            assert together[full] == kind
            if section.kind != "services":
                reliability, durability, _ = rest[0].split(", ")
                assert client.qos(section.kind, full) == (reliability, durability), full


def test_the_policy_denies_by_not_granting_and_names_everything_in_full() -> None:
    assert {right for item in POLICY.iter() for right in RIGHTS & set(item.attrib)} == RIGHTS
    assert all(item.get(right, "ALLOW") == "ALLOW" for item in POLICY.iter() for right in RIGHTS)
    assert not [item.text for item in POLICY.iter() if "*" in (item.text or "")]


def test_page_lists_parameters_and_diagnostics_as_the_running_node_does(
    start_node, connect
) -> None:
    client = connect(start_node())
    described = {item.name: item for item in client.describe_parameters()}
    table = {cells[0].strip("`"): cells[1:] for cells in rows("Parameters")}
    own = {name for name in described if name in table and not name.startswith("contours.")}
    fields = {name.split(".")[2] for name in described if name.startswith("contours.")}
    ros_own = {"use_sim_time", "start_type_description_service"}
    assert own == {name for name in described if not name.startswith("contours.")} - ros_own
    assert fields <= set(table) - own
    for name in own:
        default, limits, when, meaning = table[name]
        item, value = described[name], client.get_parameter(name)
        if isinstance(value, str):
            assert default == (value or "(none)")
        elif isinstance(value, bool):
            assert default == str(value).lower()
        else:
            assert float(default) == value
        assert (when == "at start") == item.read_only
        assert meaning == item.description
        for bound in (*item.floating_point_range, *item.integer_range):
            low, high = limits.removeprefix("above ").split(" to ")
            assert (float(low), float(high)) == (bound.from_value, bound.to_value)
        assert limits.startswith("above ") == item.additional_constraints.startswith("greater")
        if item.additional_constraints.startswith("one of "):
            assert item.additional_constraints == f"one of {limits}"

    reports = client.listen(DiagnosticArray, "/diagnostics")
    client.wait(lambda: reports)
    sources = [cells[0].split("/")[1].strip("`") for cells in rows("Topics it listens to")]
    commands = [source for source in sources if source not in ("outline", "clock")]
    listed = {
        cells[0].strip("`"): {
            name.replace("SOURCE", source)
            for name in re.findall("`(.*?)`", cells[2])
            for source in commands
        }
        for cells in rows("Diagnostics")
    }
    assert listed == {
        status.name: {pair.key for pair in status.values} for status in reports[-1].status
    }
