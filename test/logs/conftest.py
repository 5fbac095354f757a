"""Logs made up message by message."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mcap.writer
import mcap_ros2.writer
import numpy as np
import pytest
import rosbags.rosbag1
import yaml
from mcap.writer import CompressionType
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.logs.topics import (
    ACTUATOR_WRENCH,
    CONTOUR,
    JOINT_STATES,
    LOGGED_TOPICS,
    PHI,
    Topic,
)
from hma_gripper_sim.logs.writer import LogWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types

START = 1_700_000_000_123_456_789  # ns
PERIOD = 10_000_000  # ns


def header(stamp: int, frame: str = "") -> Any:
    time = T["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
    return T["std_msgs/msg/Header"](time, frame)


def joint_state(
    stamp: int, names: Sequence[str], position: Sequence[float], effort: Sequence[float]
) -> Any:
    rest = np.zeros(len(names))
    return T["sensor_msgs/msg/JointState"](
        header(stamp), list(names), np.array(position, float), rest, np.array(effort, float)
    )


def wrench(stamp: int, force: float) -> Any:
    vector = T["geometry_msgs/msg/Vector3"]
    content = T["geometry_msgs/msg/Wrench"](vector(0.0, 0.0, force), vector(0.0, 0.0, 0.0))
    return T["geometry_msgs/msg/WrenchStamped"](header(stamp, "gripper_mount"), content)


Entry = tuple[Topic, int, Any]


def ticks(count: int) -> list[Entry]:
    """What a node with the joints ``slide``, ``a`` and ``b`` publishes in `count` ticks."""
    entries: list[Entry] = [(CONTOUR, START, T["std_msgs/msg/String"]("box"))]
    for i in range(count):
        stamp = START + i * PERIOD
        names = ("slide", "a", "b")
        joints = joint_state(stamp, names, (0.001 * i, 0.1 * i, -0.1 * i), (9.0, 0.2, -0.3 * i))
        angles = joint_state(stamp, ("phi_right", "phi_left"), (1.5, 1.6 + 0.01 * i), ())
        entries += [
            (JOINT_STATES, stamp, joints),
            (ACTUATOR_WRENCH, stamp, wrench(stamp, 0.5 - 0.125 * i)),
            (PHI, stamp, angles),
        ]
    return entries


@pytest.fixture
def entries() -> list[Entry]:
    """Five ticks of a node, for a test to change before they are written."""
    return ticks(5)


@pytest.fixture
def make_ticks() -> Callable[[int], list[Entry]]:
    """Make as many ticks as asked for."""
    return ticks


@pytest.fixture
def write_log(tmp_path: Path) -> Callable[[Sequence[Entry]], Path]:
    """Write messages with `LogWriter`; return the log's path."""

    def write(entries: Sequence[Entry]) -> Path:
        path = tmp_path / "made" / "up"
        with LogWriter(path, LOGGED_TOPICS) as log:
            for topic, stamp, message in entries:
                log.write(topic.name, stamp, bytes(STORE.serialize_cdr(message, topic.msgtype)))
        return path

    return write


@pytest.fixture
def five_ticks(entries: list[Entry], write_log: Callable[[Sequence[Entry]], Path]) -> Path:
    """A log of five ticks."""
    return write_log(entries)


# What others write.


def serialised(message: Any) -> bytes:
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


_QOS = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    QosTime(0, 0),
    QosTime(0, 0),
    QosLiveliness.AUTOMATIC,
    QosTime(0, 0),
    False,
)


def by_rosbags(
    folder: Path,
    entries: Sequence[Entry],
    plugin: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
    publishers: int = 1,
) -> Path:
    """A rosbag2 directory, recorded from so many publishers of each topic."""
    path = folder / "bag"
    writer = Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(
                topic.name,
                topic.msgtype,
                typestore=STORE,
                offered_qos_profiles=[_QOS] * publishers,
            )
            for topic in dict.fromkeys(topic for topic, _, _ in entries)
        }
        for topic, stamp, message in entries:
            writer.write(connections[topic], stamp, serialised(message))
    return path


