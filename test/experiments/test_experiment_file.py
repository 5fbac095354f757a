"""Experiment files: what the shipped ones say, and how bad ones are refused."""

from __future__ import annotations

import copy
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from hma_gripper_sim import Circle, GripperDesign, InputError, RoundedBox, config_directory
from hma_gripper_sim.experiments.experiment import Experiment, Measurement, Segment
from hma_gripper_sim.experiments.experiment_file import is_experiment, read_experiment

FILES = sorted((config_directory() / "experiments").glob("*.yaml"))


def shipped(name: str) -> Experiment:
    return read_experiment(config_directory() / "experiments" / f"thesis_2013_{name}.yaml")


def stated(experiment: Experiment, figure: str) -> float:
    """The published value of a figure."""
    values = [c.expected for c in experiment.published if c.figure == figure and c.expected]
    assert len(values) == 1
    return values[0]


def approx(value: float, **bounds: Any) -> Any:
    """Return `pytest.approx`, which may stand where a number is meant."""
    return pytest.approx(value, **bounds)


def test_box_of_the_thesis() -> None:
    """Sections 5.1.2 and 5.3.1; Table 5.3."""
    box = shipped("box")
    assert box.name == "thesis_2013_box"
    assert box.contour == RoundedBox(width=0.028, height=0.028, corner_radius=0.002)
    assert (box.contour_name, box.clearance, box.friction, box.contact) == (
        "box",
        approx(0.004),
        0.6,
        "sampled",
    )
    assert box.motion == (
        Segment(approx(0.004), 7.0),
        Segment(approx(-0.004), 7.0),
    )
    reading = approx(math.radians(0.5))
    assert box.measurements == (
        Measurement("phi_left", 7.0, approx(math.radians(112.1)), reading),
        Measurement("phi_right", 7.0, approx(math.radians(106.9)), reading),
    )


def test_cylinder_of_the_thesis() -> None:
    """Sections 5.1.1 and 5.3.1; Table 5.3."""
    cylinder = shipped("cylinder")
    assert cylinder.contour == Circle(radius=0.015)
    assert cylinder.clearance == approx(0.005)
    measured = {m.figure: math.degrees(m.value) for m in cylinder.measurements}
    assert measured == {"phi_left": approx(110.3), "phi_right": approx(106.8)}


@pytest.mark.parametrize(("name", "percent"), [("box", 1.9), ("cylinder", 1.5)])
def test_published_angles_have_the_published_error(name: str, percent: float) -> None:
    """Table 5.3's last column follows from its others.

    It prints the error to 0.1 %, and was computed from a mean rounded to 0.1°: half of each.
    """
    experiment = shipped(name)
    (mean,) = (c for c in experiment.measured if c.figure == "phi_mean")
    assert mean.expected is not None
    simulated = stated(experiment, "phi_mean")
    assert 100 * abs(simulated - mean.expected) / mean.expected == approx(percent, abs=0.1)


@pytest.mark.parametrize("name", ["box", "cylinder"])
def test_published_stress_belongs_to_the_published_moment(name: str) -> None:
    """Table 5.2 prints two digits of σ = M z / I (Eq. 5.1)."""
    experiment = shipped(name)
    stress = GripperDesign.thesis_2013().bending_stress(stated(experiment, "max_bending_moment"))
    assert stress == approx(stated(experiment, "max_stress"), abs=0.06e5)


def test_mean_angle_is_bounded_and_single_angles_are_not() -> None:
    """One side of the real gripper is 5° off the other: only their mean is a target."""
    bounds = {c.figure: (c.lower, c.upper) for c in shipped("box").measured}
    mean = math.radians(109.5)
    assert bounds["phi_mean"] == (approx(0.97 * mean), approx(1.03 * mean))
    assert bounds["phi_left"] == bounds["phi_right"] == (-math.inf, math.inf)


def test_way_points_add_up_the_motion() -> None:
    assert shipped("box").way_points == (
        (0.0, 0.0),
        (7.0, approx(0.028)),
        (14.0, approx(0.0, abs=1e-15)),
    )


