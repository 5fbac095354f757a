"""Recorded results: their samples, units and consistency, and the warnings that go with them."""

from __future__ import annotations

import dataclasses
import math
import warnings

import numpy as np
import pytest

from hma_gripper_sim import (
    Circle,
    GripperDesign,
    InputError,
    RoundedBox,
    Scene,
    Simulation,
    Trace,
    UnmodelledContactWarning,
    simulate,
)


@pytest.fixture(scope="module")
def trace() -> Trace:
    """The cylinder off the axis, pressed, held and released, finely solved."""
    scene = Scene(GripperDesign.thesis_2013(), Circle(0.015), offset=0.002, clearance=0.001)
    return simulate(
        scene, lambda t: 0.004 * math.cos(0.7 * t), 4.0, tolerance=1e-5, sample_period=0.002
    )


def test_shapes(trace: Trace) -> None:
    """One row per sample, one column per joint in the order of the names."""
    assert trace.time.shape == (2001,)
    for name in ("travel", "velocity", "actuator_force", "phi_left", "phi_right"):
        values = getattr(trace, name)
        assert values.shape == (2001,)
        assert values.dtype == np.float64
    for name in ("joint_position", "joint_velocity", "joint_effort"):
        values = getattr(trace, name)
        assert values.shape == (2001, 63)
        assert np.isfinite(values).all()
    assert len(trace.joint_names) == 63
    np.testing.assert_allclose(trace.time, 0.002 * np.arange(2001), rtol=1e-14)


def test_slide(trace: Trace) -> None:
    """The prismatic joint's column is travel, velocity and actuator force."""
    assert trace.joint_names[0] == "slide"
    np.testing.assert_array_equal(trace.joint_position[:, 0], trace.travel)
    np.testing.assert_array_equal(trace.joint_velocity[:, 0], trace.velocity)
    np.testing.assert_array_equal(trace.joint_effort[:, 0], trace.actuator_force)


def test_motion_is_the_commanded_one(trace: Trace) -> None:
    """Velocity as commanded to 1e-4 of its maximum, travel its integral."""
    np.testing.assert_allclose(trace.velocity, 0.004 * np.cos(0.7 * trace.time), atol=1e-6)
    np.testing.assert_allclose(trace.travel, 0.004 / 0.7 * np.sin(0.7 * trace.time), atol=2e-6)


def test_effort_is_the_spring_damper_moment(trace: Trace, design: GripperDesign) -> None:
    """-(k q + b q'): k = 0.15822 in the top beam, 0.19318 N m/rad elsewhere, b = 0.01 N m s/rad."""
    stiffness = np.array(
        [
            design.bending_stiffness / (2.1e-3 if name.startswith("top") else 1.72e-3)
            for name in trace.joint_names[1:]
        ]
    )
    wanted = -(stiffness * trace.joint_position[:, 1:] + 0.01 * trace.joint_velocity[:, 1:])
    np.testing.assert_allclose(trace.joint_effort[:, 1:], wanted, rtol=1e-12, atol=1e-16)


def test_velocity_is_the_derivative_of_position(trace: Trace) -> None:
    """Central differences over 4 ms in the smooth part of the motion.

    Away from the touches (where rates jump within a step) to 2 % of the largest rate.
    """
    positions, rates = trace.joint_position[:, 1:], trace.joint_velocity[:, 1:]
    differences = (positions[2:] - positions[:-2]) / 0.004
    error = np.abs(differences - rates[1:-1]).max(axis=1)
    assert np.median(error) < 1e-3 * np.abs(rates).max()
    assert np.quantile(error, 0.99) < 2e-2 * np.abs(rates).max()


