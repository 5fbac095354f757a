"""Command topics: what each message says, and what is no command."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.device.arbitration import (
    PositionCommand,
    TrajectoryCommand,
    VelocityCommand,
)
from hma_gripper_sim.device.settings import Settings

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point32, Polygon, PolygonStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from hma_gripper_sim.ros.inputs import READERS, read_outline

SETTINGS = Settings.parse({})
PREFIXED = Settings.parse({"prefix": "left_"})
MOVING_END = Settings.parse({"allow_nonzero_velocity_at_trajectory_end": True})
READ = {topic.relative.removeprefix("~/"): read for topic, read in READERS.items()}
STAMP = Header(stamp=Time(sec=3, nanosec=5))


def point(seconds, **values):
    return JointTrajectoryPoint(
        time_from_start=Duration(sec=int(seconds), nanosec=round(seconds % 1 * 1e9)), **values
    )


def test_each_way_in_says_the_same():
    for name, message, stamp in (
        ("cmd_velocity", Float64(data=0.01), 0),
        ("commands", Float64MultiArray(data=[0.01]), 0),
        (
            "joint_commands",
            JointState(header=STAMP, name=["elbow", "slide"], velocity=[9.0, 0.01]),
            3_000_000_005,
        ),
    ):
        assert READ[name](message, SETTINGS) == VelocityCommand(0.01, stamp), name


def test_a_trajectory_is_that_of_the_slide_among_the_joints():
    message = JointTrajectory(
        header=STAMP,
        joint_names=["elbow", "slide"],
        points=[
            point(0.25, positions=[9.0, 0.001], velocities=[9.0, 0.02]),
            point(1.5, positions=[9.0, 0.002], velocities=[9.0, 0.0]),
        ],
    )
    command = READ["joint_trajectory"](message, SETTINGS)
    assert isinstance(command, TrajectoryCommand)
    assert command.stamp == 3_000_000_005
    assert command.trajectory.end == 1.5
    spline = command.trajectory.spline(0.25, 0.0, 0.0)
    assert spline.at(0.25) == pytest.approx((0.001, 0.02), abs=1e-15)
    assert spline.at(1.5) == (0.002, 0.0)


@pytest.mark.parametrize("velocity", [[], [9.0, math.nan]])
def test_where_no_velocity_is_given_the_position_is_the_command(velocity):
    message = JointState(
        header=STAMP, name=["elbow", "slide"], position=[9.0, 0.012], velocity=velocity
    )
    assert READ["joint_commands"](message, SETTINGS) == PositionCommand(0.012, 3_000_000_005)


def test_with_a_prefix_the_joint_is_called_by_it():
    message = JointState(name=["slide", "left_slide"], velocity=[9.0, 0.01])
    assert READ["joint_commands"](message, PREFIXED) == VelocityCommand(0.01, 0)
    with pytest.raises(InputError, match="must hold 'left_slide' once"):
        READ["joint_commands"](JointState(name=["slide"], velocity=[0.1]), PREFIXED)


def test_a_trajectory_may_end_in_motion_where_that_is_allowed():
    last = point(1.0, positions=[0.01], velocities=[0.02])
    message = JointTrajectory(joint_names=["slide"], points=[last])
    command = READ["joint_trajectory"](message, MOVING_END)
    assert isinstance(command, TrajectoryCommand)
    assert command.trajectory.end == 1.0
    with pytest.raises(InputError, match="must be 0 at the last point"):
        READ["joint_trajectory"](message, SETTINGS)


def test_an_outline_is_read_in_the_drawing_plane_or_in_the_grippers_frame():
    def outline(frame):
        corners = [Point32(x=0.01, z=0.02), Point32(x=-0.01, z=0.02), Point32(x=0.0, z=0.03)]
        header = Header(frame_id=frame)
        return PolygonStamped(header=header, polygon=Polygon(points=corners))

    plain = read_outline(outline(""), SETTINGS)
    assert plain == pytest.approx(np.array([(0.01, 0.02), (-0.01, 0.02), (0.0, 0.03)]), abs=1e-9)
    # z of the frame points towards the object, down in the drawing plane.
    mounted = read_outline(outline("gripper_mount"), SETTINGS)
    assert mounted == pytest.approx(np.array(plain) * (1.0, -1.0), abs=0.0)
    assert read_outline(outline("left_gripper_mount"), PREFIXED) == mounted
    for frame, settings in (("camera", SETTINGS), ("gripper_mount", PREFIXED)):
        with pytest.raises(InputError, match=rf"frame_id: '{frame}' is neither"):
            read_outline(outline(frame), settings)


def test_an_empty_trajectory_stops():
    message = JointTrajectory(joint_names=["slide"])
    assert READ["joint_trajectory"](message, SETTINGS) == VelocityCommand(0.0)


@pytest.mark.parametrize(
    ("name", "message", "field", "reason"),
    [
        ("commands", Float64MultiArray(), "data", "one element, got 0"),
        ("commands", Float64MultiArray(data=[0.1, 0.2]), "data", "one element, got 2"),
        ("joint_commands", JointState(), "name", "'slide' once"),
        ("joint_commands", JointState(name=["elbow"], velocity=[0.1]), "name", "'slide' once"),
        ("joint_commands", JointState(name=["slide"] * 2, velocity=[0.1] * 2), "name", "once"),
        ("joint_commands", JointState(name=["slide"], velocity=[0.1, 0.2]), "velocity", "1 entr"),
        ("joint_commands", JointState(name=["slide"]), "velocity", "is empty"),
        ("joint_commands", JointState(name=["left_slide"], velocity=[0.1]), "name", "'slide' once"),
        (
            "joint_trajectory",
            JointTrajectory(joint_names=["elbow"], points=[point(1, positions=[0.0])]),
            "joint_names",
            "'slide' once",
        ),
        (
            "joint_trajectory",
            JointTrajectory(joint_names=["slide"], points=[point(1, positions=[0.0, 1.0])]),
            "points[0].positions",
            "1 entries or none",
        ),
        (
            "joint_trajectory",
            JointTrajectory(joint_names=["slide"], points=[point(1, positions=[math.nan])]),
            "points[0].position",
            "finite",
        ),
        (
            "joint_trajectory",
            JointTrajectory(joint_names=["slide"], points=[point(-1.0, positions=[0.0])]),
            "points[0].time",
            "at least 0",
        ),
    ],
)
def test_what_is_no_command_is_refused_by_field(name, message, field, reason):
    with pytest.raises(InputError) as caught:
        READ[name](message, SETTINGS)
    assert caught.value.field == field
    assert reason in caught.value.reason
