"""``hma_gripper replay``: from a log or an experiment to a log and a comparison."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from hma_gripper_sim.bags.log_metadata import logged_parameters
from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.cli.main import cli
from hma_gripper_sim.device.tick_messages import data_message
from hma_gripper_sim.device.topics import CONTOUR, STAMPED_TOPICS
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.replay.simulated_log import Replay
from hma_gripper_sim.replay.simulated_settings import metadata

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path: Path) -> Run:
    """Run ``hma_gripper replay`` with arguments, its output a fresh directory."""

    def invoke(*arguments: object) -> Result:
        output = ["--output", str(tmp_path / "again"), "--json", str(tmp_path / "result.json")]
        return CliRunner().invoke(cli, ["replay", *map(str, arguments), *output])

    return invoke


def result_of(tmp_path: Path) -> dict:
    return json.loads((tmp_path / "result.json").read_text())


def test_a_log_of_ours_needs_no_options_and_comes_out_again(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    """Scene, drive and ticks are in the log; the errors are exactly zero."""
    shown = run(replayed[0], "--max-error", "force=0%", "--max-error", "phi=0%")
    assert shown.exit_code == 0, shown.output
    assert "following the commanded velocity" in shown.output
    assert result_of(tmp_path)["signals"]["travel"]["overall"]["maximum"] == 0.0
    assert "note: estimated error of the simulation: force 0." in shown.output
    assert any("estimated error" in note for note in result_of(tmp_path)["notes"])


def test_the_measured_travel_leads_to_the_same(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    """Half a per cent of the force; the travel within its tolerance."""
    shown = run(replayed[0], "--from", "travel", "--travel-tolerance", "0.5 um")
    assert shown.exit_code == 0, shown.output
    signals = result_of(tmp_path)["signals"]
    assert signals["travel"]["overall"]["maximum"] <= 0.5e-6 * (1 + 1e-6)
    assert signals["actuator_force"]["overall"]["relative"] < 0.005
    assert signals["phi_mean"]["overall"]["maximum"] < np.radians(0.05)


def test_options_change_what_is_simulated(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    shown = run(
        replayed[0], "--friction", "0.6", "--set", "clearance=6mm", "--max-error", "force=1%"
    )
    assert shown.exit_code == 1, shown.output
    assert "friction 0.6" in shown.output
    touch = [
        int(np.argmax(np.abs(recording["actuator_force"].value + 0.0444) > 0.01))
        for recording in (read_recording(replayed[0]), read_recording(tmp_path / "again"))
    ]
    assert touch[1] - touch[0] == pytest.approx(25, abs=3)  # 1 mm later, at 4 mm/s and 100 Hz


def test_the_output_can_be_thinned(run: Run, replayed: tuple[Path, Replay], tmp_path: Path) -> None:
    """Ticks stay what they are; and so the commands lead to the same when replayed again."""
    assert run(replayed[0], "--rate", "5").exit_code == 0
    thin, full = read_recording(tmp_path / "again"), read_recording(replayed[0])
    assert np.diff(thin["travel"].time) == pytest.approx(0.2)
    # Ticks are counted in other periods: their times differ by rounding.
    np.testing.assert_allclose(
        thin["phi_left"].value, full["phi_left"].value[::20], rtol=0.0, atol=1e-12
    )
    shutil.move(tmp_path / "again", tmp_path / "thin")
    assert run(tmp_path / "thin", "--max-error", "force=0.1%").exit_code == 0


def test_an_experiment_is_carried_out_and_gives_table_5_3(run: Run, tmp_path: Path) -> None:
    shown = run("thesis_2013_box")
    assert shown.exit_code == 0, shown.output
    (row,) = result_of(tmp_path)["angles"]
    assert row["relative_error"] == pytest.approx(0.022, abs=0.001)
    assert row["verdict"] == "inside"
    for cell in ("112.1°", "106.9°", "109.5°", "2.2%"):
        assert cell in shown.output


def test_the_log_of_an_experiment_is_replayed_in_its_scene(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    """The file says what was gripped, and that the log was made with another friction."""
    file = tmp_path / "cup.yaml"
    file.write_text(
        "{title: Cup, source: S, scene: {contour: {name: cup, type: circle, radius: 15 mm},"
        f" clearance: 5 mm, friction: 0.5, contact: continuous}}, log: {{path: {replayed[0]}}}}}"
    )
    shown = run(file, "--from", "travel")
    assert shown.exit_code == 0, shown.output
    assert "'cup', friction 0.5, following the measured travel" in shown.output
    force = result_of(tmp_path)["signals"]["actuator_force"]
    assert 0.05 < force["overall"]["relative"] < 0.5
    shutil.rmtree(tmp_path / "again")
    options = ("--friction=0.6", "--set=elements_top=2", "--set=elements_beam=8")
    shown = run(file, "--set=discretisation=midpoint", *options, "--max-error", "force=1%")
    assert shown.exit_code == 0, shown.output


def raw_messages(log: Path) -> Iterator[tuple[str, int, bytes]]:
    """Topic, stamp and bytes of the states and the object in a log."""
    topics = {topic.name for topic in (*STAMPED_TOPICS, CONTOUR)}
    with AnyReader([log], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, stamp, data in reader.messages():
            if connection.topic in topics:
                yield connection.topic, stamp, bytes(data)


def foreign(path: Path, replayed: Path) -> Path:
    """The same messages, from someone who says nothing about what was gripped."""
    shutil.copytree(replayed, path)
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(re.sub(r"hma_gripper_sim\.parameters", "note", text))
    return path


def test_a_log_of_the_node_says_which_object_was_in_place(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    log = foreign(tmp_path / "foreign", replayed[0])
    shown = run(log)
    assert shown.exit_code == 0, shown.output
    assert "'cylinder'" in shown.output
    signals = result_of(tmp_path)["signals"]
    # 63 joints stand for the 2 + 8 elements of the log; the drive's own range is deeper.
    assert signals["phi_mean"]["overall"]["maximum"] < np.radians(0.5)


def test_a_log_in_which_the_object_changes_is_refused(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    """Unless one is named; the log's own metadata name the first."""
    log = tmp_path / "changing"
    parameters = logged_parameters(replayed[0])
    with LogWriter(log, (*STAMPED_TOPICS, CONTOUR), custom_data=metadata(parameters)) as writer:
        for topic, stamp, data in raw_messages(replayed[0]):
            writer.write(topic, stamp, data)
        writer.write(CONTOUR.name, 5 * 10**9, data_message(CONTOUR, "box"))
    shown = run(log)
    assert shown.exit_code == 2
    assert "several objects were in place (box, cylinder)" in shown.stderr
    assert run(log, "--contour", "cylinder").exit_code == 0