def by_rosbags_as_ros1(
    folder: Path,
    entries: Sequence[Entry],
    compression: rosbags.rosbag1.Writer.CompressionFormat | None = None,
) -> Path:
    """A ROS 1 bag file."""
    path = folder / "bag.bag"
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = rosbags.rosbag1.Writer(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {
            topic: writer.add_connection(topic.name, topic.msgtype, typestore=store)
            for topic in dict.fromkeys(topic for topic, _, _ in entries)
        }
        for topic, stamp, message in entries:
            data = STORE.cdr_to_ros1(serialised(message), topic.msgtype)
            writer.write(connections[topic], stamp, data)
    return path


def store_by_mcap(folder: Path, entries: Sequence[Entry], **options: Any) -> Path:
    """A file written by the mcap library itself."""
    path = folder / "plain.mcap"
    with path.open("wb") as file:
        writer = mcap.writer.Writer(file, **options)
        writer.start(profile="ros2")
        channels = {}
        for topic in dict.fromkeys(topic for topic, _, _ in entries):
            definition, _ = STORE.generate_msgdef(topic.msgtype, ros_version=2)
            schema = writer.register_schema(topic.msgtype, "ros2msg", definition.encode())
            channels[topic] = writer.register_channel(topic.name, "cdr", schema)
        for topic, stamp, message in entries:
            writer.add_message(channels[topic], stamp, serialised(message), stamp)
        writer.finish()
    return path


def plain(message: Any) -> Any:
    """The message as mappings and lists."""
    if isinstance(message, np.ndarray):
        return message.tolist()
    if not hasattr(message, "__msgtype__"):
        return message
    fields = [name for name in vars(message) if not name.startswith("_")]
    return {name: plain(getattr(message, name)) for name in fields}


def by_mcap_ros2(folder: Path, entries: Sequence[Entry]) -> Path:
    """A file written by mcap_ros2, which serialises the messages itself."""
    path = folder / "ros2.mcap"
    with path.open("wb") as file:
        writer = mcap_ros2.writer.Writer(file)
        schemas = {}
        for topic, stamp, message in entries:
            if topic not in schemas:
                definition, _ = STORE.generate_msgdef(topic.msgtype, ros_version=2)
                schemas[topic] = writer.register_msgdef(topic.msgtype, definition)
            writer.write_message(topic.name, schemas[topic], plain(message), stamp)
        writer.finish()
    return path


def split(folder: Path, entries: Sequence[Entry], plugin: StoragePlugin) -> Path:
    """A rosbag2 directory with two files; the later one's topics are numbered differently."""
    middle = len(entries) // 2
    (folder / "1").mkdir()
    (folder / "2").mkdir()
    first = by_rosbags(folder / "1", entries[:middle], plugin)
    second = by_rosbags(folder / "2", entries[middle:], plugin)
    suffix = ".mcap" if plugin is StoragePlugin.MCAP else ".db3"
    for number, bag in enumerate((first, second)):
        shutil.move(bag / f"bag{suffix}", first / f"bag_{number}{suffix}")
    metadata = yaml.safe_load((first / "metadata.yaml").read_text())
    names = [f"bag_{number}{suffix}" for number in range(2)]
    metadata["rosbag2_bagfile_information"]["relative_file_paths"] = names
    (first / "metadata.yaml").write_text(yaml.safe_dump(metadata))
    return first


def bare_db3(folder: Path, entries: Sequence[Entry]) -> Path:
    return by_rosbags(folder, entries, StoragePlugin.SQLITE3) / "bag.db3"


_ROS1 = rosbags.rosbag1.Writer.CompressionFormat

STORAGES: dict[str, Callable[[Path, Sequence[Entry]], Path]] = {
    "rosbag2 mcap": by_rosbags,
    "rosbag2 mcap, zstd chunks": partial(by_rosbags, compression=CompressionMode.STORAGE),
    "rosbag2 mcap, zstd messages": partial(by_rosbags, compression=CompressionMode.MESSAGE),
    "rosbag2 mcap, zstd file": partial(by_rosbags, compression=CompressionMode.FILE),
    "rosbag2 mcap, split": partial(split, plugin=StoragePlugin.MCAP),
    "rosbag2 sqlite3": partial(by_rosbags, plugin=StoragePlugin.SQLITE3),
    "rosbag2 sqlite3, zstd messages": partial(
        by_rosbags, plugin=StoragePlugin.SQLITE3, compression=CompressionMode.MESSAGE
    ),
    "rosbag2 sqlite3, zstd file": partial(
        by_rosbags, plugin=StoragePlugin.SQLITE3, compression=CompressionMode.FILE
    ),
    "rosbag2 sqlite3, split": partial(split, plugin=StoragePlugin.SQLITE3),
    "db3": bare_db3,
    "mcap": partial(store_by_mcap, compression=CompressionType.NONE),
    "mcap, zstd chunks": partial(store_by_mcap, compression=CompressionType.ZSTD, chunk_size=1000),
    "mcap, lz4 chunks": partial(
        store_by_mcap, compression=CompressionType.LZ4, enable_data_crcs=True
    ),
    "mcap without chunks": partial(store_by_mcap, use_chunking=False, enable_data_crcs=True),
    "mcap_ros2": by_mcap_ros2,
    "rosbag2 mcap, two publishers": partial(by_rosbags, publishers=2),
    "rosbag2 sqlite3, two publishers": partial(
        by_rosbags, plugin=StoragePlugin.SQLITE3, publishers=2
    ),
    "ROS 1": by_rosbags_as_ros1,
    "ROS 1, bz2": partial(by_rosbags_as_ros1, compression=_ROS1.BZ2),
    "ROS 1, lz4": partial(by_rosbags_as_ros1, compression=_ROS1.LZ4),
}


@pytest.fixture(params=[name for name in STORAGES if "two publishers" not in name], ids=str)
def stored_log(request: pytest.FixtureRequest, entries: list[Entry], tmp_path: Path) -> Path:
    """A log of five ticks, in every way that logs are stored."""
    return STORAGES[request.param](tmp_path, entries)


@pytest.fixture
def by_two_callers(tmp_path: Path) -> Callable[[Sequence[Entry]], Path]:
    """Write the wrenches of a log to a ROS 1 bag, from the callers /a and /b by turns."""

    def write(entries: Sequence[Entry]) -> Path:
        path = tmp_path / "two.bag"
        store = get_typestore(Stores.ROS1_NOETIC)
        wrenches = [entry for entry in entries if entry[0] is ACTUATOR_WRENCH]
        with rosbags.rosbag1.Writer(path) as writer:
            connections = [
                writer.add_connection(
                    ACTUATOR_WRENCH.name, ACTUATOR_WRENCH.msgtype, typestore=store, callerid=caller
                )
                for caller in ("/a", "/b")
            ]
            for index, (topic, stamp, message) in enumerate(wrenches):
                data = STORE.cdr_to_ros1(serialised(message), topic.msgtype)
                writer.write(connections[index % 2], stamp, data)
        return path

    return write


@pytest.fixture
def as_ros1() -> Callable[[Any], tuple[str, bytes]]:
    """Return the definition of a message's type, and the message, as in ROS 1."""
    store = get_typestore(Stores.ROS1_NOETIC)

    def convert(message: Any) -> tuple[str, bytes]:
        definition, _ = store.generate_msgdef(message.__msgtype__, ros_version=1)
        return definition, bytes(STORE.cdr_to_ros1(serialised(message), message.__msgtype__))

    return convert


@pytest.fixture
def serialise() -> Callable[[Any], bytes]:
    """Serialise a message."""
    return serialised


@pytest.fixture
def storages() -> dict[str, Callable[[Path, Sequence[Entry]], Path]]:
    """How to store messages in a folder, by name."""
    return STORAGES


@pytest.fixture
def by_mcap(tmp_path: Path) -> Callable[..., Path]:
    """Write messages with the mcap library; return the file's path."""
    return partial(store_by_mcap, tmp_path)
