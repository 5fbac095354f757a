"""What a log or an experiment makes the gripper do."""

from __future__ import annotations

import re

import numpy as np
import pytest

from hma_gripper_sim import InputError
from hma_gripper_sim.experiments.experiment import Segment
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.motion.prescribed_motion import evaluate
from hma_gripper_sim.recordings.recording import Recording, Series
from hma_gripper_sim.replay.course import commanded, measured, planned

PERIOD = 0.01
START = 1_700_000_000_000_000_000
LIMITS = DriveLimits(
    max_velocity=0.05, max_acceleration=0.5, travel_min=0.0, travel_max=0.03, command_timeout=0.5
)


def recording(travel: Series | None = None, commands: Series | None = None) -> Recording:
    signals = {"travel": travel, "velocity_command": commands}
    return Recording("a log", {n: s for n, s in signals.items() if s is not None}, START)


def still(duration: float, travel: float = 0.0) -> Series:
    time = np.arange(0.0, duration + 1e-9, PERIOD)
    return Series(time, np.full(len(time), travel))


def velocity_at(course, time: float) -> float:
    return float(evaluate(course.motion, np.array(time))[1])


@pytest.mark.parametrize(
    ("logged", "ends"),
    [(0.0, 0.01), (0.004, 0.01), (0.01, 0.02), (0.0199, 0.02), (0.02, 0.03)],
    ids=lambda value: f"{value:g}",
)
def test_a_command_is_taken_by_the_tick_in_whose_time_it_was_logged(
    logged: float, ends: float
) -> None:
    """That tick ends at the commanded velocity: 5 mm/s are the most that one tick adds."""
    course = commanded(
        recording(still(0.1), Series(np.array([logged]), np.array([0.004]))), LIMITS, PERIOD
    )
    assert velocity_at(course, ends - PERIOD) == 0.0
    assert velocity_at(course, ends) == pytest.approx(0.004)


def test_the_last_of_several_commands_in_a_tick_counts() -> None:
    commands = Series(np.array([0.012, 0.018]), np.array([0.004, 0.001]))
    course = commanded(recording(still(0.1), commands), LIMITS, PERIOD)
    assert velocity_at(course, 0.02) == pytest.approx(0.001)


def test_commands_expire_as_in_the_node() -> None:
    commands = Series(np.array([0.0]), np.array([0.004]))
    course = commanded(recording(still(2.0), commands), LIMITS, PERIOD)
    # 50 ticks under the command, half a tick of ramp at either end.
    assert course.motion.travel[-1] == pytest.approx(0.004 * 0.5, rel=1e-9)


def test_a_log_that_starts_below_the_drives_range_widens_it_and_says_so() -> None:
    commands = Series(np.array([0.0]), np.array([0.001]))
    course = commanded(recording(still(0.1, -0.002), commands), LIMITS, PERIOD)
    assert course.travel == -0.002
    assert "-2 mm" in course.notes[0]


def test_measured_travel_is_followed_within_the_tolerance() -> None:
    time = np.linspace(0.0, 10.0, 10_001)
    value = 0.01 * np.sin(time) ** 2
    course = measured(recording(Series(time + 3.0, value)), 1e-5)
    assert course.start == START + 3_000_000_000
    motion = course.motion
    followed = np.interp(time, motion.time, motion.travel)
    assert np.abs(followed - value).max() <= 1e-5 * (1 + 1e-9)
    # Travel and velocity belong together.
    assert motion.velocity[:, 0] * np.diff(motion.time) == pytest.approx(np.diff(motion.travel))
    assert len(motion.velocity) < 500


def test_repeated_stamps_of_a_paused_node_are_one_sample() -> None:
    time = np.array([0.0, 0.01, 0.01, 0.01, 0.02])
    course = measured(recording(Series(time, np.array([0.0, 1e-4, 1e-4, 1e-4, 2e-4]))), 1e-6)
    assert course.motion.velocity == pytest.approx(np.array([[0.01]]))


def test_a_jump_of_the_travel_is_refused() -> None:
    time = np.arange(0.0, 1.0, 0.01)
    value = np.where(time < 0.5, 0.028, 0.0)
    with pytest.raises(InputError, match=r"a log: travel: jumps by -28 mm at 0\.49 s") as caught:
        measured(recording(Series(time, value)), 1e-6)
    assert "reset" in caught.value.reason


