"""Signal maps that are guessed: against logs of which it is known where their signals are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import PHI
from hma_gripper_sim.recordings.inspection import inspect_log
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.signal_map import SignalMap
from hma_gripper_sim.recordings.starter_map import quoted, starter_map

T = get_typestore(Stores.ROS2_JAZZY).types
START, PERIOD = 1_700_000_000_000_000_000, 10_000_000  # ns
ARM = ("elbow_joint", "shoulder_lift_joint", "shoulder_pan_joint", "wrist_1_joint")
JOINTS = Topic("/joint_states", "sensor_msgs/msg/JointState")
POSE = Topic("/tcp_pose", "geometry_msgs/msg/PoseStamped")
TF = Topic("/tf", "tf2_msgs/msg/TFMessage")
STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage")
WRENCH = Topic("/wrist_ft", "geometry_msgs/msg/WrenchStamped")

Write = Callable[..., Path]


def header(stamp: int, frame: str = "base") -> Any:
    return T["std_msgs/msg/Header"](
        T["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9), frame
    )


def transform(stamp: int, parent: str, child: str, height: float) -> Any:
    content = T["geometry_msgs/msg/Transform"](
        T["geometry_msgs/msg/Vector3"](0.5, 0.1, height),
        T["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
    )
    return T["geometry_msgs/msg/TransformStamped"](header(stamp, parent), child, content)


def on_an_arm(*kinds: Topic) -> tuple[list[Any], np.ndarray]:
    """An arm at rest for 0.5 s, and down from then on, as said by some topics; and the travel."""
    numbers, empty = T["sensor_msgs/msg/JointState"], np.empty(0)
    vector, point = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Point"]
    turned = T["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    travel = np.interp(np.arange(100), [60, 99], [0.0, 0.02])
    fixed = [
        transform(START, "world", "base", 1.0),
        transform(START, "wrist", "tool0", 0.1),
        transform(START, "world", "tool_rack", 0.3),
    ]
    entries = [(STATIC, START, T[STATIC.msgtype](fixed))] if TF in kinds else []
    for i, way in enumerate(travel.tolist()):
        stamp = START + i * PERIOD
        pose = T["geometry_msgs/msg/Pose"](point(0.5, 0.1, 1.5 - way), turned)
        force = T["geometry_msgs/msg/Wrench"](vector(0.0, 0.0, -way), vector(0.0, 0.0, 0.0))
        said = {
            JOINTS: numbers(header(stamp), list(ARM), np.full(4, 0.1 * i), empty, empty),
            POSE: T[POSE.msgtype](header(stamp), pose),
            TF: T[TF.msgtype]([transform(stamp, "base", "wrist", 0.4 - way)]),
            WRENCH: T[WRENCH.msgtype](header(stamp), force),
        }
        entries += [(kind, stamp, said[kind]) for kind in kinds]
    return entries, travel


def guessed(path: Path) -> tuple[str, SignalMap]:
    """The starter map of a log, as text and read."""
    text = starter_map(inspect_log(path))
    return text, SignalMap.from_mapping(yaml.safe_load(text))


def test_starter_map_reads_the_log_it_was_made_of(five_ticks: Path) -> None:
    expected = read_recording(five_ticks)
    recording = read_recording(five_ticks, guessed(five_ticks)[1])
    for name in ("travel", "actuator_force", "phi_left", "phi_right"):
        assert recording[name].value.tolist() == expected[name].value.tolist()


@pytest.mark.parametrize("kinds", [(JOINTS, POSE, TF, WRENCH), (JOINTS, TF, WRENCH)])
def test_travel_of_an_arm_is_its_tools_height_not_a_joint(by_mcap: Write, kinds: Any) -> None:
    """``shoulder_lift_joint`` lifts nothing; the chain to the tool is in /tf and /tf_static."""
    entries, travel = on_an_arm(*kinds)
    path = by_mcap(entries)
    text, signal_map = guessed(path)
    recording = read_recording(path, signal_map)
    for name in ("travel", "actuator_force"):
        np.testing.assert_allclose(recording[name].value, travel, rtol=0.0, atol=1e-12)
    chain = "frame: {parent: world, child: tool0}"
    assert f"travel: {{topic: /tf, field: transform.translation.z, {chain}" in text
    assert "tool_rack" not in text  # it does not move
    assert "# travel: {topic: /joint_states, field: transform.translation.z, urdf: {file: " in text
    assert "# travel: {topic: /joint_states, field: position, joint: shoulder_lift_joint}" in text
    assert "# actuator_force: {topic: /wrist_ft, field: wrench.force, direction: [0, 0, -1]" in text
    # What stands there as a comment is a map, too.
    for line in text.splitlines():
        if line.startswith("# travel: ") or line.startswith("# actuator_force: {"):
            SignalMap.from_mapping(yaml.safe_load(line.removeprefix("# ")))


@pytest.mark.parametrize("joint", ["lift", "linear_axis", "left_slide"])
def test_joint_that_goes_along_a_line_comes_before_a_pose(by_mcap: Write, joint: str) -> None:
    entries, _ = on_an_arm(JOINTS, POSE)
    for topic, _, message in entries:
        if topic is JOINTS:
            message.name[3] = joint
    text, _ = guessed(by_mcap(entries))
    assert f"\ntravel: {{topic: /joint_states, field: position, joint: {joint}}}" in text
    assert "# travel: {topic: /tcp_pose, field: pose.position.z, scale: -1, tare: 0.5 s}" in text


@pytest.mark.parametrize("prefix", ["", "left_", "right_"])
def test_angles_of_a_gripper_with_a_prefix_are_not_mixed_up(
    entries: list[Any], by_mcap: Write, prefix: str
) -> None:
    for topic, _, message in entries:
        if topic is PHI:
            message.name = [prefix + name for name in message.name]
    text, _ = guessed(by_mcap(entries))
    for side in ("left", "right"):
        place = f"{{topic: /hma_gripper_sim/phi, field: position, joint: {prefix}phi_{side}}}"
        assert f"\nphi_{side}: {place}\n" in text
        assert text.count(f"phi_{side}: ") == 1


def test_starter_map_names_the_publisher_where_there_are_two(
    entries: list[Any], by_two_callers: Callable[..., Path]
) -> None:
    starter = starter_map(inspect_log(by_two_callers(entries)))
    assert "actuator_force: {topic: /hma_gripper_sim/actuator_wrench, publisher: /a, " in starter
    assert "publisher: /b" in starter
    assert "# travel: found nothing that it could be" in starter


@pytest.mark.parametrize(
    "name",
    ["/plain", "/two\nlines", "/red\x1b[31m", "it's", "-dash", "ü: x", "", "1", "no", "[a", " a"],
)
def test_names_stand_in_a_map_as_one_printable_line(name: str) -> None:
    """Whatever a topic is called, the map gives it back, without control codes."""
    line = f"{{topic: {quoted(name)}}}"
    assert line.isprintable()
    assert yaml.safe_load(line) == {"topic": name}
