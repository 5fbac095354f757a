"""Where numbers lie, against what rosbags reads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.message_batches import Connection
from hma_gripper_sim.bags.message_layout import Layout, follow

STORE = get_typestore(Stores.ROS2_JAZZY)

TYPES = [
    "control_msgs/msg/DynamicJointState",
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/WrenchStamped",
    "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/CameraInfo",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/Empty",
    "std_msgs/msg/Float64MultiArray",
    "tf2_msgs/msg/TFMessage",
    "trajectory_msgs/msg/JointTrajectory",
    "visualization_msgs/msg/MarkerArray",
]


_NUMPY = {"byte": "i1", "char": "u1"}  # others have numpy's names


def made_up(msgtype: str, random: np.random.Generator) -> Any:
    """A message with arrays of any length, and any numbers and texts."""
    fields = STORE.get_msgdef(msgtype).fields
    return STORE.types[msgtype](*[_value(description, random) for _, description in fields])


def _value(description: Any, random: np.random.Generator) -> Any:
    node, content = description
    if node == Nodetype.NAME:
        return made_up(content, random)
    if node == Nodetype.BASE:
        if content[0] == "string":
            return "é" * int(random.integers(3)) + "x" * int(random.integers(9))
        kind = np.dtype(_NUMPY.get(content[0], content[0]))
        return np.frombuffer(random.bytes(8), dtype=np.uint8)[: kind.itemsize].view(kind)[0].item()
    element, count = content
    if node == Nodetype.SEQUENCE:
        count = int(random.integers(4))
    values = [_value(element, random) for _ in range(count)]
    if element[0] == Nodetype.BASE and element[1][0] != "string":
        return np.array(values, dtype=_NUMPY.get(element[1][0], element[1][0]))
    return values


@pytest.mark.parametrize("way", ["little endian", "big endian", "ROS 1"])
@pytest.mark.parametrize("msgtype", [name for name in TYPES if name in STORE.fielddefs])
def test_every_number_is_where_rosbags_reads_it(msgtype: str, way: str) -> None:
    for seed in range(10):
        message = made_up(msgtype, np.random.default_rng(seed))
        data = bytes(STORE.serialize_cdr(message, msgtype, little_endian=way != "big endian"))
        decoded = STORE.deserialize_cdr(data, msgtype)
        if way == "ROS 1":
            data = bytes(STORE.cdr_to_ros1(data, msgtype))
        layout = Layout(data, msgtype, STORE, is_ros1=way == "ROS 1")
        assert layout.end == len(data)
        for path, (offset, kind, count) in layout.numbers.items():
            ours = np.frombuffer(
                data, dtype=kind, count=1 if count is None else count, offset=offset
            )
            theirs = np.atleast_1d(np.asarray(follow(decoded, path)))
            assert (
                ours.astype(ours.dtype.newbyteorder("=")).tobytes()
                == theirs.astype(ours.dtype.newbyteorder("=")).tobytes()
            )
        for path, text in layout.texts.items():
            assert text == follow(decoded, path)
        texts = [text for text in layout.texts.values() if text != []]
        if msgtype != "std_msgs/msg/Empty":  # has one byte in ROS 2, and none in ROS 1
            assert len(layout.numbers) + len(texts) == sum(1 for _ in _leaves(decoded))


def _leaves(value: Any) -> Iterator[Any]:
    """Every number, text, and array of those in a message; of texts only if it has any."""
    if hasattr(value, "__msgtype__"):
        for name, _ in STORE.get_msgdef(value.__msgtype__).fields:
            yield from _leaves(getattr(value, name))
    elif isinstance(value, list) and (not value or hasattr(value[0], "__msgtype__")):
        for element in value:
            yield from _leaves(element)
    else:
        yield value


def test_fixed_bytes_decide_where_numbers_lie() -> None:
    """All bytes but those of numbers and padding: no change of the others moves anything."""
    message = made_up("sensor_msgs/msg/JointState", np.random.default_rng(3))
    data = bytes(STORE.serialize_cdr(message, message.__msgtype__))
    layout = Layout(data, message.__msgtype__, STORE)
    free = np.ones(len(data), dtype=bool)
    for begin, end in layout.fixed:
        free[begin:end] = False
    changed = np.frombuffer(data, dtype=np.uint8).copy()
    changed[free] ^= 0xA5
    other = Layout(changed.tobytes(), message.__msgtype__, STORE)
    assert (other.numbers, other.texts) == (layout.numbers, layout.texts)
    numbers = sum(
        (count or 1) * int(kind[-1]) for _, kind, count in layout.numbers.values() if count != 0
    )
    assert 0 < np.count_nonzero(free) - numbers < 8 * 4  # padding


def test_bytes_that_ros_leaves_behind_a_message_are_let_be() -> None:
    """rmw_fastrtps reserves room for aligning the numbers of empty arrays, and fills none of it."""
    header = STORE.types["std_msgs/msg/Header"](
        STORE.types["builtin_interfaces/msg/Time"](1, 2), ""
    )
    numbers = np.array([3.0]), np.array([]), np.array([4.0])
    message = STORE.types["sensor_msgs/msg/JointState"](header, ["a"], *numbers)
    data = bytes(STORE.serialize_cdr(message, message.__msgtype__)) + bytes.fromhex(
        "00000840d0020000"
    )
    layout = Layout(data, message.__msgtype__, STORE)
    assert layout.end == len(data) - 8
    connection = Connection("a.mcap", "/a", message.__msgtype__, "1")
    assert connection.deserialise(data).effort.tolist() == [4.0]
    with pytest.raises(ValueError, match="12 bytes behind its end"):
        Layout(data + bytes(4), message.__msgtype__, STORE)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x00\x07\x00\x00" + bytes(40),  # XCDR2
        b"\x00\x01\x00\x00" + bytes(7),
        b"\x00\x01\x00\x00" + bytes(8) + b"\xff\xff\xff\x7f",
        b"\x00\x01\x00\x00" + bytes(8) + b"\x01\x00\x00\x00\x00" + bytes(3) + b"\x00\x00\x00\x10",
    ],
)
def test_bytes_that_are_no_such_message_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"serialised|ends after|elements"):
        Layout(data, "sensor_msgs/msg/JointState", STORE)
