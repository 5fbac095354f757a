"""Start the simulated gripper, and with it what shows it.

ros2 launch hma_gripper_sim sim.launch.py contour:=cylinder namespace:=arm_1
ros2 launch hma_gripper_sim sim.launch.py rviz:=true
ros2 launch hma_gripper_sim sim.launch.py description:=true parent:=tool0
"""

from __future__ import annotations

import math
import shlex

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import Command, LaunchConfiguration, OrSubstitution, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

from launch import LaunchContext, LaunchDescription

PACKAGE = "hma_gripper_sim"
CONFIG = PathJoinSubstitution([FindPackageShare(PACKAGE), "config"])
HANGING = ("--parent", "world", "--rpy", str(math.pi), "0", "0")
"""Without an arm: below the origin of a frame whose z axis points up."""


def sim_node(context: LaunchContext) -> list[Node]:
    """Return the node; an object that is asked for takes precedence over the parameter file."""
    contour = LaunchConfiguration("contour").perform(context)
    return [
        Node(
            package=PACKAGE,
            executable="sim_node",
            namespace=LaunchConfiguration("namespace"),
            parameters=[
                LaunchConfiguration("params_file"),
                {"contour": contour} if contour else {},
            ],
            output="screen",
        )
    ]


def robot_state_publisher(context: LaunchContext) -> list[Node]:
    """Return what makes TF of the joint states, with the gripper of the parameter file."""
    parent = LaunchConfiguration("parent").perform(context)
    params_file = LaunchConfiguration("params_file").perform(context)
    place = ("--parent", parent) if parent else HANGING
    arguments = shlex.join(["urdf", "--params-file", params_file, *place])
    urdf = Command([ExecutableInPackage("hma_gripper", PACKAGE), " ", arguments])
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            namespace=LaunchConfiguration("namespace"),
            parameters=[{"robot_description": ParameterValue(urdf, value_type=str)}],
            condition=IfCondition(
                OrSubstitution(LaunchConfiguration("description"), LaunchConfiguration("rviz"))
            ),
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Return what ``ros2 launch`` starts."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file",
                default_value=PathJoinSubstitution([CONFIG, "sim_node.yaml"]),
                description="Parameters of the node.",
            ),
            DeclareLaunchArgument(
                "contour",
                default_value="",
                description="Object to start with; empty: the one in the parameter file.",
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of the nodes."
            ),
            DeclareLaunchArgument(
                "description",
                default_value="false",
                description="Start robot_state_publisher with the gripper's description.",
            ),
            DeclareLaunchArgument(
                "parent",
                default_value="",
                description="Link of an arm that carries the gripper in that description; "
                "empty: it hangs in the frame world.",
            ),
            DeclareLaunchArgument(
                "rviz",
                default_value="false",
                description="Start RViz, and with it robot_state_publisher.",
            ),
            OpaqueFunction(function=sim_node),
            OpaqueFunction(function=robot_state_publisher),
            Node(
                package="rviz2",
                executable="rviz2",
                namespace=LaunchConfiguration("namespace"),
                arguments=["-d", PathJoinSubstitution([CONFIG, "gripper.rviz"])],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