def test_scene_is_the_experiments() -> None:
    scene = shipped("box").scene(GripperDesign.thesis_2013())
    assert (scene.friction, scene.contact, scene.clearance) == (0.6, "sampled", 0.004)
    assert scene.contour == shipped("box").contour


Content = dict[str, Any]


def edited(tmp_path: Path, edit: Callable[[Content], object]) -> Path:
    """Write the shipped box experiment with one thing changed."""
    content = copy.deepcopy(yaml.safe_load(FILES[0].read_text(encoding="utf-8")))
    edit(content)
    path = tmp_path / "edited.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("field", "edit"),
    [
        ("colour", lambda c: c.update(colour="red")),
        ("scene.mass", lambda c: c["scene"].update(mass="1 kg")),
        ("motion[1].speed", lambda c: c["motion"][1].update(speed=1)),
        ("measured.error", lambda c: c["measured"].update(error=1)),
        ("measured.instants[0].phi", lambda c: c["measured"]["instants"][0].update(phi=1)),
        ("measured.max_error.travel", lambda c: c["measured"]["max_error"].update(travel=1)),
        ("published[2].figures", lambda c: c["published"][2].update(figures=1)),
    ],
)
def test_unknown_field_is_named(
    tmp_path: Path, field: str, edit: Callable[[Content], object]
) -> None:
    path = edited(tmp_path, edit)
    with pytest.raises(InputError, match="unknown field") as caught:
        read_experiment(path)
    assert (caught.value.source, caught.value.field) == (str(path), field)


@pytest.mark.parametrize(
    ("field", "reason", "edit"),
    [
        (
            "scene.contour.width",
            "expected a number in m",
            lambda c: c["scene"]["contour"].update(width="28 kg"),
        ),
        (
            "scene.contour.width",
            "must be at least",
            lambda c: c["scene"]["contour"].update(width="-28 mm"),
        ),
        ("scene.clearance", "must be finite", lambda c: c["scene"].update(clearance=math.nan)),
        ("scene.clearance", "must be at least 0", lambda c: c["scene"].update(clearance="-1 mm")),
        ("scene.friction", "pure number", lambda c: c["scene"].update(friction="0.6 N")),
        ("scene.friction", "is missing", lambda c: c["scene"].pop("friction")),
        ("scene.contact", "must be one of", lambda c: c["scene"].update(contact="magnetic")),
        ("scene.contour.name", "letters", lambda c: c["scene"]["contour"].update(name="a/b")),
        ("scene", "expected a mapping", lambda c: c.update(scene=[1])),
        ("motion", "expected a list", lambda c: c.update(motion="down")),
        ("motion[0].velocity", "towards", lambda c: c["motion"][0].update(velocity="-1 mm/s")),
        ("motion[0].duration", "greater than 0", lambda c: c["motion"][0].update(duration=0)),
        ("motion[1]", "above the start", lambda c: c["motion"][1].update(duration="8 s")),
        (
            "measured.instants[0].phi_left.value",
            "must be at most 3.14",
            lambda c: c["measured"]["instants"][0]["phi_left"].update(value=112.1),
        ),
        (
            "measured.instants[0].phi_left.uncertainty",
            "is missing",
            lambda c: c["measured"]["instants"][0]["phi_left"].pop("uncertainty"),
        ),
        (
            "measured.instants[0].time",
            "at most 14",
            lambda c: c["measured"]["instants"][0].update(time="15 s"),
        ),
        ("published[0].time", "is missing", lambda c: c["published"][0].pop("time")),
        ("published[0].figure", "must be one of", lambda c: c["published"][0].update(figure="x")),
        ("published[0].between", "either", lambda c: c["published"][0].update(between=[1, 2])),
        ("published[1].between", "lower", lambda c: c["published"][1].update(between=[2, 1])),
        ("published[1].between", "two ends", lambda c: c["published"][1].update(between=[1])),
        ("published[2].time", "whole approach", lambda c: c["published"][2].update(time="1 s")),
        (
            "published[2].max_error",
            "no meaning for a value of 0",
            lambda c: c["published"][2].update(value=0),
        ),
        ("source", "expected a text", lambda c: c.update(source=5)),
    ],
)
def test_unusable_value_is_named(
    tmp_path: Path, field: str, reason: str, edit: Callable[[Content], object]
) -> None:
    path = edited(tmp_path, edit)
    with pytest.raises(InputError, match=reason) as caught:
        read_experiment(path)
    assert (caught.value.source, caught.value.field) == (str(path), field)


