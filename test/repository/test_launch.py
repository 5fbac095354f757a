"""The launch file, where ROS 2's launch is installed; no wheel brings it."""

from __future__ import annotations

import runpy
import sys

import pytest

from hma_gripper_sim import config_directory
from hma_gripper_sim.device.setting_definitions import FIELDS

FILE = config_directory().parent / "launch" / "sim.launch.py"


@pytest.fixture
def installed(monkeypatch):
    """The packages that are there, as far as the launch file can tell."""
    pytest.importorskip("launch_ros", reason="ros2 launch is not installed")
    from ament_index_python.packages import PackageNotFoundError

    found = {"hma_gripper_sim", "robot_state_publisher", "rviz2"}

    def prefix(package: str) -> str:
        if package not in found:
            raise PackageNotFoundError(package)
        return ""

    share = str(config_directory().parent)
    monkeypatch.setattr("ament_index_python.packages.get_package_prefix", prefix)
    monkeypatch.setattr("ament_index_python.packages.get_package_share_directory", lambda _: share)
    return found


@pytest.fixture
def launch(installed, monkeypatch):
    """Return what is started, given the words behind the file's name."""
    from launch import LaunchContext

    file = runpy.run_path(str(FILE))

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["ros2", "launch", "hma_gripper_sim", FILE.name, *words])
        context = LaunchContext(argv=words)
        declared = file["generate_launch_description"]().get_launch_arguments()
        context.launch_configurations.update(
            {item.name: item.default_value[0].text for item in declared}
            | dict(word.split(":=") for word in words)
        )
        return file["nodes"](context)

    return run


@pytest.fixture
def description(installed):
    """What the file declares."""
    return runpy.run_path(str(FILE))["generate_launch_description"]()


@pytest.fixture
def urdf(installed, monkeypatch):
    """What the command that prints the robot description is called with."""
    from launch.substitutions import Command

    calls = []

    def perform(self, _):
        calls.append(self.command[-1].text)
        return "<robot/>"

    monkeypatch.setattr(Command, "perform", perform)
    return calls


def parameters(node):
    """Names of the parameters that a node is given beside its file."""
    given = [group for group in node._Node__parameters if isinstance(group, dict)]
    return {"".join(part.text for part in name) for group in given for name in group}


def packages(nodes):
    return [node.node_package for node in nodes]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), ["hma_gripper_sim"]),
        (("description:=true",), ["hma_gripper_sim", "robot_state_publisher"]),
        (("rviz:=true",), ["hma_gripper_sim", "robot_state_publisher", "rviz2"]),
    ],
)
def test_it_starts_what_is_asked_for(launch, urdf, words, expected) -> None:
    assert packages(launch(*words)) == expected


def test_the_end_of_one_is_the_end_of_all(launch, urdf) -> None:
    """Otherwise a node is left over, and the next start makes it two."""
    from launch.actions import Shutdown

    nodes = launch("rviz:=true")
    assert [type(node._ExecuteLocal__on_exit) for node in nodes] == [Shutdown] * 3


def test_every_parameter_of_the_node_is_an_argument(description) -> None:
    names = {argument.name for argument in description.get_launch_arguments()}
    assert names >= {*FIELDS, "use_sim_time", "namespace", "name", "params_file"}


def test_the_clock_is_the_parameter_files_unless_it_is_told(launch, urdf) -> None:
    for words, expected in ((), 0), (("use_sim_time:=true",), 3):
        nodes = launch("rviz:=true", *words)
        assert sum("use_sim_time" in parameters(node) for node in nodes) == expected


def test_the_description_is_that_of_what_the_node_is_told(launch, urdf) -> None:
    launch("description:=true", "prefix:=left_", "elements_beam:=3", "name:=grip", "parent:=tool0")
    (command,) = urdf
    for text in ("--set prefix=left_", "--set elements_beam=3", "--node grip", "--parent tool0"):
        assert text in command


@pytest.mark.parametrize(
    ("word", "reason"),
    [
        ("publish_rat:=50.0", r"unknown argument 'publish_rat' \(did you mean 'publish_rate'\?\)"),
        ("params_file:=absent.yaml", "there is no file 'absent.yaml'"),
        ("rviz:=maybe", "rviz: expected true or false, got 'maybe'"),
    ],
)
def test_what_cannot_be_started_is_said_before_anything_is(launch, word, reason) -> None:
    with pytest.raises(RuntimeError, match=reason):
        launch(word)


@pytest.mark.parametrize("package", ["robot_state_publisher", "rviz2"])
def test_a_package_that_is_missing_is_named_with_the_remedy(
    launch, installed, urdf, package
) -> None:
    installed.remove(package)
    with pytest.raises(RuntimeError, match=f"apt install ros-jazzy-{package.replace('_', '-')}"):
        launch("rviz:=true")
    assert urdf == []
    assert packages(launch()) == ["hma_gripper_sim"]
