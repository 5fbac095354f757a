"""Start the simulated gripper.

ros2 launch hma_gripper_sim sim.launch.py contour:=cylinder namespace:=arm_1
"""

from __future__ import annotations

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchContext, LaunchDescription

PACKAGE = "hma_gripper_sim"


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


def generate_launch_description() -> LaunchDescription:
    """Return what ``ros2 launch`` starts."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "params_file",
                default_value=PathJoinSubstitution(
                    [FindPackageShare(PACKAGE), "config", "sim_node.yaml"]
                ),
                description="Parameters of the node.",
            ),
            DeclareLaunchArgument(
                "contour",
                default_value="",
                description="Object to start with; empty: the one in the parameter file.",
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of the node."
            ),
            OpaqueFunction(function=sim_node),
        ]
    )
