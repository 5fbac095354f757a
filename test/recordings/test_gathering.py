"""Signals in bulk, against the same messages one by one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim import InputError, config_directory
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.recordings.reading import read_messages, read_recording
from hma_gripper_sim.recordings.signal_map import SignalMap

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
START = 1_700_000_000_000_000_000  # ns

JOINTS = Topic("/joint_states", "sensor_msgs/msg/JointState")
TF = Topic("/tf", "tf2_msgs/msg/TFMessage")
WRENCH = Topic("/wrench", "geometry_msgs/msg/WrenchStamped")
PHI = Topic("/phi", "std_msgs/msg/Float32")

MAP = SignalMap.from_mapping(
    {
        "travel": {
            "topic": "/tf",
            "frame": {"parent": "base", "child": "tool"},
            "field": "transform.translation.z",
        },
        "actuator_force": {"topic": "/wrench", "field": "wrench.force.z"},
        "phi_left": {"topic": "/phi", "field": "data"},
        "phi_right": {"topic": "/joint_states", "field": "velocity", "joint": "slide"},
        "bending_moment": {"topic": "/joint_states", "field": "effort", "largest_but": "slide"},
    }
)

Write = Callable[..., Path]


def header(stamp: int, frame: str = "") -> Any:
    time = T["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    return T["std_msgs/msg/Header"](time, frame)


def joint_state(stamp: int, names: list[str], random: np.random.Generator, frame: str) -> Any:
    numbers = random.normal(size=(3, len(names)))
    return T[JOINTS.msgtype](header(stamp, frame), names, *numbers)


def transform(stamp: int, parent: str, child: str, random: np.random.Generator) -> Any:
    translation = T["geometry_msgs/msg/Vector3"](*random.normal(size=3))
    rotation = T["geometry_msgs/msg/Quaternion"](*random.normal(size=4))
    content = T["geometry_msgs/msg/Transform"](translation, rotation)
    return T["geometry_msgs/msg/TransformStamped"](header(stamp, parent), child, content)


def made_up(count: int) -> list[tuple[Topic, int, Any]]:
    """Messages whose layout changes all the time: more layouts than are kept in mind."""
    random = np.random.default_rng(7)
    entries = []
    for i in range(count):
        stamp = START + i * 1_000_000
        names = ["slide", *(f"joint_{k}" for k in range(random.integers(1, 12)))]
        random.shuffle(names)
        if i % 3 == 0:
            names.remove("slide")  # an arm's
        entries.append((JOINTS, stamp, joint_state(stamp, names, random, "f" * (i % 5))))
        others = [transform(stamp, "base", f"link_{k}", random) for k in range(i % 4)]
        ours = [transform(stamp + 7, "/base", "tool", random)] if i % 2 else []
        entries.append((TF, stamp, T[TF.msgtype](others + ours)))
        vector = T["geometry_msgs/msg/Vector3"]
        wrench = T["geometry_msgs/msg/Wrench"](
            vector(*random.normal(size=3)), vector(*random.normal(size=3))
        )
        entries.append((WRENCH, stamp, T[WRENCH.msgtype](header(stamp, "wrist"), wrench)))
        entries.append((PHI, stamp + 5, T[PHI.msgtype](float(np.float32(random.normal())))))
    return entries


@pytest.mark.parametrize("piece", [1000, 4 * 2**20])
def test_bulk_gives_what_one_by_one_gives(
    by_mcap: Write, monkeypatch: pytest.MonkeyPatch, piece: int
) -> None:
    """Bit by bit: values, and stamps; of joints, frames, plain numbers and without a header."""
    monkeypatch.setattr("hma_gripper_sim.bags.mcap_file._PIECE", piece)
    path = by_mcap(made_up(200), chunk_size=20_000)
    expected: dict[str, list[tuple[int, float]]] = {signal.name: [] for signal in MAP.signals}
    for topic, stamp, content in read_messages(path, MAP.topics):
        if topic == "/tf":
            for entry in content.transforms:
                if entry.child_frame_id == "tool":
                    at = entry.header.stamp.sec * 10**9 + entry.header.stamp.nanosec
                    expected["travel"].append((at, entry.transform.translation.z))
        elif topic == "/wrench":
            expected["actuator_force"].append((stamp, content.wrench.force.z))
        elif topic == "/phi":
            expected["phi_left"].append((stamp, content.data))
        elif "slide" in content.name:
            index = content.name.index("slide")
            expected["phi_right"].append((stamp, content.velocity[index]))
            moments = np.abs(np.delete(content.effort, index))
            expected["bending_moment"].append((stamp, moments.max()))
    recording = read_recording(path, MAP)
    for name, samples in expected.items():
        stamps, values = zip(*samples, strict=True)
        assert recording[name].value.tolist() == list(values)
        time = (np.array(stamps) - recording.start) * 1e-9
        np.testing.assert_array_equal(recording[name].time, time)


def test_big_endian_messages_are_read(tmp_path: Path, by_mcap: Write) -> None:
    """As a recorder on another machine wrote them, beside ours."""
    entries = made_up(20)
    path = by_mcap(entries, use_chunking=False, enable_crcs=False)
    content = path.read_bytes()
    for topic, _, message in entries:
        for little in (True, False):
            data = bytes(STORE.serialize_cdr(message, topic.msgtype, little_endian=little))
            if little:
                ours = data
        if topic is WRENCH:
            assert content.count(ours) == 1
            content = content.replace(ours, data)
    turned = tmp_path / "turned.mcap"
    turned.write_bytes(content)
    for name in ("actuator_force", "travel"):
        expected = read_recording(path, MAP)[name]
        found = read_recording(turned, MAP)[name]
        assert found.value.tolist() == expected.value.tolist()
        assert found.time.tolist() == expected.time.tolist()


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        (
            {"topic": "/wrench", "field": "wrench.force.w"},
            r"no number 'wrench.force.w' \(geometry_msgs/msg/WrenchStamped: header.stamp.sec, "
            r"header.stamp.nanosec, wrench.force.x, wrench.force.y, wrench.force.z, ",
        ),
        ({"topic": "/wrench", "field": "wrench"}, "no number 'wrench'"),
        ({"topic": "/wrench", "field": "header.frame_id"}, "no number 'header.frame_id'"),
        ({"topic": "/wrench", "field": "wrench.force.z[0]"}, "no number"),
        ({"topic": "/wrench", "field": "wrench.force.z", "joint": "a"}, "names no joints"),
        ({"topic": "/joint_states", "field": "position"}, "no number 'position'"),
        ({"topic": "/joint_states", "field": "position[20]"}, "entries of 'position', not 21"),
        ({"topic": "/joint_states", "field": "angle", "joint": "slide"}, "no number 'angle'"),
        ({"topic": "/joint_states", "field": "position", "joint": "sled"}, "about joint 'sled'"),
        (
            {
                "topic": "/tf",
                "field": "transform.translation.z",
                "frame": {"parent": "tool", "child": "gripper"},
            },
            r"no message is about frame tool → gripper \(there are: base → link_0, base → link_1, "
            r"base → link_2, base → tool\)",
        ),
        ({"topic": "/absent", "field": "data"}, r"no such topic in this log \(there are: /joint_"),
    ],
)
def test_field_that_is_not_there_is_named(
    by_mcap: Write, entry: dict[str, Any], reason: str
) -> None:
    path = by_mcap(made_up(8))
    with pytest.raises(InputError, match=reason) as caught:
        read_recording(path, SignalMap.from_mapping({"travel": entry}))
    assert (caught.value.source, caught.value.field) == (str(path), entry["topic"])


def test_entry_of_an_array_is_read(by_mcap: Write) -> None:
    topic = Topic("/commands", "std_msgs/msg/Float64MultiArray")
    layout = T["std_msgs/msg/MultiArrayLayout"]([], 0)
    entries = [
        (topic, START + i, T[topic.msgtype](layout, np.array([0.5, 0.25 * i]))) for i in range(3)
    ]
    entry = {"topic": "/commands", "field": "data[1]"}
    recording = read_recording(
        by_mcap(entries), SignalMap.from_mapping({"velocity_command": entry})
    )
    assert recording["velocity_command"].value.tolist() == [0.0, 0.25, 0.5]


def test_message_that_is_too_short_for_its_type_is_named(by_mcap: Write) -> None:
    path = by_mcap(made_up(1), use_chunking=False, enable_crcs=False)
    content = path.read_bytes()
    path.write_bytes(content.replace(b"float32 data", b"float64 data"))
    reason = (
        r"a message logged at 1700000000.000000 s cannot be deserialised \(ends after 8 bytes\)"
    )
    with pytest.raises(InputError, match=reason) as caught:
        read_recording(path, MAP)
    assert caught.value.field == "/phi"


def arm(count: int) -> list[tuple[Topic, int, Any]]:
    """What the shipped example of an arm is for: at rest for 0.5 s, then 4 mm/s down."""
    random = np.random.default_rng(1)
    commands = Topic("/lift_controller/commands", "std_msgs/msg/Float64MultiArray")
    wrist = Topic("/wrist_ft_sensor/wrench", WRENCH.msgtype)
    left = Topic("/vision/phi_left", "std_msgs/msg/Float64")
    right = Topic("/vision/angles", JOINTS.msgtype)
    vector, layout = T["geometry_msgs/msg/Vector3"], T["std_msgs/msg/MultiArrayLayout"]([], 0)
    entries = []
    for i in range(count):
        stamp, down = START + i * 10_000_000, max(0, i - 50) * 4e-5
        tool = transform(stamp, "base_link", "tool0", random)
        tool.transform.translation.z = 0.75 - down
        wrench = T["geometry_msgs/msg/Wrench"](vector(1.0, 2.0, 3.0 - 10.0 * down), vector(0, 0, 0))
        angles = joint_state(stamp, ["other", "phi_right"], random, "camera")
        angles.position[:] = 9.0, 1.7 + down
        for topic, message in (
            (TF, T[TF.msgtype]([transform(stamp, "world", "base_link", random), tool])),
            (commands, T[commands.msgtype](layout, np.array([0.004 if i >= 50 else 0.0]))),
            (wrist, T[wrist.msgtype](header(stamp, "wrist"), wrench)),
            (left, T[left.msgtype](97.0 + 1000.0 * down)),
            (right, angles),
        ):
            entries.append((topic, stamp + 3_000_000, message))  # logged a little later
    return entries


def test_shipped_map_of_an_arm_reads_its_log_in_si_units(by_mcap: Write) -> None:
    path = config_directory() / "signal_maps" / "robot_arm.yaml"
    recording = read_recording(by_mcap(arm(100)), SignalMap.from_yaml(path))
    down = np.maximum(0.0, np.arange(100) - 50) * 4e-5
    for name, value in {
        "travel": down,
        "velocity_command": np.where(np.arange(100) >= 50, 0.004, 0.0),
        "actuator_force": 10.0 * down - 0.0444,
        "phi_left": np.radians(97.0 + 1000.0 * down),
        "phi_right": 1.7 + down,
    }.items():
        np.testing.assert_allclose(recording[name].value, value, rtol=1e-12, atol=1e-12)
    assert recording.start == START
    for name, begin in {"travel": 0.0, "actuator_force": 0.0, "phi_left": 0.003}.items():
        assert recording[name].time[0] == pytest.approx(begin, abs=1e-12)
    assert recording.notes == ()
