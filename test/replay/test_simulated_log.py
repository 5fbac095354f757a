"""The simulation along a course, and the log of it."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim import InputError, Simulation
from hma_gripper_sim.bags.log_metadata import logged_parameters, read_remarks
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.device.topics import (
    ACTUATOR_WRENCH,
    CMD_VELOCITY,
    CONTOUR,
    JOINT_STATES,
    PHI,
    STAMPED_TOPICS,
)
from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError
from hma_gripper_sim.recordings.reading import read_messages, read_recording
from hma_gripper_sim.recordings.recording import Recording, Series
from hma_gripper_sim.replay import simulated_log
from hma_gripper_sim.replay.course import Course, commanded, measured
from hma_gripper_sim.replay.simulated_log import Replay, replay
from hma_gripper_sim.replay.simulated_settings import SimulatedSettings
from hma_gripper_sim.simulation.companion_runs import Companions

PERIOD_NS = 10_000_000


def test_the_log_holds_what_was_returned(replayed: tuple[Path, Replay]) -> None:
    """Exactly: simulate, log and read back loses nothing."""
    path, result = replayed
    read = read_recording(path)
    assert read.start == result.recording.start
    assert set(result.recording.signals) | {"velocity_command"} == set(read.signals)
    for name, series in result.recording.signals.items():
        assert np.array_equal(read[name].time, series.time), name
        assert np.array_equal(read[name].value, series.value), name


def test_all_messages_of_a_tick_have_one_stamp(
    replayed: tuple[Path, Replay], parameters: SimulatedSettings
) -> None:
    path, result = replayed
    topics = [topic.name for topic in STAMPED_TOPICS]
    stamps: dict[str, list[int]] = {topic: [] for topic in topics}
    for message in read_messages(path, topics):
        stamps[message.topic].append(message.stamp)
        if message.topic == JOINT_STATES.name:
            assert tuple(message.content.name) == parameters.scene.joint_names
    first = stamps[topics[0]]
    assert all(other == first for other in stamps.values())
    assert np.diff(first).tolist() == [PERIOD_NS] * (len(first) - 1)
    assert len(first) == len(result.recording["travel"].time)


def test_the_log_says_what_was_simulated(
    replayed: tuple[Path, Replay], parameters: SimulatedSettings
) -> None:
    path, _ = replayed
    assert SimulatedSettings.parse(logged_parameters(path)) == parameters
    (name,) = (message.content.data for message in read_messages(path, [CONTOUR.name]))
    assert name == "cylinder"


def test_two_replays_are_the_same_byte_for_byte(
    replayed: tuple[Path, Replay], course: Course, parameters: SimulatedSettings, tmp_path: Path
) -> None:
    path, _ = replayed
    again = tmp_path / "log"
    replay(course, parameters, again, PERIOD_NS)
    for name in ("log.mcap", "metadata.yaml"):
        assert (again / name).read_bytes() == (path / name).read_bytes()


def test_a_replay_of_the_commands_in_the_log_is_the_same_again(
    replayed: tuple[Path, Replay], parameters: SimulatedSettings, tmp_path: Path
) -> None:
    path, result = replayed
    course = commanded(read_recording(path), parameters.limits, PERIOD_NS * 1e-9)
    again = replay(course, parameters, tmp_path / "log", PERIOD_NS)
    for name, series in again.recording.signals.items():
        assert np.array_equal(series.value, result.recording[name].value[: len(series.value)])
    assert len(again.recording["travel"].time) == len(result.recording["travel"].time)


def test_it_gives_what_the_drive_gives_tick_by_tick(
    replayed: tuple[Path, Replay], parameters: SimulatedSettings
) -> None:
    """The node's own loop: travel to rounding, force and angle to what the solver aims at."""
    path, result = replayed
    simulation = Simulation(parameters.scene, parameters.tolerance)
    drive = Drive(
        simulation,
        {"cylinder": parameters.scene},
        "cylinder",
        period=0.01,
        limits=parameters.limits,
    )
    commands = {
        message.stamp: message.content.data for message in read_messages(path, [CMD_VELOCITY.name])
    }
    states = [drive.state]
    for k in range(len(result.recording["travel"].time) - 1):
        if k * PERIOD_NS in commands:
            drive.command(commands[k * PERIOD_NS])
        states.append(drive.tick())
    live = {
        name: np.array([getattr(state, name) for state in states])
        for name in ("travel", "actuator_force", "phi_left", "phi_right")
    }
    offline = result.recording
    assert np.abs(offline["travel"].value - live["travel"]).max() < 1e-12
    scale = np.abs(live["actuator_force"]).max()
    force = (offline["actuator_force"].value - live["actuator_force"]) / scale
    assert np.sqrt(np.mean(force**2)) < parameters.tolerance
    for side in ("phi_left", "phi_right"):
        assert np.abs(offline[side].value - live[side]).max() < np.radians(0.02)


