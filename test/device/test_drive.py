"""The drive: what it does with commands, in exact arithmetic of ticks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hma_gripper_sim import (
    Circle,
    GripperDesign,
    InputError,
    Outcome,
    RoundedBox,
    Scene,
    Simulation,
    SimulationError,
)
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.kernels.braking import TRAVEL_RESOLUTION
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.motion.trajectory import Trajectory, WayPoint
from hma_gripper_sim.motion.trapezoid import trapezoid

PERIOD = 0.01
LIMITS = DriveLimits(
    max_velocity=0.05, max_acceleration=0.5, travel_min=0.0, travel_max=0.03, command_timeout=0.5
)
FEW: dict[str, Any] = {"discretisation": "midpoint", "elements_top": 1, "elements_beam": 3}
DESIGN = GripperDesign.thesis_2013()
SCENES = {
    "box": Scene(DESIGN, RoundedBox(0.028, 0.028, 0.002), clearance=0.004, **FEW),
    "cylinder": Scene(DESIGN, Circle(0.015), clearance=0.005, **FEW),
    "far": Scene(DESIGN, Circle(0.015), clearance=0.2, **FEW),
}


def make_drive(contour="far", period=PERIOD, simulation=Simulation, **limits):
    return Drive(
        simulation(SCENES[contour]),
        SCENES,
        contour,
        period=period,
        limits=replace(LIMITS, **limits),
    )


def ticks(drive, count):
    return [drive.tick() for _ in range(count)]


def identical(a, b):
    """Bit for bit, in every field."""
    return all(
        np.array_equal(x, y) for x, y in zip(vars(a).values(), vars(b).values(), strict=True)
    )


def test_a_command_is_reached_by_a_ramp_and_travel_is_its_integral():
    drive = make_drive()
    drive.command(0.018)
    states = ticks(drive, 6)
    velocities = [state.velocity for state in states]
    assert velocities == pytest.approx([0.005, 0.010, 0.015, 0.018, 0.018, 0.018], abs=1e-15)
    before = [0.0, *velocities[:-1]]
    expected = np.cumsum(0.5 * PERIOD * (np.array(before) + velocities))
    assert [state.travel for state in states] == pytest.approx(expected, abs=1e-15)
    assert [state.time for state in states] == pytest.approx(PERIOD * np.arange(1, 7), abs=1e-15)


@given(
    period=st.floats(1e-3, 0.1),
    acceleration=st.floats(0.01, 20.0),
    velocity=st.floats(0.01, 0.05),
    limit=st.floats(1e-4, 0.02),
    up=st.booleans(),
)
@example(period=0.01, acceleration=0.5, velocity=0.05, limit=0.02, up=True)
@settings(max_examples=40, deadline=None)
def test_it_brakes_as_late_as_it_can_and_stops_at_the_travel_limit(
    period, acceleration, velocity, limit, up
):
    sign = 1.0 if up else -1.0
    bounds = {"travel_max": limit} if up else {"travel_min": -limit}
    drive = make_drive(
        period=period, max_acceleration=acceleration, max_velocity=velocity,
        command_timeout=0.0, **bounds,
    )  # fmt: skip
    drive.command(sign * velocity)
    # The fastest motion from rest to rest: v² / 2a to start and to stop, or a triangle.
    peak = min(velocity, math.sqrt(limit * acceleration))
    fastest = limit / peak + peak / acceleration
    # In ticks, each of the two ramps and the cruise may take up to one tick longer.
    states = ticks(drive, math.ceil(fastest / period) + 3)
    assert all(0.0 <= sign * state.travel <= limit for state in states)
    assert states[-1].velocity == 0.0
    assert sign * states[-1].travel == pytest.approx(limit, abs=4 * TRAVEL_RESOLUTION)
    assert drive.status().at_limit


OPERATIONS = st.one_of(
    st.tuples(st.just("command"), st.floats(-0.08, 0.08) | st.sampled_from([math.nan, math.inf])),
    st.tuples(st.just("tick"), st.integers(1, 30)),
    st.tuples(st.just("select"), st.sampled_from([*SCENES, "mug"])),
    st.tuples(st.just("pause"), st.booleans()),
    st.tuples(st.just("reset"), st.none()),
    st.tuples(st.just("max_velocity"), st.floats(-0.01, 0.06)),
    st.tuples(st.just("travel_max"), st.floats(0.0, 0.03)),
    st.tuples(st.just("period"), st.sampled_from([0.002, 0.01, 0.02])),
)


def perform(drive, operation, value):
    """Carry out one operation; return whether it was refused."""
    try:
        if operation == "reset":
            drive.reset()
        elif operation in ("command", "select", "pause"):
            getattr(drive, operation)(value)
        elif operation == "period":
            drive.configure(period=value)
        else:
            drive.configure(limits=replace(drive.limits, **{operation: value}))
    except InputError:
        return True
    return False


def what_it_is(drive):
    """All that a refused request must leave alone."""
    return drive.status(), drive.limits, drive.period, drive.state


@given(st.lists(OPERATIONS, min_size=20, max_size=60))
@settings(max_examples=40, deadline=None)
def test_whatever_is_asked_of_it_the_motion_stays_within_its_limits(operations):
    drive, twin = make_drive("box"), make_drive("box")
    for operation, value in operations:
        if operation != "tick":
            before = what_it_is(drive)
            if perform(drive, operation, value):
                assert what_it_is(drive) == before
            perform(twin, operation, value)
            continue
        for _ in range(value):
            before = drive.state
            after = drive.tick()
            assert identical(after, twin.tick())
            if not drive.running:
                assert after is before
                continue
            limits, period = drive.limits, drive.period
            assert limits.travel_min <= after.travel <= limits.travel_max
            step = 0.5 * period * (before.velocity + after.velocity)
            assert after.travel - before.travel == pytest.approx(step, abs=1e-15)
            change = limits.max_acceleration * period
            assert abs(after.velocity - before.velocity) <= change * (1 + 1e-9)
            # A limit that was lowered in motion is reached by the ramp, not by a jump.
            assert abs(after.velocity) <= max(limits.max_velocity, abs(before.velocity))
            for numbers in (after.joint_position, after.joint_velocity, after.joint_effort):
                assert np.isfinite(numbers).all()
                assert len(numbers) == len(SCENES["box"].joint_names)


@pytest.mark.parametrize(("timeout", "allowed"), [(0.1, 10), (0.3, 30), (0.055, 6)])
def test_a_command_expires_unless_it_is_renewed(timeout, allowed):
    drive = make_drive(command_timeout=timeout)
    for _ in range(3):
        drive.command(0.002)
        assert [state.velocity for state in ticks(drive, allowed)] == [0.002] * allowed
        assert not drive.status().stale
    assert drive.tick().velocity == 0.0  # 0.002 m/s is within one tick's ramp
    status = drive.status()
    assert status.stale
    assert status.timeouts == 1
    ticks(drive, 3 * allowed)
    assert drive.status().timeouts == 1
    drive.command(0.0)
    assert not drive.status().stale
    ticks(drive, 3 * allowed)
    assert drive.status().timeouts == 1  # to stand still needs no renewal


def test_without_a_timeout_a_command_holds():
    drive = make_drive(command_timeout=0.0)
    drive.command(0.001)
    assert ticks(drive, 300)[-1].velocity == 0.001


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_not_finite_changes_nothing(value):
    drive, twin = make_drive(), make_drive()
    for each in (drive, twin):
        each.command(0.01)
        ticks(each, 10)
    with pytest.raises(InputError, match="finite"):
        drive.command(value)
    assert drive.status() == twin.status()
    assert all(identical(drive.tick(), twin.tick()) for _ in range(60))  # nor is it a renewal


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_command_beyond_the_velocity_limit_is_clamped_and_said(sign):
    drive = make_drive(travel_min=-0.03)
    drive.command(sign * 1e300)
    assert ticks(drive, 20)[-1].velocity == sign * 0.05
    assert drive.status().clamped
    drive.command(sign * 0.05)
    assert not drive.status().clamped
    assert drive.status().clamps == 1


def through(*rows, moving_end=False):
    """A trajectory through (time, position, velocity)."""
    names = ("time", "position", "velocity")
    points = [WayPoint(**dict(zip(names, row, strict=False))) for row in rows]
    return Trajectory(points, moving_end=moving_end)


@pytest.mark.parametrize("period", [0.001, 0.01, 0.02])
def test_a_trajectory_is_followed_tick_by_tick(period):
    drive = make_drive(period=period, command_timeout=0.05)
    there, back = 0.02, 0.005
    drive.follow(through((0.8, there, 0.0), (1.4, back, 0.0)))
    states = ticks(drive, round(1.5 / period))
    # Cubics from rest to rest over a distance d in a time t: x = d (3 s² - 2 s³), s = time / t,
    # with a third derivative of 12 d / t³; so far the trapezoids of a tick may be off it.
    for start, end, begin, duration in ((0.0, there, 0.0, 0.8), (there, back, 0.8, 0.6)):
        bound = period**3 * 12 * abs(end - start) / duration**3 / 24
        for state in states:
            s = (state.time - begin) / duration
            # After the knot, where the third derivative jumps, there are two ticks to settle.
            if 2.5 * period / duration < s < 1.0:
                expected = start + (end - start) * (3 * s**2 - 2 * s**3)
                assert state.travel == pytest.approx(expected, abs=1.01 * bound + 1e-12)
    assert states[-1].travel == pytest.approx(back, abs=TRAVEL_RESOLUTION)
    assert states[-1].velocity == 0.0
    assert not drive.status().stale  # it needs no renewal
    assert drive.status().following


def test_a_stream_of_trajectories_that_end_in_motion_is_one_motion():
    drive = make_drive()
    for i in range(50):  # each is replaced halfway
        drive.follow(through((0.2, 0.004 * (0.1 * i + 0.2), 0.004), moving_end=True))
        states = ticks(drive, 10)
        if i > 2:  # what the first ramp has cost is made up
            assert [s.velocity for s in states] == pytest.approx([0.004] * 10, rel=0.02)
    assert states[-1].travel == pytest.approx(0.004 * 5.0, abs=1e-6)
    # Nothing follows: at the end it brakes, which takes a way, and returns.
    after = ticks(drive, 100)
    assert max(s.travel for s in after) > 0.0204 + 1e-6
    assert after[-1].travel == pytest.approx(0.0204, abs=TRAVEL_RESOLUTION)
    assert after[-1].velocity == 0.0


def test_positions_sent_at_every_tick_are_tracked_without_a_ripple():
    drive = make_drive()
    states = []
    for i in range(300):
        drive.go_to(0.004 * PERIOD * (i + 1))
        states += ticks(drive, 1)
    assert [s.velocity for s in states[50:]] == pytest.approx([0.004] * 250, abs=1e-9)
    assert all(
        abs(s.travel - 0.004 * PERIOD * (i + 1)) < 0.004 * PERIOD for i, s in enumerate(states)
    )


def test_a_position_beyond_the_travel_limits_ends_at_them():
    drive = make_drive()
    drive.go_to(1.0)
    assert ticks(drive, 200)[-1].travel == pytest.approx(0.03, abs=TRAVEL_RESOLUTION)
    assert drive.status().at_limit


def test_velocities_alone_are_the_same_motion_as_velocity_commands():
    drive, twin = make_drive("box"), make_drive("box")
    drive.follow(
        through((PERIOD, None, 0.004), (2.0, None, 0.004), (2.0 + PERIOD, None, 0.0)), delay=0.0
    )
    for i in range(220):
        twin.command(0.004 if i < 200 else 0.0)
        expected, state = twin.tick(), drive.tick()
        assert state.travel == pytest.approx(expected.travel, abs=2 * TRAVEL_RESOLUTION)
        # The force follows from travel and velocity; in contact a metre costs some 1e3 N.
        assert state.actuator_force == pytest.approx(expected.actuator_force, abs=1e-7)
    assert expected.actuator_force > 0.1


@given(
    period=st.floats(1e-3, 0.05),
    acceleration=st.floats(0.05, 20.0),
    goal=st.floats(1e-3, 0.025),
)
@settings(max_examples=25, deadline=None)
def test_a_jump_of_the_goal_is_approached_at_the_limits_without_overshoot(
    period, acceleration, goal
):
    drive = make_drive(period=period, max_acceleration=acceleration)
    drive.follow(through((0.0, goal)))
    peak = min(0.05, math.sqrt(goal * acceleration))
    states = ticks(drive, math.ceil((goal / peak + peak / acceleration) / period) + 4)
    assert max(state.travel for state in states) <= goal + 2 * TRAVEL_RESOLUTION
    assert states[-1].travel == pytest.approx(goal, abs=4 * TRAVEL_RESOLUTION)
    assert abs(states[-1].velocity) * period <= 4 * TRAVEL_RESOLUTION


@pytest.mark.parametrize("period", [0.001, 0.01])
def test_a_trajectory_that_ends_at_a_limit_is_not_held_back_by_it(period):
    drive = make_drive(travel_max=0.01, period=period)
    drive.follow(Trajectory(trapezoid(0.0, 0.01, 0.02, 0.5, period)))
    while drive.state.travel < 0.01 - 1e-9:
        drive.tick()
        assert not drive.status().at_limit
    assert ticks(drive, 3)[-1].velocity == 0.0


def test_a_trajectory_beyond_the_limits_is_held_by_them_and_said():
    drive = make_drive(travel_max=0.01)
    drive.follow(through((0.1, 1.0), (0.5, 1e6), (1.0, 0.005, 0.0)))
    states = ticks(drive, 40)
    assert max(state.travel for state in states) == pytest.approx(0.01, abs=1e-11)
    assert max(abs(state.velocity) for state in states) <= 0.05
    assert drive.status().clamped
    assert drive.status().at_limit
    assert ticks(drive, 160)[-1].travel == pytest.approx(0.005, abs=TRAVEL_RESOLUTION)
    assert not drive.status().clamped
    assert drive.status().clamps == 1


def test_a_new_command_replaces_a_trajectory_and_the_other_way_round():
    drive = make_drive()
    drive.follow(through((1.0, 0.02, 0.0)))
    ticks(drive, 30)
    drive.command(-0.001)
    assert ticks(drive, 20)[-1].velocity == -0.001
    drive.follow(through((0.5, 0.001, 0.0)))
    drive.follow(through((0.5, 0.012, 0.0)))
    assert ticks(drive, 60)[-1].travel == pytest.approx(0.012, abs=1e-11)
    drive.reset()
    assert drive.tick().velocity == 0.0
    assert not drive.status().following


def test_a_step_moves_time_although_paused():
    drive, twin = make_drive("box"), make_drive("box")
    for each in (drive, twin):
        each.command(0.02)
    drive.pause(True)
    for _ in range(40):
        assert drive.tick() is drive.state
        assert identical(drive.step(), twin.tick())
    assert drive.status().paused


def test_a_pause_stops_time_and_loses_nothing():
    drive, twin = make_drive("box"), make_drive("box")
    for each in (drive, twin):
        each.command(0.02)
        ticks(each, 30)
    drive.pause(True)
    held = drive.state
    assert all(state is held for state in ticks(drive, 100))
    drive.pause(False)
    assert all(identical(drive.tick(), twin.tick()) for _ in range(30))
    assert drive.status() == twin.status()


def test_a_reset_is_a_new_beginning():
    drive, fresh = (make_drive("box", command_timeout=0.0) for _ in range(2))
    drive.command(0.02)
    ticks(drive, 60)
    assert drive.state.actuator_force > 0.1  # in contact
    drive.reset()
    assert identical(drive.state, fresh.state)
    assert drive.tick().velocity == 0.0  # the command is forgotten
    drive.reset()
    for each in (drive, fresh):
        each.command(0.02)
    assert all(identical(drive.tick(), fresh.tick()) for _ in range(60))


def test_a_reset_does_not_end_a_pause():
    drive = make_drive()
    drive.pause(True)
    drive.reset()
    assert drive.status().paused


@pytest.mark.parametrize(
    ("name", "reason"),
    [("mug", r"unknown contour 'mug' \(known: box, cylinder, far\)"), ("box", "overlap")],
)
def test_an_object_that_cannot_be_put_in_place_changes_nothing(name, reason):
    drive, twin = make_drive("far"), make_drive("far")
    for each in (drive, twin):
        each.command(0.05)
        ticks(each, 40)
    with pytest.raises(InputError, match=reason):
        drive.select(name)
    assert drive.status() == twin.status()
    assert all(identical(drive.tick(), twin.tick()) for _ in range(10))


def test_a_selected_object_stands_where_it_would_have_stood_from_the_start():
    drive, direct = make_drive("far"), make_drive("cylinder")
    drive.command(0.004)
    ticks(drive, 10)
    drive.reset()
    drive.select("cylinder")
    assert drive.status().contour == "cylinder"
    for each in (drive, direct):
        each.command(0.05)
        ticks(each, 20)
    assert direct.state.actuator_force > 0.0
    assert drive.state.actuator_force == pytest.approx(direct.state.actuator_force, rel=1e-9)


class Failing(Simulation):
    """Cannot go on from its third step, in one way or the other."""

    not_finite = False

    def step(self, duration, velocity):
        if self.time > 2.5 * PERIOD and not self.not_finite:
            raise SimulationError(Outcome.STEP_TOO_SMALL, self.time)
        super().step(duration, velocity)

    def state(self):
        state = super().state()
        broken = self.time > 2.5 * PERIOD and self.not_finite
        return replace(state, actuator_force=math.nan) if broken else state


class Diverging(Failing):
    not_finite = True


@pytest.mark.parametrize(
    ("simulation", "reason"), [(Failing, Outcome.STEP_TOO_SMALL.remedy), (Diverging, "not finite")]
)
def test_a_failed_step_halts_it_with_the_last_good_state(simulation, reason):
    drive = make_drive(simulation=simulation)
    drive.command(0.01)
    states = ticks(drive, 10)
    good = states[2] if simulation is Failing else states[1]
    assert all(state is good for state in states[3:])
    assert math.isfinite(good.actuator_force)
    assert reason in drive.status().failure
    assert not drive.running
    drive.pause(False)  # tries again, and fails again
    assert drive.tick() is good
    assert drive.status().failure
    drive.reset()
    assert drive.status().failure is None
    assert drive.tick().time == pytest.approx(PERIOD)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("max_velocity", 0.0),
        ("max_velocity", math.nan),
        ("max_acceleration", -1.0),
        ("travel_min", 0.001),
        ("travel_max", -0.001),
        ("travel_max", 0.0),  # with travel_min 0: no travel at all
        ("travel_max", math.inf),
        ("command_timeout", -0.1),
        ("command_timeout", "1 m"),
    ],
)
def test_limits_that_make_no_sense_are_refused_by_name(field, value):
    with pytest.raises(InputError) as caught:
        replace(LIMITS, **{field: value})
    assert caught.value.field == field


def test_limits_that_the_present_motion_cannot_keep_are_refused_as_a_whole():
    drive = make_drive("far")
    drive.command(0.05)
    ticks(drive, 30)  # 12.75 mm down, and 2.5 mm from standing still at best
    before = what_it_is(drive)
    for changes in (
        {"limits": replace(LIMITS, travel_max=0.015)},
        {"limits": replace(LIMITS, max_acceleration=0.05)},
        {"contour": "cylinder", "limits": replace(LIMITS, travel_max=0.015)},
        {"contour": "cylinder", "limits": replace(LIMITS, travel_max=0.02)},
        {"contour": "mug", "period": 0.02},
    ):
        with pytest.raises(InputError):
            drive.configure(**changes)
        assert what_it_is(drive) == before
    drive.configure(limits=replace(LIMITS, travel_max=0.016))
    assert ticks(drive, 100)[-1].travel == pytest.approx(0.016, abs=1e-11)


def test_validity_of_the_present_state():
    """Nothing in the air, nor pressed as designed; into a soft contact the tips sink."""
    found = []
    for stiffness in (1e4, 200.0):
        scene = replace(SCENES["cylinder"], normal_stiffness=stiffness)
        limits = replace(LIMITS, command_timeout=0.0)
        drive = Drive(Simulation(scene), {"it": scene}, "it", period=PERIOD, limits=limits)
        assert drive.validity() == ()
        drive.command(0.01)
        found.append([f.name for _ in range(100) if drive.tick() for f in drive.validity()])
    assert found[0] == []
    assert set(found[1]) == {"penetration"}


def test_validity_names_what_would_touch_though_it_is_not_modelled():
    """A tall box meets the side beams at 28 mm of travel and more."""
    tall = replace(SCENES["box"], contour=RoundedBox(0.028, 0.12, 0.002))
    drive = Drive(
        Simulation(tall),
        {"tall": tall},
        "tall",
        period=PERIOD,
        limits=replace(LIMITS, travel_max=0.06),
    )
    drive.command(0.05)
    ticks(drive, 20)
    assert drive.validity() == ()
    for _ in range(4):
        drive.command(0.05)
        ticks(drive, 25)
    found = drive.validity()
    assert {f.name for f in found} == {"unmodelled_contact"}
    assert all(f.time == drive.state.time for f in found)
