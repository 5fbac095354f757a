"""Shipped files for other tools: well-formed, and about the topics and joints of this node."""

from __future__ import annotations

import io
import json
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from click.testing import CliRunner

from hma_gripper_sim import Circle, GripperDesign, Scene, config_directory
from hma_gripper_sim.cli.main import cli
from hma_gripper_sim.results.robot_description import MOUNT

CONFIG = config_directory()
ROS2_CONTROL = CONFIG / "ros2_control"
NODE = "hma_gripper_sim"


def granted(right: str) -> set[str]:
    """Full names that the security policy grants, which is compared with the running node."""
    policy = ET.parse(CONFIG / "sros2" / "policy.xml")
    names = [item.text for element in policy.iter() if right in element.attrib for item in element]
    return {f"/{NODE}{name[1:]}" if name[0] == "~" else f"/{name.lstrip('/')}" for name in names}


def publishes(topic: str) -> bool:
    return topic in granted("publish")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The example of an arm that carries the gripper, as xacro expands it."""
    xacro = pytest.importorskip("xacro")
    gripper = tmp_path_factory.mktemp("arm") / "gripper.urdf"
    assert CliRunner().invoke(cli, ["urdf", "--output", str(gripper)]).exit_code == 0
    file = ROS2_CONTROL / "arm_with_gripper.urdf.xacro"
    return str(xacro.process_file(str(file), mappings={"gripper": str(gripper)}).toxml())


def test_the_example_arm_carries_the_gripper_with_its_tool_axis(arm) -> None:
    robot = pytest.importorskip("yourdfpy").URDF.load(io.StringIO(arm), load_meshes=False)
    scene = Scene(GripperDesign.thesis_2013(), Circle(0.015))
    assert set(scene.joint_names) <= set(robot.joint_map)
    assert robot.get_transform(MOUNT, "tool0") == pytest.approx(robot.get_transform(MOUNT, MOUNT))
    towards_the_object = robot.get_transform(MOUNT, "world")[:3, 2]
    assert towards_the_object == pytest.approx((0.0, 0.0, -1.0))


def test_the_hardware_of_ros2_control_talks_to_the_node(arm) -> None:
    (hardware,) = ET.fromstring(arm).findall("ros2_control")
    parameters = {item.get("name"): item.text for item in hardware.findall("hardware/param")}
    assert parameters["joint_commands_topic"] in granted("subscribe")
    assert publishes(parameters["joint_states_topic"])
    # Otherwise an axis that tracks perfectly gets no commands, and the node's timeout stops it.
    assert float(parameters["trigger_joint_command_threshold"]) < 0.0
    (joint,) = hardware.findall("joint")
    assert joint.get("name") == "slide"
    assert [item.get("name") for item in joint.findall("command_interface")] == ["velocity"]
    states = {item.get("name") for item in joint.findall("state_interface")}
    assert states == {"position", "velocity", "effort"}  # as joint_states has them
    assert {float(item.text) for item in joint.iter("param")} == {0.0}


def test_the_controllers_use_what_the_hardware_has(arm) -> None:
    (joint,) = ET.fromstring(arm).findall("ros2_control/joint")
    files = yaml.safe_load((ROS2_CONTROL / "controllers.yaml").read_text(encoding="utf-8"))
    sections = {name: section["ros__parameters"] for name, section in files.items()}
    manager = sections.pop("controller_manager")
    timeout = parameters_of_the_node()["command_timeout"]
    assert manager.pop("update_rate") >= 2.0 / timeout
    assert set(manager) == set(sections)
    kinds = {entry["type"] for entry in manager.values()}
    assert kinds == {
        "velocity_controllers/JointGroupVelocityController",
        "joint_trajectory_controller/JointTrajectoryController",
    }
    for name, section in sections.items():
        assert section["joints"] == [joint.get("name")], name
        for kind in ("command_interface", "state_interface"):
            has = {item.get("name") for item in joint.findall(kind)}
            assert set(section.get(f"{kind}s", [])) <= has, name


def test_a_velocity_controller_that_follows_trajectories_has_gains() -> None:
    files = yaml.safe_load((ROS2_CONTROL / "controllers.yaml").read_text(encoding="utf-8"))
    section = files["gripper_trajectory_controller"]["ros__parameters"]
    gains = section["gains"]["slide"]
    assert gains["ff_velocity_scale"] == 1.0  # the velocity of the trajectory itself
    assert 0.0 < gains["p"] * 2.0 / parameters_of_the_node()["publish_rate"] < 0.5  # stable
    speed = parameters_of_the_node()["max_velocity"]
    assert section["constraints"]["stopped_velocity_tolerance"] < 0.1 * speed


def parameters_of_the_node() -> dict[str, Any]:
    content = yaml.safe_load((CONFIG / "sim_node.yaml").read_text(encoding="utf-8"))
    return content["/**"]["ros__parameters"]


def test_rviz_shows_topics_of_the_node() -> None:
    content = yaml.safe_load((CONFIG / "gripper.rviz").read_text(encoding="utf-8"))
    manager = content["Visualization Manager"]
    displays = {display["Class"].split("/")[1]: display for display in manager["Displays"]}
    for name in ("MarkerArray", "Wrench"):
        topic = displays[name]["Topic"]["Value"]
        assert not topic.startswith("/"), "RViz would not follow the node into a namespace"
        assert publishes(f"/{topic}")
    assert displays["RobotModel"]["Description Topic"]["Value"] == "robot_description"
    assert displays["MarkerArray"]["Namespaces"] == {
        "gripper": False,  # the robot model shows it
        "object": True,
        "contact_force": True,
    }
    assert manager["Global Options"]["Fixed Frame"] == "world"  # where the launch file hangs it


def test_foxglove_shows_topics_of_the_node() -> None:
    content = json.loads((CONFIG / "foxglove_layout.json").read_text(encoding="utf-8"))
    panels = content["configById"]
    assert sorted(leaves(content["layout"])) == sorted(panels)
    assert {name.split("!")[0] for name in panels} == {"3D", "Plot", "DiagnosticSummary"}
    (scene,) = (panel for name, panel in panels.items() if name.startswith("3D!"))
    topics = set(scene["topics"]) - {"/robot_description"}  # of robot_state_publisher
    topics |= {p["topicToRender"] for name, p in panels.items() if name.startswith("Diag")}
    paths = [path["value"] for panel in panels.values() for path in panel.get("paths", [])]
    topics |= {path.split(".")[0] for path in paths}
    assert topics <= granted("publish")
    assert {f"/{NODE}/markers", f"/{NODE}/phi", f"/{NODE}/actuator_wrench"} <= topics


def leaves(layout: Any) -> Iterator[str]:
    if isinstance(layout, str):
        yield layout
    else:
        yield from leaves(layout["first"])
        yield from leaves(layout["second"])
