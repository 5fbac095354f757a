"""What can be set on the node, and what is refused."""

from __future__ import annotations

import math

import pytest

from hma_gripper_sim import Circle, InputError, Polygon, RoundedBox, config_directory
from hma_gripper_sim.device.setting_definitions import CONTOUR_FIELDS, FIELDS
from hma_gripper_sim.device.settings import DEFAULT_CONTOURS, Settings
from hma_gripper_sim.yaml_reading import read_yaml

MUG = {"contours.mug.type": "circle", "contours.mug.radius": 0.02, "contour": "mug"}


def flattened(mapping, prefix=""):
    """Names joined by dots, as ROS flattens a parameter file."""
    flat: dict[str, object] = {}
    for key, value in mapping.items():
        if isinstance(value, dict):
            flat |= flattened(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = value
    return flat


def test_the_defaults_are_the_scenes_of_the_thesis():
    scenes = Settings.parse({}).scenes
    assert set(scenes) == {"box", "cylinder", "wedge"}
    assert scenes["box"].contour == RoundedBox(0.028, 0.028, 0.002)
    assert scenes["box"].clearance == 0.004
    assert scenes["cylinder"].contour == Circle(0.015)
    assert scenes["cylinder"].clearance == 0.005
    assert all(scene.friction == 0.6 for scene in scenes.values())
    assert all(len(scene.joint_names) == 63 for scene in scenes.values())


def test_the_shipped_file_states_every_default():
    shipped = flattened(read_yaml(config_directory() / "sim_node.yaml")["/**"]["ros__parameters"])
    contours = {name: value for name, value in shipped.items() if name.startswith("contours.")}
    assert {name: shipped[name] for name in shipped if name not in contours} == {
        name: field.default for name, field in FIELDS.items()
    }
    assert contours == DEFAULT_CONTOURS
    assert isinstance(Settings.parse(shipped).scenes["wedge"].contour, Polygon)


def test_every_default_is_in_its_own_range():
    for name, field in FIELDS.items():
        assert field.read(field.default, name) == field.default
        assert field.description.endswith(".")
    assert all(field.description.endswith(".") for field in CONTOUR_FIELDS.values())


def test_whole_numbers_and_texts_with_units_become_si_floats():
    settings = Settings.parse({"max_velocity": 1, "travel_max": "25 mm", "publish_rate": 50})
    assert settings.limits.max_velocity == 1.0
    assert isinstance(settings.values["max_velocity"], float)
    assert settings.values["travel_max"] == pytest.approx(0.025)
    assert settings.period_ns == 20_000_000
    assert settings.period == 0.02


@pytest.mark.parametrize("prefix", ["2_", "a b", "left/", "<"])
def test_a_prefix_that_no_name_can_begin_with_is_refused(prefix):
    assert Settings.parse({"prefix": "left_"}).prefix == "left_"
    with pytest.raises(InputError, match="prefix: must be of letters, digits and _"):
        Settings.parse({"prefix": prefix})


def test_a_period_is_a_whole_number_of_nanoseconds():
    settings = Settings.parse({"publish_rate": 60.0})
    assert settings.period_ns == 16_666_667
    assert settings.period == 0.016666667


def test_given_contours_replace_the_default_ones():
    settings = Settings.parse(
        {
            **MUG,
            "contours.roof.type": "polygon",
            "contours.roof.points": [-0.01, 0.0, 0.01, 0.0, 0.0, 0.01],
            "contours.roof.offset": 0.001,
        }
    )
    assert set(settings.scenes) == {"mug", "roof"}
    assert settings.scenes["mug"].contour == Circle(0.02)
    assert settings.scenes["roof"].contour == Polygon([(-0.01, 0.0), (0.01, 0.0), (0.0, 0.01)])
    assert settings.scenes["roof"].offset == 0.001


@pytest.mark.parametrize(
    ("given", "field", "reason"),
    [
        ({"max_velocity": math.nan}, "max_velocity", "must be finite"),
        ({"max_velocity": 0.0}, "max_velocity", "at least 1e-06"),
        ({"max_velocity": 2.0}, "max_velocity", "at most 1"),
        ({"max_velocity": True}, "max_velocity", "expected a number"),
        ({"max_velocity": "fast"}, "max_velocity", "expected a number"),
        ({"travel_max": "1 kg"}, "travel_max", "expected a number in m"),
        ({"travel_min": 0.01}, "travel_min", "at most 0"),
        ({"travel_max": 0.0}, "travel_max", "greater than travel_min"),
        ({"publish_rate": 0.5}, "publish_rate", "at least 1"),
        ({"real_time_factor": -1.0}, "real_time_factor", "at least 0"),
        ({"elements_top": 2.5}, "elements_top", "whole number"),
        ({"elements_beam": -1}, "elements_beam", "at least 0"),
        ({"contact": "magic"}, "contact", "one of 'continuous', 'sampled'"),
        ({"design": 5}, "design", "expected a text"),
        ({"design": "/does/not/exist.yaml"}, None, "cannot be read"),
        ({"contour": "mug"}, "contour", "known: box, cylinder"),
        ({"max_velocty": 1.0}, "max_velocty", "did you mean 'max_velocity'?"),
        ({"contours.mug.radius": 0.02}, "contours.mug.type", "one of"),
        ({**MUG, "contours.mug.radius": -0.02}, "contours.mug.radius", "at least"),
        ({**MUG, "contours.mug.width": 0.02}, "contours.mug.width", "unknown field"),
        ({**MUG, "contours.mug.radios": 0.02}, "contours.mug.radios", "did you mean 'radius'?"),
        ({**MUG, "contours.mug.clearance": -1.0}, "contours.mug.clearance", "at least 0"),
        ({**MUG, "contours.mug": 1.0}, "contours.mug", "expected contours.NAME.FIELD"),
        ({**MUG, "contours.my mug.type": "box"}, "contours.my mug.type", "expected contours.NAME"),
        (
            {**MUG, "contours.a.type": "polygon", "contours.a.points": [0.0, 0.0, 0.01, 0.0, 0.0]},
            "contours.a.points",
            "even count",
        ),
        (
            {**MUG, "contours.a.type": "polygon", "contours.a.points": [0.0, math.inf]},
            "contours.a.points[1]",
            "finite",
        ),
        (
            # a bow tie
            {
                **MUG,
                "contours.a.type": "polygon",
                "contours.a.points": [0.0, 0.0, 0.01, 0.01, 0.01, 0.0, 0.0, 0.01],
            },
            "contours.a.points",
            "",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_by_name(given, field, reason):
    with pytest.raises(InputError) as caught:
        Settings.parse(given)
    assert caught.value.field == field
    assert reason in caught.value.reason


def test_a_change_is_validated_like_the_whole():
    settings = Settings.parse({})
    for changes in ({"travel_max": 0.0}, {"contour": "mug"}, {"friction": math.nan}):
        with pytest.raises(InputError):
            settings.changed(changes)
    changed = settings.changed({"friction": 0.9, "travel_max": 0.02})
    assert changed.scenes["box"].friction == 0.9
    assert changed.limits.travel_max == 0.02
    assert settings.limits.travel_max == 0.03


def test_a_change_that_concerns_no_scene_keeps_the_scenes():
    settings = Settings.parse({})
    changed = settings.changed({"contour": "cylinder", "publish_rate": 500.0})
    assert changed.scenes is settings.scenes
    assert changed.contour == "cylinder"
    assert changed.period == 0.002
