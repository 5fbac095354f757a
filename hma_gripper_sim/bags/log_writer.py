"""Writing logs that ROS 2 tools play and show: a rosbag2 directory with one mcap file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.mcap_storage import McapStorage
from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.errors import InputError

_FOREVER = QosTime(0x7FFFFFFF, 0xFFFFFFFF)
"""How rosbag2 writes a deadline or lifespan that never ends."""


class _Rosbag2Writer(Writer):  # type: ignore[misc]
    STORAGE_PLUGINS: ClassVar[dict[StoragePlugin, type[McapStorage]]] = {
        StoragePlugin.MCAP: McapStorage
    }


class LogWriter:
    """A log being written; use it as a context manager.

    Parameters
    ----------
    path
        The rosbag2 directory to create; its parents are created too.
    topics
        What will be written.
    compressed
        Whether chunks are compressed (zstd).
    custom_data
        Texts by name that go into the metadata.

    Raises
    ------
    InputError
        The path exists already, or cannot be created.
    """

    def __init__(
        self,
        path: Path,
        topics: Iterable[Topic],
        *,
        compressed: bool = False,
        custom_data: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        if path.exists():
            raise InputError("exists already", source=str(path))
        self._writer = _Rosbag2Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
        if compressed:
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        for name, text in custom_data.items():
            self._writer.set_custom_data(name, text)
        try:
            self._writer.open()
        except OSError as error:
            reason = f"cannot be written: {error.strerror}"
            raise InputError(reason, source=str(path)) from None
        typestore = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Connection] = {
            topic.name: self._writer.add_connection(
                topic.name,
                topic.msgtype,
                typestore=typestore,
                offered_qos_profiles=[_offered_qos(topic)],
            )
            for topic in topics
        }

    def write(self, topic: str, stamp: int, data: bytes) -> None:
        """Append one message: its CDR bytes, logged at `stamp` [ns]."""
        self._writer.write(self._connections[topic], stamp, data)

    def describe(self, name: str, text: str) -> None:
        """Put a text into the metadata that are written in the end."""
        self._writer.set_custom_data(name, text)

    def flush(self) -> None:
        """Hand what has been written to the operating system; a killed program loses none of it."""
        self._writer.storage.flush()

    def __enter__(self) -> LogWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()


def _offered_qos(topic: Topic) -> Qos:
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if topic.latched else QosDurability.VOLATILE,
        deadline=_FOREVER,
        lifespan=_FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_FOREVER,
        avoid_ros_namespace_conventions=False,
    )