def test_phi_from_the_joints(trace: Trace) -> None:
    """phi = 97 degrees + all relative angles up to the middle GBE, counter-clockwise positive.

    On the left the drawing is mirrored: there angles count negative.
    """
    column = {name: i for i, name in enumerate(trace.joint_names)}
    for side, sign in (("right", 1.0), ("left", -1.0)):
        names = [f"top_{side}_{i}" for i in range(1, 6)]
        names += [f"beam_{side}_{i}" for i in range(1, 14)]
        angle = trace.joint_position[:, [column[name] for name in names]].sum(axis=1)
        wanted = math.radians(97.0) + sign * angle
        np.testing.assert_allclose(trace.phi(side), wanted, atol=1e-9)
    np.testing.assert_array_equal(trace.phi("right"), trace.phi_right)
    np.testing.assert_array_equal(trace.phi("left"), trace.phi_left)


def test_chord_of_phi(trace: Trace) -> None:
    """The chord from the corner joint to the tip joint, from the joints by hand."""
    column = {name: i for i, name in enumerate(trace.joint_names)}
    top = trace.joint_position[:, [column[f"top_right_{i}"] for i in range(1, 6)]].sum(axis=1)
    beam = trace.joint_position[:, [column[f"beam_right_{i}"] for i in range(1, 26)]]
    angle = math.radians(-83.0) + top[:, None] + np.cumsum(beam, axis=1)
    chord = np.angle(np.exp(1j * angle).sum(axis=1))
    np.testing.assert_allclose(trace.phi("right", "chord"), math.pi + chord, atol=1e-9)
    # Chord and tangent at mid-length of an evenly bent beam are the same.
    assert np.abs(trace.phi("right", "chord") - trace.phi_right).max() < math.radians(3.0)


def test_phi_refuses_what_it_does_not_know(trace: Trace) -> None:
    """Sides and definitions by name."""
    with pytest.raises(InputError, match="side"):
        trace.phi("up")
    with pytest.raises(InputError, match="definition"):
        trace.phi("left", "secant")


def test_largest_moment_and_stress(trace: Trace, design: GripperDesign) -> None:
    """M max over all joints and samples; sigma = M z / I; relative to 1.2 MPa."""
    moment = np.abs(trace.joint_effort[:, 1:]).max()
    assert trace.max_bending_moment == pytest.approx(moment, rel=1e-3)
    assert trace.max_stress == pytest.approx(trace.max_bending_moment * 2e-3 / 3.7333e-11, rel=1e-4)
    assert trace.stress_ratio == pytest.approx(trace.max_stress / 1.2e6, rel=1e-12)


@pytest.mark.parametrize("offset", [0.0, 0.002])
@pytest.mark.parametrize("friction", [0.0, 0.6, 1.3])
def test_energy_balance(design: GripperDesign, friction: float, offset: float) -> None:
    """Work of actuator and gravity = energy stored + lost, to 1 % of the largest term.

    The actuator's work is also the integral of F_act over the travel, less the weight's: here
    by the trapezoidal rule over the samples.
    """
    scene = Scene(design, Circle(0.015), friction=friction, offset=offset, clearance=0.001)
    trace = simulate(scene, 0.004, 4.0, tolerance=1e-5)
    balance = trace.energy
    assert balance.relative_residual < 1e-2
    work = float(np.trapezoid(trace.actuator_force, trace.travel))
    assert balance.actuator == pytest.approx(work, rel=1e-2)
    assert balance.joints > 0.0
    assert balance.elastic > 0.0
    if friction == 0.0:
        assert balance.friction == pytest.approx(0.0, abs=1e-12)
    else:
        assert balance.friction > 0.0


def test_last_sample_is_the_end(design: GripperDesign) -> None:
    """Durations that are no multiple of the period end before it; rounding loses no sample."""
    scene = Scene(design, Circle(0.015))
    assert len(simulate(scene, 0.004, 0.3, sample_period=0.1).time) == 4
    assert len(simulate(scene, 0.004, 0.7, sample_period=0.1).time) == 8
    assert len(simulate(scene, 0.004, 0.75, sample_period=0.1).time) == 8
    assert len(simulate(scene, 0.004, 0.05, sample_period=0.1).time) == 1


