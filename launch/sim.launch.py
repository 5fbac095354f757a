"""Start the simulated gripper, and with it what shows it.

ros2 launch hma_gripper_sim sim.launch.py contour:=cylinder namespace:=arm_1
ros2 launch hma_gripper_sim sim.launch.py use_sim_time:=true publish_rate:=50.0
ros2 launch hma_gripper_sim sim.launch.py rviz:=true
ros2 launch hma_gripper_sim sim.launch.py description:=true parent:=tool0 prefix:=left_

Every parameter of the node but those of the objects is an argument; what is given takes precedence
over the parameter file. When one of the processes ends, the others are ended too.
"""

from __future__ import annotations

import difflib
import math
import shlex
import sys
from pathlib import Path
from typing import Any

import yaml
from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)
from launch.actions import DeclareLaunchArgument, OpaqueFunction, Shutdown
from launch.substitutions import Command
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import ExecutableInPackage

from launch import LaunchContext, LaunchDescription

PACKAGE = "hma_gripper_sim"
CONFIG = Path(get_package_share_directory(PACKAGE)) / "config"
HANGING = ("--parent", "world", "--rpy", str(math.pi), "0", "0")
"""Without an arm: below the origin of a frame whose z axis points up."""

ARGUMENTS = {
    "params_file": (str(CONFIG / "sim_node.yaml"), "Parameters of the node."),
    "namespace": ("", "Namespace of the nodes."),
    "name": (PACKAGE, "Name of the node."),
    "description": ("false", "Start robot_state_publisher with the gripper's description."),
    "parent": (
        "",
        "Link of an arm that carries the gripper in that description; empty: it hangs in the "
        "frame world.",
    ),
    "rviz": ("false", "Start RViz, and with it robot_state_publisher."),
    "use_sim_time": ("", "Take the time from /clock, all of them; empty: as in params_file."),
}
"""Those that are no parameters of the node alone: default and description."""


def node_parameters() -> dict[str, Any]:
    """Return the defaults of the node's parameters, by their dotted names; not those of objects."""
    parameters = yaml.safe_load((CONFIG / "sim_node.yaml").read_text())["/**"]["ros__parameters"]
    del parameters["contours"]
    flat = {name: value for name, value in parameters.items() if not isinstance(value, dict)}
    for group in parameters.keys() - flat.keys():
        flat |= {f"{group}.{name}": value for name, value in parameters[group].items()}
    return flat


def nodes(context: LaunchContext) -> list[Node]:
    """Return what is started, after making sure that all of it can be."""
    told = context.launch_configurations
    refuse_unknown(context)
    if not Path(told["params_file"]).is_file():
        raise RuntimeError(f"params_file: there is no file {told['params_file']!r}")
    given = {name: told[name] for name in node_parameters() if told[name]}
    rviz = is_true(told, "rviz")
    description = rviz or is_true(told, "description")
    for package, wanted in (("robot_state_publisher", description), ("rviz2", rviz)):
        if wanted:
            require(package)
    use_sim_time = {"use_sim_time": is_true(told, "use_sim_time")} if told["use_sim_time"] else {}
    urdf = robot_description(context, given) if description else ""
    started = [
        node(
            told,
            PACKAGE,
            "sim_node",
            name=told["name"],
            parameters=[told["params_file"], {**typed(given), **use_sim_time}],
        )
    ]
    if description:
        text = ParameterValue(urdf, value_type=str)
        parameters = [{"robot_description": text, **use_sim_time}]
        package = "robot_state_publisher"
        started.append(node(told, package, package, parameters=parameters))
    if rviz:
        layout = ["-d", str(CONFIG / "gripper.rviz")]
        started.append(node(told, "rviz2", "rviz2", arguments=layout, parameters=[use_sim_time]))
    return started


def node(told: dict[str, str], package: str, executable: str, **others: Any) -> Node:
    """Return a node whose end is the end of all."""
    return Node(
        package=package,
        executable=executable,
        namespace=told["namespace"],
        output="screen",
        on_exit=Shutdown(reason=f"{executable} has ended"),
        **others,
    )


def robot_description(context: LaunchContext, given: dict[str, str]) -> str:
    """Return the URDF of the gripper that the node will simulate."""
    told = context.launch_configurations
    place = ("--parent", told["parent"]) if told["parent"] else HANGING
    settings = [item for name, value in given.items() for item in ("--set", f"{name}={value}")]
    file = ("--params-file", told["params_file"], "--node", told["name"])
    arguments = shlex.join(["urdf", *file, *settings, *place])
    return Command([ExecutableInPackage("hma_gripper", PACKAGE), " ", arguments]).perform(context)


def typed(given: dict[str, str]) -> dict[str, Any]:
    """Return parameters in the types of their defaults; a text with a unit stays a text."""
    defaults = node_parameters()
    values: dict[str, Any] = {}
    for name, text in given.items():
        if isinstance(defaults[name], float):
            try:
                values[name] = float(text)
            except ValueError:
                values[name] = text
        else:
            values[name] = text if isinstance(defaults[name], str) else yaml.safe_load(text)
    return values


def is_true(told: dict[str, str], name: str) -> bool:
    """Return whether a switch is on; raise an error if it is neither on nor off."""
    if told[name].lower() not in ("true", "false"):
        raise RuntimeError(f"{name}: expected true or false, got {told[name]!r}")
    return told[name].lower() == "true"


def require(package: str) -> None:
    """Raise an error that names the remedy if a package is not installed."""
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        name = package.replace("_", "-")
        raise RuntimeError(
            f"the package {package} is not installed (sudo apt install ros-jazzy-{name})"
        ) from None


def refuse_unknown(context: LaunchContext) -> None:
    """Raise an error if the command line that names this file has an argument that it has not."""
    if Path(__file__).name not in {Path(word).name for word in sys.argv}:
        return  # it is part of a launch file that may have arguments of its own
    known = [*ARGUMENTS, *node_parameters()]
    for name in (word.partition(":=")[0] for word in context.argv if ":=" in word):
        if name not in known:
            close = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean {close[0]!r}?" if close else "--show-args lists all"
            raise RuntimeError(f"unknown argument {name!r} ({hint})")


def generate_launch_description() -> LaunchDescription:
    """Return what ``ros2 launch`` starts."""
    arguments = ARGUMENTS | {
        name: ("", f"Parameter of the node, {default!r} by default; empty: as in params_file.")
        for name, default in node_parameters().items()
    }
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in arguments.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=nodes)])
