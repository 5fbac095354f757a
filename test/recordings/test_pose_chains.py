"""Poses that no message holds, against poses that are known."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from hma_gripper_sim import InputError
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.signal_map import SignalMap

T = get_typestore(Stores.ROS2_JAZZY).types
START, PERIOD = 1_700_000_000_000_000_000, 10_000_000  # ns
TF = Topic("/tf", "tf2_msgs/msg/TFMessage")
STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage")
JOINTS = Topic("/joint_states", "sensor_msgs/msg/JointState")
WRENCH = Topic("/wrench", "geometry_msgs/msg/WrenchStamped")

Write = Callable[..., Path]


def header(stamp: int, frame: str = "") -> Any:
    return T["std_msgs/msg/Header"](
        T["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9), frame
    )


def transform(stamp: int, parent: str, child: str, place: Any, rotation: Rotation) -> Any:
    content = T["geometry_msgs/msg/Transform"](
        T["geometry_msgs/msg/Vector3"](*map(float, place)),
        T["geometry_msgs/msg/Quaternion"](*rotation.as_quat()),
    )
    return T["geometry_msgs/msg/TransformStamped"](header(stamp, parent), child, content)


def poses(count: int = 50) -> tuple[list[Any], np.ndarray]:
    """A turning wrist on an arm that comes down, the tool a fixed way from it, and a camera."""
    tool = Rotation.from_euler("xyz", [0.1, -0.2, 0.3])
    fixed = transform(START, "wrist", "tool0", (0.01, 0.02, 0.1), tool)
    camera = transform(START, "camera", "base", (0.0, 0.0, -1.0), Rotation.identity())
    entries = [(STATIC, START, T[STATIC.msgtype]([fixed, camera]))]
    height = []
    for i in range(count):
        stamp = START + i * PERIOD
        turned = Rotation.from_euler("x", np.pi + 0.02 * i)
        place = np.array([0.5, 0.1, 0.4 - 0.001 * i])
        arm = transform(stamp, "base", "wrist", place, turned)
        entries.append((TF, stamp, T[TF.msgtype]([arm])))
        height.append(place[2] + turned.apply([0.01, 0.02, 0.1])[2])
    return entries, np.array(height)


def chain(parent: str, child: str, field: str = "transform.translation.z", **more: Any) -> Any:
    entry = {"topic": "/tf", "frame": {"parent": parent, "child": child}, "field": field, **more}
    return SignalMap.from_mapping({"travel": entry})


def test_pose_along_moving_and_static_frames(by_mcap: Write) -> None:
    entries, height = poses()
    path = by_mcap(entries)
    recording = read_recording(path, chain("base", "tool0"))
    np.testing.assert_allclose(recording["travel"].value, height, rtol=0, atol=1e-12)
    np.testing.assert_allclose(recording["travel"].time, 0.01 * np.arange(50), rtol=0, atol=1e-12)
    assert recording.notes == ("/tf: travel was put together from base → wrist and wrist → tool0",)
    above = read_recording(path, chain("camera", "tool0"))["travel"].value
    np.testing.assert_allclose(above, height - 1.0, rtol=0, atol=1e-12)


def test_pose_against_the_direction_of_the_frames(by_mcap: Write) -> None:
    path = by_mcap(poses()[0])
    there = [
        read_recording(path, chain("tool0", "base", f"transform.translation.{axis}"))["travel"]
        for axis in "xyz"
    ]
    back = [
        read_recording(path, chain("base", "tool0", f"transform.translation.{axis}"))["travel"]
        for axis in "xyz"
    ]
    lengths = [np.linalg.norm([s.value for s in way], axis=0) for way in (there, back)]
    np.testing.assert_allclose(lengths[0], lengths[1], rtol=1e-12)


def test_moving_frames_of_different_rates_are_interpolated(by_mcap: Write) -> None:
    entries, height = poses()
    slow = [entry for i, entry in enumerate(entries[1:]) if i % 7 == 0]
    lift = [
        (
            TF,
            START + i * PERIOD,
            T[TF.msgtype](
                [
                    transform(
                        START + i * PERIOD,
                        "world",
                        "base",
                        (0.0, 0.0, 0.002 * i),
                        Rotation.identity(),
                    )
                ]
            ),
        )
        for i in range(50)
    ]
    path = by_mcap(sorted([entries[0], *slow, *lift], key=lambda entry: entry[1]))
    travel = read_recording(path, chain("world", "tool0"))["travel"]
    assert travel.value.size == 50
    expected = height[:50] + 0.002 * np.arange(50)
    np.testing.assert_allclose(travel.value, expected, rtol=0, atol=3e-4)  # of an arc's chord
    np.testing.assert_allclose(travel.value[::7], expected[::7], rtol=0, atol=1e-12)


def test_component_of_a_pose_along_a_direction(by_mcap: Write) -> None:
    entries, height = poses()
    entry = chain("base", "tool0", "transform.translation", direction=[0, 0, -2])
    recording = read_recording(by_mcap(entries), entry)
    np.testing.assert_allclose(recording["travel"].value, -height, rtol=0, atol=1e-12)


def test_frames_that_no_chain_joins_are_named(by_mcap: Write) -> None:
    path = by_mcap(poses()[0])
    reason = r"no message is about frame base → gripper \(there are: base → wrist\)"
    with pytest.raises(InputError, match=reason):
        read_recording(path, chain("base", "gripper"))


def test_force_of_a_tilted_sensor(by_mcap: Write) -> None:
    """By 5° about x: its z axis feels the cosine, its y axis the sine."""
    tilt = np.radians(5.0)
    vector = T["geometry_msgs/msg/Vector3"]
    forces = np.linspace(0.0, 0.4, 9)
    entries = []
    for i, force in enumerate(forces):
        felt = vector(7.0, -force * np.sin(tilt), force * np.cos(tilt))
        content = T["geometry_msgs/msg/Wrench"](felt, vector(0, 0, 0))
        stamp = START + i * PERIOD
        entries.append((WRENCH, stamp, T[WRENCH.msgtype](header(stamp), content)))
    entry = {
        "topic": "/wrench",
        "field": "wrench.force",
        "direction": [0, -2.0 * np.sin(tilt), 2.0 * np.cos(tilt)],
    }
    signals = SignalMap.from_mapping({"actuator_force": entry})
    recording = read_recording(by_mcap(entries), signals)
    np.testing.assert_allclose(recording["actuator_force"].value, forces, rtol=0, atol=1e-15)


ROBOT = """<robot name="arm">
  <link name="base_link"/><link name="upper"/><link name="fore"/><link name="tool0"/>
  <link name="x"/>
  <joint name="turn" type="revolute"><parent link="base_link"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 0 0.2"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="lift" type="prismatic"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.1 0 0" rpy="0 0.3 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="flange" type="fixed"><parent link="fore"/><child link="tool0"/>
    <origin xyz="0 0.02 0.05" rpy="3.14 0 0"/></joint>
  <joint name="loose" type="floating"><parent link="tool0"/><child link="x"/></joint>