def test_failed_run_says_so(design: GripperDesign) -> None:
    """Statistics of a good run; `converged` is nothing but the outcome."""
    stats = simulate(Scene(design, Circle(0.015)), 0.004, 2.0).stats
    assert stats.converged
    assert stats.steps > 10
    assert stats.newton_iterations >= stats.steps
    assert stats.wall_time > 0.0
    from hma_gripper_sim import Outcome

    assert not dataclasses.replace(stats, outcome=Outcome.STEP_TOO_SMALL).converged


# --- parts that the contact model leaves out -------------------------------------------------


def box_gap(scene: Scene, place: tuple[float, float]) -> float:
    """Distance of a point to a rounded box, by hand [m]."""
    box = scene.contour
    assert isinstance(box, RoundedBox)
    x, z = scene.object_position
    dx = max(0.0, abs(place[0] - x) - (box.width / 2 - box.corner_radius))
    dz = max(0.0, abs(place[1] - z) - (box.height / 2 - box.corner_radius))
    return math.hypot(dx, dz) - box.corner_radius


@pytest.mark.parametrize("symmetry", [None, False])
def test_long_travel_over_a_tall_box(design: GripperDesign, symmetry: bool | None) -> None:
    """A box 12 cm high: first the side beams meet its corners, then the top beam its top.

    Named with part, side, time and place, as Python warnings and in the trace, in the order of
    time, on both sides.  Each place is on the axis of its part: half its width of 4 mm off the
    box, to what a part moves within one step (0.1 mm).  The top beam's underside is 2 mm below
    its axis: that meets the top of the box where the travel says, give or take its bending.
    """
    box = RoundedBox(0.028, 0.12, 0.002)
    scene = Scene(design, box, clearance=0.004, symmetry=symmetry)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        trace = simulate(scene, 0.004, 20.0)
    touches = trace.warnings
    assert [w.message for w in caught] == list(touches)
    assert all(isinstance(touch, UnmodelledContactWarning) for touch in touches)
    found = {(touch.part, touch.side): touch for touch in touches}
    assert {
        ("side beam", "right"),
        ("side beam", "left"),
        ("top beam", "right"),
        ("top beam", "left"),
    } <= set(found)
    times = [touch.time for touch in touches]
    assert times == sorted(times)
    for (part, side), touch in found.items():
        if part in ("side beam", "top beam"):
            assert box_gap(scene, touch.place) == pytest.approx(2e-3, abs=1e-4)
            assert (touch.place[0] > 0.0) == (side == "right")
    assert found["side beam", "right"].time < found["top beam", "right"].time
    drop = -(scene.object_position[1] + 0.06 + 0.002)
    assert found["top beam", "right"].time * 0.004 == pytest.approx(drop, abs=1e-3)
    text = str(found["side beam", "left"])
    assert text.startswith("the left side beam would touch the object at t = ")
    assert "mm" in text


def test_a_box_below_one_beam_only(design: GripperDesign) -> None:
    """Far off the axis only one side is in the way."""
    scene = Scene(design, RoundedBox(0.02, 0.12, 0.002), offset=0.012, clearance=0.004)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        trace = simulate(scene, 0.004, 16.0)
    assert {touch.side for touch in trace.warnings if touch.part == "side beam"} <= {"right"}
    assert trace.warnings


def test_reference_scenes_do_not_warn(
    design: GripperDesign, cylinder: Circle, box: RoundedBox
) -> None:
    """Within their 28 mm of travel only the tips touch, on the axis and a little off it."""
    for contour in (cylinder, box):
        for contact in ("continuous", "sampled"):
            for offset in (0.0, 0.003):
                scene = Scene(design, contour, contact=contact, clearance=0.004, offset=offset)
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    assert simulate(scene, 0.004, 7.0).warnings == ()


def test_steps_do_not_warn_but_the_run_goes_on(design: GripperDesign) -> None:
    """A run with such a touch still converges: the warning says what not to trust."""
    scene = Scene(design, RoundedBox(0.028, 0.12, 0.002), clearance=0.004)
    simulation = Simulation(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        trace = simulation.advance(12.0, 0.004)
    assert trace.stats.converged
    assert trace.warnings
    assert simulation.travel == pytest.approx(0.048)
