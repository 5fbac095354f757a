"""What a calibration may leave free."""

from __future__ import annotations

import pytest

from hma_gripper_sim import Circle, GripperDesign, InputError, Scene
from hma_gripper_sim.calibration.free_parameters import PARAMETERS, free_parameters

SCENE = Scene(GripperDesign.thesis_2013(), Circle(0.015), friction=0.6, clearance=0.005)


@pytest.mark.parametrize("name", [n for n, p in PARAMETERS.items() if p.owner != "log"])
def test_each_can_be_read_and_put(name: str) -> None:
    """Nothing else of the scene changes: putting the old value back gives it again."""
    parameter = PARAMETERS[name]
    old = parameter.of(SCENE)
    changed = parameter.put(SCENE, old * 1.01 + 1e-4)
    assert parameter.of(changed) == pytest.approx(old * 1.01 + 1e-4)
    assert changed != SCENE
    assert parameter.put(changed, old) == SCENE


@pytest.mark.parametrize("name", ["force_delay", "angle_delay", "force_bias", "angle_bias"])
def test_how_the_log_came_about_is_no_part_of_the_scene(name: str) -> None:
    (free,) = free_parameters(name, SCENE)
    assert free.parameter.put(SCENE, 0.1) == SCENE
    assert (free.start, free.value(1.0), free.x(0.0)) == (0.0, 0.0, 1.0)
    assert free.x(free.value(1.7)) == pytest.approx(1.7)


def test_symbols_units_and_bounds() -> None:
    """E stands for Young's modulus; bounds carry units, or are SI."""
    mu, E, clearance = free_parameters(
        "mu, E,clearance", SCENE, ["E=5 MPa..12 MPa", "friction=0.2..1.5"]
    )
    assert (mu.parameter.name, mu.start, mu.lower, mu.upper) == ("friction", 0.6, 0.2, 1.5)
    assert (E.start, E.lower, E.upper) == pytest.approx((8.9e6, 5e6, 12e6))
    assert clearance.lower == 0.0
    assert clearance.upper == pytest.approx(0.010)


@pytest.mark.parametrize(
    ("names", "bounds", "said"),
    [
        ("speed", (), "unknown parameter 'speed'"),
        ("", (), "unknown parameter ''"),
        ("friction,mu", (), "friction is named twice"),
        ("friction", ("E=1e6..2e7",), "--bound youngs_modulus: is not free"),
        ("friction", ("friction=0.7..1.5",), "the start, 0.6 , is not between"),
        ("friction", ("friction=2..1",), "the first end must be the lower one"),
        ("friction", ("friction=-1..1",), "at least 0"),
        ("friction", ("friction",), "NAME=LOW..HIGH"),
        ("E", ("E=5 mm..1e7",), "expected a number in Pa"),
    ],
)
def test_bad_requests_are_refused(names: str, bounds: tuple[str, ...], said: str) -> None:
    with pytest.raises(InputError) as caught:
        free_parameters(names, SCENE, bounds)
    assert said in str(caught.value)