</robot>"""


def test_pose_along_the_joints_of_a_robot(by_mcap: Write, tmp_path: Path) -> None:
    """Against yourdfpy's own forward kinematics; joints are found by name, in two messages."""
    yourdfpy = pytest.importorskip("yourdfpy")
    file = tmp_path / "arm.urdf"
    file.write_text(ROBOT)
    entries, expected = [], []
    robot = yourdfpy.URDF.load(str(file), load_meshes=False)
    none = np.empty(0)
    for i in range(20):
        stamp = START + i * PERIOD
        turn, lift = 0.05 * i, 0.002 * i
        for names, values in ((["other", "turn"], [9.0, turn]), (["lift"], [lift])):
            content = T[JOINTS.msgtype](header(stamp), names, np.array(values), none, none)
            entries.append((JOINTS, stamp, content))
        robot.update_cfg({"turn": turn, "lift": lift})
        expected.append(robot.get_transform("tool0", "base_link")[:3, 3])
    path = by_mcap(entries)
    for index, axis in enumerate("xyz"):
        entry = {
            "topic": "/joint_states",
            "urdf": {"file": "arm.urdf", "parent": "base_link", "child": "tool0"},
            "field": f"transform.translation.{axis}",
        }
        signals = SignalMap.from_mapping({"travel": entry}, folder=tmp_path)
        found = read_recording(path, signals)["travel"].value
        np.testing.assert_allclose(found, np.array(expected)[:, index], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("urdf", "reason"),
    [
        ({"child": "hand"}, "no chain of joints from 'base_link' to 'hand'"),
        ({"child": "x"}, "joint 'loose' is floating, which is not followed"),
        ({"file": "absent.urdf"}, "absent.urdf: .*cannot be read: no such file"),
        ({"parent": "fore"}, "no joint between these links moves"),
        ({"file": "broken.urdf"}, "cannot be read as URDF"),
    ],
)
def test_robots_that_cannot_be_followed_are_named(
    by_mcap: Write, tmp_path: Path, urdf: dict[str, str], reason: str
) -> None:
    pytest.importorskip("yourdfpy")
    (tmp_path / "arm.urdf").write_text(ROBOT)
    (tmp_path / "broken.urdf").write_text("<robot")
    none = np.empty(0)
    content = T[JOINTS.msgtype](header(START), ["turn", "lift"], np.zeros(2), none, none)
    links = {"file": "arm.urdf", "parent": "base_link", "child": "tool0", **urdf}
    entry = {"topic": "/joint_states", "urdf": links, "field": "transform.translation.z"}
    signals = SignalMap.from_mapping({"travel": entry}, folder=tmp_path)
    with pytest.raises(InputError, match=reason):
        read_recording(by_mcap([(JOINTS, START, content)]), signals)


@pytest.mark.parametrize(
    ("more", "field", "reason"),
    [
        ({"direction": [0, 0]}, "direction", "expected three numbers"),
        ({"direction": [0, 0, 0]}, "direction", "has no direction"),
        ({"direction": [0, 0, 1], "joint": "a"}, "direction", "cannot stand beside 'joint'"),
        ({"urdf": "arm.urdf"}, "urdf", "expected 'parent' and 'child' and 'file'"),
        ({"urdf": {"file": "a", "parent": "b"}}, "urdf.child", "is missing"),
        ({"urdf": {"file": "a", "parent": "b", "child": "c"}}, "field", "must be one of transform"),
        ({"frame": {"parent": "a", "child": "b"}, "joint": "c"}, "frame", "cannot stand beside"),
    ],
)
def test_bad_entries_are_named(more: dict[str, Any], field: str, reason: str) -> None:
    entry = {"topic": "/a", "field": "b", **more}
    with pytest.raises(InputError, match=reason) as caught:
        SignalMap.from_mapping({"travel": entry})
    assert caught.value.field == f"travel.{field}"
