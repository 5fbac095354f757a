"""Logs as other tools see them."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim import InputError
from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.device.topics import LOGGED_TOPICS

START, PERIOD = 1_700_000_000_123_456_789, 10_000_000  # ns
TICKS = {"/joint_states": 5, "/hma_gripper_sim/actuator_wrench": 5, "/hma_gripper_sim/phi": 5}


def test_rosbags_reads_every_message_back(five_ticks: Path) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(five_ticks) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == {
            topic.name: topic.msgtype for topic in LOGGED_TOPICS
        }
        found = [
            (connection.topic, stamp, store.deserialize_cdr(data, connection.msgtype))
            for connection, stamp, data in reader.messages()
        ]
    counted = Counter(topic for topic, _, _ in found)
    assert counted == {**TICKS, "/hma_gripper_sim/contour": 1}
    joints = [(stamp, message) for topic, stamp, message in found if topic == "/joint_states"]
    assert [stamp for stamp, _ in joints] == [START + i * PERIOD for i in range(5)]
    assert [list(message.position) for _, message in joints] == [
        [0.001 * i, 0.1 * i, -0.1 * i] for i in range(5)
    ]


def test_mcap_ros2_decodes_every_message(five_ticks: Path) -> None:
    with (five_ticks / "up.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        decoded = list(reader.iter_decoded_messages())
    assert {schema.encoding for schema, _, _, _ in decoded} == {"ros2msg"}
    forces = [
        message.wrench.force.z
        for _, channel, _, message in decoded
        if channel.topic == "/hma_gripper_sim/actuator_wrench"
    ]
    assert forces == [0.5, 0.375, 0.25, 0.125, 0.0]


def test_metadata_is_what_ros2_bag_wants(five_ticks: Path) -> None:
    """Version 9 is Jazzy's; without the durability, latched topics are not played to latecomers."""
    text = (five_ticks / "metadata.yaml").read_text(encoding="utf-8")
    metadata = yaml.safe_load(text)["rosbag2_bagfile_information"]
    assert (metadata["version"], metadata["storage_identifier"]) == (9, "mcap")
    assert metadata["message_count"] == 16
    assert metadata["duration"]["nanoseconds"] == 4 * PERIOD
    durability = {
        entry["topic_metadata"]["name"]: entry["topic_metadata"]["offered_qos_profiles"][0][
            "durability"
        ]
        for entry in metadata["topics_with_message_count"]
    }
    assert durability["/hma_gripper_sim/contour"] == "transient_local"
    assert durability["/joint_states"] == "volatile"


def test_messages_written_before_a_failure_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "log"
    with suppress(RuntimeError), LogWriter(path, LOGGED_TOPICS) as log:
        log.write("/joint_states", 1, b"\x00\x01\x00\x00")
        raise RuntimeError
    with Reader(path) as reader:
        assert reader.message_count == 1


def test_existing_files_are_not_touched(five_ticks: Path) -> None:
    before = (five_ticks / "up.mcap").read_bytes()
    with pytest.raises(InputError, match="exists already"):
        LogWriter(five_ticks, LOGGED_TOPICS)
    assert (five_ticks / "up.mcap").read_bytes() == before


def test_path_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    path = tmp_path / "file" / "log"
    with pytest.raises(InputError, match="cannot be written") as caught:
        LogWriter(path, LOGGED_TOPICS)
    assert caught.value.source == str(path)