def test_blocks_leave_no_trace(
    replayed: tuple[Path, Replay],
    course: Course,
    parameters: SimulatedSettings,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Times and travel are the same to rounding; the force to what the solver aims at."""
    _, result = replayed
    monkeypatch.setattr(simulated_log, "BLOCK", 37)
    other = replay(course, parameters, tmp_path / "log", PERIOD_NS).recording
    assert np.array_equal(other["travel"].time, result.recording["travel"].time)
    assert other["travel"].value == pytest.approx(result.recording["travel"].value, abs=1e-15)
    force = result.recording["actuator_force"].value
    difference = (other["actuator_force"].value - force) / np.abs(force).max()
    assert np.sqrt(np.mean(difference**2)) < parameters.tolerance


def test_a_replay_that_starts_pressed_on_the_object_comes_down_first(
    replayed: tuple[Path, Replay], course: Course, parameters: SimulatedSettings, tmp_path: Path
) -> None:
    """From half way of the same descent on; at rest there, the beams have relaxed."""
    _, result = replayed
    travel = result.recording["travel"]
    half = int(np.searchsorted(travel.value, 0.010))
    time = travel.time[half:] - travel.time[half]
    late = Recording("late", {"travel": Series(time, travel.value[half:])}, result.recording.start)
    got = replay(measured(late, 1e-6), parameters, tmp_path / "log", PERIOD_NS).recording
    rows = slice(100, len(got["phi_left"].value))  # after a second
    expected = result.recording["phi_left"].value[half:][rows]
    assert np.degrees(np.abs(got["phi_left"].value[rows] - expected)).max() < 0.1


def test_a_failure_names_its_time_and_leaves_what_came_before(
    course: Course, parameters: SimulatedSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulated_log, "BLOCK", 100)
    steps = iter(range(100))

    def fails_later(self, motion, period):
        trace = advance(self, motion, period)
        if next(steps) == 2:
            object.__setattr__(trace.stats, "outcome", Outcome.STEP_TOO_SMALL)
        return trace

    advance = Simulation.advance_along
    monkeypatch.setattr(Simulation, "advance_along", fails_later)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(SimulationError, match="t = 3 s"):
            replay(course, parameters, tmp_path / "log", PERIOD_NS)
    assert read_recording(tmp_path / "log")["travel"].time[-1] == pytest.approx(3.0)


def test_other_libraries_read_the_log(replayed: tuple[Path, Replay]) -> None:
    """rosbags and mcap_ros2, through zstd chunks; the same numbers."""
    path, result = replayed
    force: dict[str, list[float]] = {"rosbags": [], "mcap_ros2": []}
    store = get_typestore(Stores.ROS2_JAZZY)
    with AnyReader([path], default_typestore=store) as reader:
        connections = [c for c in reader.connections if c.topic == ACTUATOR_WRENCH.name]
        for connection, _, data in reader.messages(connections):
            message = reader.deserialize(data, connection.msgtype)
            force["rosbags"].append(message.wrench.force.z)
    with (path / "log.mcap").open("rb") as file:
        decoder = make_reader(file, decoder_factories=[DecoderFactory()])
        for *_, message in decoder.iter_decoded_messages(topics=[ACTUATOR_WRENCH.name]):
            force["mcap_ros2"].append(message.wrench.force.z)
    for values in force.values():
        assert np.array_equal(values, result.recording["actuator_force"].value)


def test_left_is_left(course: Course, parameters: SimulatedSettings, tmp_path: Path) -> None:
    """An object to the right of the axis spreads the right beam first; also in the messages."""
    aside = SimulatedSettings.parse({**parameters.given, "offset": 0.002})
    result = replay(course, aside, tmp_path / "log", PERIOD_NS).recording
    read = read_recording(tmp_path / "log")
    for side in ("phi_left", "phi_right"):
        assert np.array_equal(read[side].value, result[side].value)
    half = len(result["phi_left"].value) // 3
    assert result["phi_right"].value[half] > result["phi_left"].value[half] + np.radians(1.0)
    state = next(m for m in read_messages(tmp_path / "log", [PHI.name]) if m.stamp == 10**9)
    assert list(state.content.name) == ["phi_left", "phi_right"]


def test_a_command_stands_after_the_tick_that_was_seen_when_it_was_sent(
    replayed: tuple[Path, Replay],
) -> None:
    path, _ = replayed
    newest = -1
    for message in read_messages(path, [JOINT_STATES.name, CMD_VELOCITY.name]):
        if message.topic == JOINT_STATES.name:
            newest = message.stamp
        else:
            assert message.stamp == newest


def test_a_replay_says_its_error_and_the_log_does_so_too(
    replayed: tuple[Path, Replay], course: Course, parameters: SimulatedSettings
) -> None:
    """That of one verified run along the whole course, although it is simulated in blocks."""
    path, result = replayed
    simulation = Simulation(parameters.scene, parameters.tolerance)
    companions = Companions(simulation)
    trace = simulation.advance_along(course.motion, PERIOD_NS * 1e-9)
    companions.advance_along(course.motion, trace)
    assert result.error_estimate == companions.estimate()
    assert result.validity == trace.validity
    first, *others = read_remarks(path)
    assert first == f"estimated error of the simulation: {result.error_estimate}"
    assert others == [str(finding) for finding in result.validity]


def test_blocks_are_verified_together(
    course: Course, parameters: SimulatedSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their error is of the size of the whole run's: it is not that of each block alone."""
    whole = replay(course, parameters, tmp_path / "whole", PERIOD_NS)
    monkeypatch.setattr(simulated_log, "BLOCK", 100)
    blocks = replay(course, parameters, tmp_path / "blocks", PERIOD_NS)
    said, wanted = blocks.error_estimate.force_rms, whole.error_estimate.force_rms
    assert said is not None
    assert wanted is not None
    assert wanted / 3.0 < said < 3.0 * wanted


def test_remarks_that_are_none(replayed: tuple[Path, Replay], tmp_path: Path) -> None:
    """A log without any says nothing; a damaged one is refused by name."""
    bag = tmp_path / "bag"
    bag.mkdir()
    assert read_remarks(bag) == ()
    text = "rosbag2_bagfile_information: {custom_data: {hma_gripper_sim.remarks: '{'}}"
    (bag / "metadata.yaml").write_text(text)
    with pytest.raises(InputError, match="remarks"):
        read_remarks(bag)
