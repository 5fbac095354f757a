"""What ``hma_gripper record`` does before ROS has a say."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from hma_gripper_sim.cli.main import cli
from hma_gripper_sim.device.topics import CMD_VELOCITY, JOINT_STATES, RECORDED_TOPICS, topic_of


def test_missing_ros_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delitem(sys.modules, "hma_gripper_sim.ros.recording.session", raising=False)
    monkeypatch.setitem(sys.modules, "rclpy", None)
    result = CliRunner().invoke(cli, ["record", str(tmp_path / "log")])
    assert result.exit_code == 1
    assert result.output.startswith("error: ROS 2 is missing (import of rclpy")
    assert result.output.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["."], "error: .: exists already"),
        (["log", "--duration", "2 mm"], "error: --duration: expected a number in s, got '2 mm'"),
        (["log", "--timeout", "-1"], "error: --timeout: must be at least 0 s, got -1 s"),
        (["log", "--node", "gripper"], "error: --node: must be a full name such as"),
    ],
)
def test_bad_arguments_are_named(arguments: list[str], reason: str) -> None:
    result = CliRunner().invoke(cli, ["record", *arguments])
    assert result.exit_code == 2
    assert result.output.startswith(reason)
    assert result.output.count("\n") == 1


def test_topics_follow_the_name_of_the_node() -> None:
    assert topic_of("/left/gripper", JOINT_STATES).name == "/left/joint_states"
    assert topic_of("/left/gripper", CMD_VELOCITY).name == "/left/gripper/cmd_velocity"
    assert topic_of("/gripper", JOINT_STATES).name == "/joint_states"
    assert [topic_of("/hma_gripper_sim", topic) for topic in RECORDED_TOPICS] == [*RECORDED_TOPICS]
    assert "/diagnostics" in {topic_of("/left/gripper", topic).name for topic in RECORDED_TOPICS}
