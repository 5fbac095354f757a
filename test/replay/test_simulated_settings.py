"""What a replay simulates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from hma_gripper_sim import Circle, InputError, Polygon, RoundedBox
from hma_gripper_sim.bags.log_metadata import logged_parameters
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.experiments.node_parameters import node_parameters
from hma_gripper_sim.replay.simulated_settings import (
    SimulatedSettings,
    assignment,
    contour_parameters,
    flat,
)


def test_the_nodes_catalogue_is_there() -> None:
    """Objects of the shipped config/sim_node.yaml, by name."""
    assert isinstance(SimulatedSettings.parse({"contour": "box"}).scene.contour, RoundedBox)
    assert isinstance(SimulatedSettings.parse({"contour": "wedge"}).scene.contour, Polygon)
    with pytest.raises(InputError, match=r"unknown contour 'cup' \(known: .*wedge"):
        SimulatedSettings.parse({"contour": "cup"})


def test_parameters_reach_the_scene_in_si_units() -> None:
    parameters = SimulatedSettings.parse(
        {
            "contour": "cylinder",
            "friction": 0.8,
            "clearance": "4.5 mm",
            "offset": "1 mm",
            "gravity": 1.62,
            "accuracy": 0.01,
            "publish_rate": 250,
            "max_velocity": "20 mm/s",
        }
    )
    scene = parameters.scene
    assert (scene.friction, scene.clearance, scene.offset) == pytest.approx((0.8, 0.0045, 0.001))
    assert (scene.gravity, scene.accuracy) == (1.62, 0.01)
    assert parameters.period_ns == 4_000_000
    assert parameters.limits.max_velocity == 0.02
    # What the log will hold gives the same again.
    assert SimulatedSettings.parse(parameters.given) == parameters


def test_an_experiment_is_the_scene_that_it_describes() -> None:
    experiment = read_experiment("thesis_2013_cylinder")
    scene = SimulatedSettings.parse(flat(node_parameters([experiment]))).scene
    assert scene == replace(experiment.scene(), discretisation="thesis")


def test_a_contour_can_be_a_file(tmp_path: Path) -> None:
    file = tmp_path / "cup.yaml"
    file.write_text("{type: circle, radius: 12 mm, clearance: 3 mm}")
    parameters = SimulatedSettings.parse(contour_parameters(str(file)))
    assert parameters.contour == "cup"
    assert parameters.scene.contour == Circle(0.012)
    assert parameters.scene.clearance == 0.003
    file = tmp_path / "box.yaml"  # also where the catalogue has one of this name
    file.write_text("{type: polygon, points: [[-8 mm, 0], [8 mm, 0], [0, 9 mm]], rounding: 2 mm}")
    contour = SimulatedSettings.parse(contour_parameters(str(file))).scene.contour
    assert isinstance(contour, Polygon)
    assert len(contour.core) == 3


@pytest.mark.parametrize(
    ("given", "field"),
    [
        ({"friction": -1}, "friction"),
        ({"frction": 0.5}, "frction"),
        ({"clearance": "fast"}, "contours.box.clearance"),
        ({"gravity": "nan"}, "gravity"),
        ({"real_time_factor": 2.0}, "real_time_factor"),
        ({"design": "nowhere.yaml"}, None),
    ],
)
def test_bad_parameters_are_named(given: dict[str, object], field: str | None) -> None:
    with pytest.raises(InputError) as caught:
        SimulatedSettings.parse(given)
    assert field is None or caught.value.field == field


def test_assignments_are_numbers_texts_and_quantities() -> None:
    assert assignment("normal_stiffness=1e4") == {"normal_stiffness": 1e4}
    assert assignment("elements_top = 2") == {"elements_top": 2}
    assert assignment("clearance=4 mm") == {"clearance": "4 mm"}
    assert assignment("contact=sampled") == {"contact": "sampled"}
    for text in ("friction", "=2", "friction=", "friction=[1"):
        with pytest.raises(InputError):
            assignment(text)


def test_logs_of_others_say_nothing_about_the_scene(tmp_path: Path) -> None:
    assert logged_parameters(tmp_path / "nowhere") == {}
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {custom_data: null}")
    assert logged_parameters(tmp_path) == {}
    (tmp_path / "metadata.yaml").write_text(
        "rosbag2_bagfile_information: {custom_data: {hma_gripper_sim.parameters: '[1'}}"
    )
    with pytest.raises(InputError, match=r"hma_gripper_sim\.parameters: is no JSON mapping"):
        logged_parameters(tmp_path)
