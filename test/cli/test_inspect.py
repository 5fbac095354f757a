"""``hma_gripper inspect``: what is printed, and the file that it writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from click.testing import CliRunner, Result

from hma_gripper_sim.cli.main import cli


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["inspect", *map(str, arguments)])


def test_column_of_publishers_is_explained(write_log: Callable[..., Path]) -> None:
    """What stands there is what a signal map takes."""
    shown = run(write_log("log"))
    assert shown.exit_code == 0
    assert " /joint_states                     sensor_msgs/msg/JointState " in shown.output
    assert "\npublisher: what 'publisher' in a signal map chooses: the number of" in shown.output


def test_map_is_written_once(write_log: Callable[..., Path], tmp_path: Path) -> None:
    log, file = write_log("log"), tmp_path / "maps" / "arm.yaml"
    written = run(log, "--map", file)
    assert written.exit_code == 0
    assert "travel: {topic: /joint_states, field: position, joint: slide}" in file.read_text()
    refused = run(log, "--map", file)
    assert refused.exit_code == 2
    assert refused.output == f"error: {file}: --map: exists already\n"
