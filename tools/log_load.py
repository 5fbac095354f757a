"""Cost of reading a long log: makes one as the node would have it recorded, and reads it.

Not a test: ``python tools/log_load.py --minutes 60 --joints 1 hour.mcap``
"""

from __future__ import annotations

import argparse
import resource
import struct
import time
import zlib
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, McapRecord, Schema
from mcap.writer import MCAP0_MAGIC
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.topic import Topic
from hma_gripper_sim.device.topics import ACTUATOR_WRENCH, CMD_VELOCITY, JOINT_STATES, PHI
from hma_gripper_sim.recordings.reading import read_recording

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
TOPICS = (JOINT_STATES, ACTUATOR_WRENCH, PHI, CMD_VELOCITY)
START, PERIOD = 1_700_000_000_000_000_000, 1_000_000  # ns
TICKS_PER_CHUNK = 500
MARK = 123.456  # stands where a number will change


def message(topic: Topic, joints: list[str]) -> bytes:
    """A message of which the numbers that change are `MARK`."""
    header = TYPES["std_msgs/msg/Header"](TYPES["builtin_interfaces/msg/Time"](0, 0), "")
    if topic is CMD_VELOCITY:
        content = TYPES["std_msgs/msg/Float64"](MARK)
    elif topic is ACTUATOR_WRENCH:
        vector = TYPES["geometry_msgs/msg/Vector3"]
        header.frame_id = "gripper_mount"
        wrench = TYPES["geometry_msgs/msg/Wrench"](vector(0.0, 0.0, MARK), vector(0.0, 0.0, 0.0))
        content = TYPES["geometry_msgs/msg/WrenchStamped"](header, wrench)
    else:
        names = ["phi_left", "phi_right"] if topic is PHI else joints
        numbers = np.full(len(names), MARK)
        content = TYPES["sensor_msgs/msg/JointState"](header, names, numbers, numbers, numbers)
    return bytes(STORE.serialize_cdr(content, topic.msgtype))


def make(path: Path, ticks: int, joints: list[str]) -> None:
    """Write the log, chunk by chunk."""
    pieces: list[bytes] = []
    places, stamps, logs = [], [], []
    for channel, topic in enumerate(TOPICS, 1):
        data = message(topic, joints)
        base = sum(map(len, pieces))
        logs.append(base + 9 + 6)
        if topic is not CMD_VELOCITY:
            stamps.append(base + 9 + 22 + 4)
        mark, at = struct.pack("<d", MARK), -1
        while (at := data.find(mark, at + 1)) >= 0:
            places.append(base + 9 + 22 + at)
        pieces.append(struct.pack("<BQHIQQ", 5, 22 + len(data), channel, 0, 0, 0) + data)
    tick = np.frombuffer(b"".join(pieces), dtype=np.uint8)
    with path.open("wb") as file:
        file.write(MCAP0_MAGIC)
        write(file, Header("ros2", ""))
        for channel, topic in enumerate(TOPICS, 1):
            definition, _ = STORE.generate_msgdef(topic.msgtype, ros_version=2)
            schema = Schema(channel, definition.encode(), "ros2msg", topic.msgtype)
            write(file, schema)
            write(file, Channel(channel, topic.name, "cdr", {}, channel))
        for first in range(0, ticks, TICKS_PER_CHUNK):
            index = np.arange(first, min(first + TICKS_PER_CHUNK, ticks))
            chunk = np.tile(tick, (index.size, 1))
            stamp = START + index * PERIOD
            for at in logs:
                chunk[:, at : at + 8] = stamp.astype("<u8")[:, None].view(np.uint8)
                chunk[:, at + 8 : at + 16] = chunk[:, at : at + 8]
            halves = np.stack([stamp // 10**9, stamp % 10**9], axis=1).astype("<u4")
            for at in stamps:
                chunk[:, at : at + 8] = halves.view(np.uint8)
            for k, at in enumerate(places):
                value = np.sin(1e-3 * index + k).astype("<f8")
                chunk[:, at : at + 8] = value[:, None].view(np.uint8)
            data = chunk.tobytes()
            crc = zlib.crc32(data)
            write(file, Chunk("", data, int(stamp[-1]), int(stamp[0]), crc, len(data)))
        write(file, DataEnd(0))
        write(file, Footer(0, 0, 0))
        file.write(MCAP0_MAGIC)


def write(file: BinaryIO, record: McapRecord) -> None:
    """Append one record."""
    builder = RecordBuilder()
    record.write(builder)
    file.write(builder.end())


def main() -> None:
    """Make the log unless it is there, read it, and print what that cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--joints", type=int, default=1)
    arguments = parser.parse_args()
    names = ["slide", *(f"beam_right_{i}" for i in range(1, arguments.joints))]
    ticks = round(arguments.minutes * 60_000)
    if not arguments.path.exists():
        make(arguments.path, ticks, names)
    size = arguments.path.stat().st_size
    before, cpu = time.perf_counter(), time.process_time()
    recording = read_recording(arguments.path)
    took, cpu = time.perf_counter() - before, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    samples = recording["travel"].value.size
    print(f"{size / 1e9:.2f} GB, {samples} ticks: {took:.1f} s ({cpu:.1f} s CPU), {peak:.0f} MB")


if __name__ == "__main__":
    main()
