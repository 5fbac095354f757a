"""Writes docs/ros_interface.md and config/sros2/policy.xml, below a directory or this checkout."""

from __future__ import annotations

import sys
from pathlib import Path

from hma_gripper_sim.ros.interface_docs.endpoints import shipped_interface
from hma_gripper_sim.ros.interface_docs.page import interface_page
from hma_gripper_sim.ros.interface_docs.policy import security_policy
from hma_gripper_sim.yaml_reading import config_directory


def write_files(root: Path) -> None:
    """Write both files below a directory."""
    interface = shipped_interface()
    for path, text in (
        (root / "docs" / "ros_interface.md", interface_page(interface)),
        (root / "config" / "sros2" / "policy.xml", security_policy(interface)),
    ):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_files(Path(sys.argv[1]) if len(sys.argv) > 1 else config_directory().parent)