def test_unreadable_files_are_named(tmp_path: Path) -> None:
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\x00")
    broken = tmp_path / "broken.yaml"
    broken.write_text("motion: [", encoding="utf-8")
    for path in (tmp_path / "absent.yaml", tmp_path, binary, broken):
        with pytest.raises(InputError) as caught:
            read_experiment(path)
        assert caught.value.source == str(path)
        assert "\n" not in str(caught.value)


LOGGED = """
title: A cup
source: made up
scene:
  contour: {name: cup, type: circle, radius: 12 mm}
  clearance: 3 mm
  friction: 0.8
  contact: continuous
  design: ours.yaml
log:
  path: logs/cup.mcap
  signals: maps/arm.yaml
  uncertainty: {phi_left: 0.5 deg, actuator_force: 5 mN}
"""


def test_an_experiment_with_a_log_and_a_design_of_its_own(tmp_path: Path) -> None:
    """Paths are relative to the file; nothing has to be measured at instants."""
    design = replace(GripperDesign.thesis_2013(), width=0.005)
    design.to_yaml(tmp_path / "ours.yaml")
    (tmp_path / "maps").mkdir()
    shutil.copy(config_directory() / "signal_maps" / "robot_arm.yaml", tmp_path / "maps/arm.yaml")
    file = tmp_path / "cup.yaml"
    file.write_text(LOGGED)
    experiment = read_experiment(file)
    assert experiment.scene().design.width == 0.005
    assert (experiment.motion, experiment.measurements) == ((), ())
    assert experiment.log is not None
    assert experiment.log.path == tmp_path / "logs" / "cup.mcap"
    assert experiment.log.uncertainties == {
        "phi_left": approx(math.radians(0.5)),
        "actuator_force": approx(0.005),
    }
    signal_map = experiment.log.signal_map
    assert signal_map is not None
    assert "travel" in [signal.name for signal in signal_map.signals]


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        ("path: logs/cup.mcap", "file: logs/cup.mcap", "log.file"),
        ("signals: maps/arm.yaml", "signals: {speed: {}}", "log.signals.speed"),
        ("phi_left: 0.5 deg", "phi_left: 0 deg", "log.uncertainty.phi_left"),
        ("phi_left: 0.5 deg", "speed: 0.5", "log.uncertainty.speed"),
        ("log:", "measured: {}\nlog:", "measured"),
        ("log:\n  path", "motion:\nlog:\n  path", "motion"),
    ],
)
def test_bad_logs_of_experiments_are_named(tmp_path: Path, old: str, new: str, field: str) -> None:
    text = LOGGED.replace("  design: ours.yaml\n", "").replace("  signals: maps/arm.yaml\n", "")
    file = tmp_path / "cup.yaml"
    text = text if old in text else LOGGED.replace("  design: ours.yaml\n", "")
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_experiment(file)
    assert caught.value.field == field
    assert caught.value.source == str(file)


def test_a_name_is_that_of_a_shipped_experiment_unless_there_is_such_a_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert is_experiment("thesis_2013_box")
    assert read_experiment("thesis_2013_box") == shipped("box")
    (tmp_path / "thesis_2013_box").mkdir()
    assert not is_experiment("thesis_2013_box")
    assert not is_experiment(tmp_path / "thesis_2013_cylinder")