def test_logs_without_a_motion_are_refused() -> None:
    with pytest.raises(InputError, match="a single sample"):
        measured(recording(Series(np.zeros(1), np.zeros(1))), 1e-6)
    with pytest.raises(InputError, match="less than one tick"):
        commanded(
            recording(Series(np.zeros(1), np.zeros(1)), Series(np.zeros(1), np.zeros(1))),
            LIMITS,
            PERIOD,
        )


def test_a_plan_reaches_its_way_points() -> None:
    """28 mm down, held for a second, and up again; the deepest point is the drive's limit."""
    segments = (Segment(0.004, 7.0), Segment(0.0, 1.0), Segment(-0.004, 7.0))
    course = planned(segments, LIMITS.__class__(**{**vars(LIMITS), "travel_max": 0.028}), PERIOD)
    grid = np.arange(0.0, course.duration, 0.001)
    travel = np.interp(grid, course.motion.time, course.motion.travel)
    assert travel.max() == pytest.approx(0.028, abs=1e-9)
    deep = grid[travel > 0.028 - 1e-6]
    assert deep[-1] - deep[0] == pytest.approx(1.0, abs=0.05)
    assert travel[-1] == pytest.approx(0.0, abs=1e-6)
    # Renewed before it expires, so that the log's commands give the same motion again.
    assert np.diff(course.commands.time).max() <= LIMITS.command_timeout


def test_a_log_may_begin_in_motion() -> None:
    """At 4 mm/s, renewed after 0.05 s, stopped after 0.5 s: the drive's travel is the measured."""
    time = 0.01 * np.arange(81, dtype=np.float64)
    velocity = np.where(time < 0.505, 0.004, 0.0)
    way = 0.005 * (velocity[1:] + velocity[:-1])
    travel = Series(time, 0.003 + np.concatenate([[0.0], np.cumsum(way)]))
    commands = Series(np.array([0.05, 0.5]), np.array([0.004, 0.0]))
    course = commanded(recording(travel, commands), LIMITS, PERIOD)
    followed = np.interp(time, course.motion.time, course.motion.travel)
    assert followed == pytest.approx(travel.value, abs=2e-9)
    assert course.notes == ()


@pytest.mark.parametrize("renewed", [0.54, 0.55, 0.56, 0.57, 0.62, 0.84])
def test_when_a_command_expired_shows_which_tick_took_its_renewal(renewed: float) -> None:
    """A renewal changes nothing when it is taken, but half a second later, if no other follows.

    The drive moves at 4 mm/s in the 50 ticks from 0.55 s on, and again in those from 1.3 s on.
    """
    time = 0.01 * np.arange(201, dtype=np.float64)
    moves = (time > 0.205) & (time < 1.055) | (time > 1.305) & (time < 1.805)
    velocity = np.where(moves, 0.004, 0.0)
    way = 0.005 * (velocity[1:] + velocity[:-1])
    travel = Series(time, np.concatenate([[0.0], np.cumsum(way)]))
    commands = Series(np.array([0.2, renewed, 1.32]), np.full(3, 0.004))
    course = commanded(recording(travel, commands), LIMITS, PERIOD)
    followed = np.interp(time, course.motion.time, course.motion.travel)
    assert followed == pytest.approx(travel.value, abs=2e-9)
    moved = 2 - (round(renewed / PERIOD) == 55)
    assert course.notes[0].startswith(f"the measured travel shows that {moved} of 3 commands")


def test_gaps_in_a_log_are_pointed_out() -> None:
    """A pause of the node looks like this, and so does a recorder that was held up."""
    time = np.concatenate([0.01 * np.arange(50), 3.0 + 0.01 * np.arange(50)])
    travel = Series(time, np.zeros(100))
    commands = Series(np.array([0.0]), np.array([0.0]))
    (note,) = commanded(recording(travel, commands), LIMITS, PERIOD).notes
    assert "gap" in note
    assert "2.51 s" in note


def test_a_travel_that_scatters_is_pointed_out() -> None:
    """By its standard deviation; a tolerance of four of them leaves few corners."""
    time = np.arange(0.0, 10.0, 0.01)
    noise = np.random.default_rng(2).normal(0.0, 5e-6, len(time))
    scattered = recording(Series(time, 0.002 * time + noise))
    course = measured(scattered, 1e-6)
    (note,) = course.notes
    said = re.search(r"scatters by (\S+) um", note)
    assert said is not None
    assert float(said[1]) == pytest.approx(5.0, rel=0.1)
    smooth = measured(scattered, 2.2e-5)
    assert smooth.notes == ()
    assert len(smooth.motion.velocity) < 0.03 * len(course.motion.velocity)
    assert measured(recording(Series(time, 0.002 * time)), 1e-6).notes == ()