def test_a_log_that_starts_elsewhere_is_pointed_out(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    file = tmp_path / "map.yaml"
    file.write_text(
        "travel: {topic: /joint_states, field: position, joint: slide, offset: 2 mm}\n"
        "phi_left: {topic: /hma_gripper_sim/phi, field: position, joint: phi_left}\n"
    )
    shown = run(replayed[0], "--signals", file)
    assert shown.exit_code == 0, shown.output
    assert "starts at a travel of 2 mm" in shown.output


def test_commands_that_lead_elsewhere_are_pointed_out(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    log = foreign(tmp_path / "foreign", replayed[0])
    shown = run(log, "--set", "max_velocity=2 mm/s")
    assert "other commands, limits or ticks were in force" in shown.output
    shutil.rmtree(tmp_path / "again")
    assert "other commands" not in run(log, "--from", "travel").output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nowhere",), "nowhere"),
        (("{log}", "--signals", "none.yaml"), "none.yaml"),
        (("{log}", "--contour", "cup"), "unknown contour 'cup'"),
        (("{log}", "--contour", "cup.yaml"), "cup.yaml"),
        (("{log}", "--design", "none.yaml"), "none.yaml"),
        (("{log}", "--friction", "slippery"), "friction"),
        (("{log}", "--set", "frction=1"), "did you mean 'friction'"),
        (("{log}", "--set", "friction"), "KEY=VALUE"),
        (("{log}", "--rate", "0"), "--rate"),
        (("{log}", "--travel-tolerance", "1 s", "--from", "travel"), "--travel-tolerance"),
        (("{log}", "--max-error", "phi=2"), "--max-error"),
        (("thesis_2013_box", "--from", "travel"), "--from"),
        (("thesis_2013_box", "--signals", "m.yaml"), "--signals"),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_bad_input_is_one_line_exit_code_2_and_changes_nothing(
    run: Run,
    replayed: tuple[Path, Replay],
    tmp_path: Path,
    arguments: tuple[str, ...],
    said: str,
) -> None:
    result = run(*(argument.format(log=replayed[0]) for argument in arguments))
    assert result.exit_code == 2, result.output
    assert said in result.stderr
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "again").exists()


def test_an_output_that_exists_is_kept(
    run: Run, replayed: tuple[Path, Replay], tmp_path: Path
) -> None:
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "mine").write_text("precious")
    assert run(replayed[0]).exit_code == 2
    assert (tmp_path / "again" / "mine").read_text() == "precious"
