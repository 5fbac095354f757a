"""Who is in charge of the drive, and which stamps are too late."""

from __future__ import annotations

import math

import pytest

from hma_gripper_sim import Circle, GripperDesign, InputError, Scene, Simulation
from hma_gripper_sim.device.arbitration import (
    MAX_AHEAD_NS,
    MAX_WAIT_NS,
    Arbiter,
    OutdatedError,
    PositionCommand,
    SourceCounts,
    TrajectoryCommand,
    VelocityCommand,
)
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.motion.trajectory import Trajectory, WayPoint

SECOND = 1_000_000_000
NOW = 1000 * SECOND
TIMEOUT = 0.5
SCENE = Scene(
    GripperDesign.thesis_2013(),
    Circle(0.015),
    clearance=0.2,
    discretisation="midpoint",
    elements_top=1,
    elements_beam=3,
)


@pytest.fixture
def drive():
    limits = DriveLimits(
        max_velocity=0.05, max_acceleration=0.5, travel_min=0, travel_max=0.1,
        command_timeout=TIMEOUT,
    )  # fmt: skip
    return Drive(Simulation(SCENE), {"far": SCENE}, "far", period=0.01, limits=limits)


@pytest.fixture
def arbiter(drive):
    return Arbiter(drive, ("a", "b"))


def to(position, time):
    return Trajectory([WayPoint(time=time, position=position, velocity=0.0)])


def test_the_last_source_that_sent_is_in_charge(drive, arbiter):
    assert drive.status().source == ""
    for source, velocity in (("a", 0.01), ("b", 0.02), ("a", 0.03)):
        arbiter.take(source, VelocityCommand(velocity), NOW)
        assert drive.status().source == source
    arbiter.take("b", TrajectoryCommand(to(0.01, 1.0)), NOW)
    assert drive.status().source == "b"
    assert drive.status().following
    arbiter.take("a", VelocityCommand(0.0), NOW)
    assert not drive.status().following
    assert arbiter.counts == {"a": SourceCounts(3), "b": SourceCounts(2)}


@pytest.mark.parametrize(
    ("command", "counts"),
    [
        (VelocityCommand(math.nan), SourceCounts(rejected=1)),
        (VelocityCommand(-math.inf), SourceCounts(rejected=1)),
        (VelocityCommand(0.01, NOW - 6 * SECOND // 10), SourceCounts(outdated=1)),
        (VelocityCommand(0.01, NOW + MAX_AHEAD_NS + 1), SourceCounts(outdated=1)),
        (VelocityCommand(0.01, -1), SourceCounts(outdated=1)),
        (TrajectoryCommand(to(0.01, 1.0), NOW - 2 * SECOND), SourceCounts(outdated=1)),
        # Of another clock: of the wall where this one is simulated.
        (TrajectoryCommand(to(0.01, 1.0), 1_700_000_000 * SECOND), SourceCounts(outdated=1)),
        (PositionCommand(math.nan), SourceCounts(rejected=1)),
        (PositionCommand(0.01, NOW + MAX_AHEAD_NS + 1), SourceCounts(outdated=1)),
    ],
)
def test_what_cannot_be_used_is_counted_and_changes_nothing(drive, arbiter, command, counts):
    arbiter.take("a", VelocityCommand(0.02), NOW)
    before = drive.status()
    with pytest.raises(InputError):
        arbiter.take("b", command, NOW)
    assert drive.status() == before
    assert arbiter.counts == {"a": SourceCounts(1), "b": counts}


def test_a_trajectory_may_wait_for_a_minute(drive, arbiter):
    arbiter.take("a", TrajectoryCommand(to(0.01, 1.0), NOW + MAX_WAIT_NS), NOW)
    assert drive.status().following


def test_while_ticks_are_made_up_the_senders_clock_is_ahead(arbiter):
    """A command stamped with the last /clock, while the state is still a step of it behind."""
    clock = NOW + 2 * SECOND
    with pytest.raises(OutdatedError, match="future"):
        arbiter.take("a", VelocityCommand(0.01, clock), NOW)
    arbiter.take("a", VelocityCommand(0.01, clock), NOW, lag=clock - NOW)
    arbiter.take("a", VelocityCommand(0.01, clock), NOW, lag=clock - NOW)


def test_a_position_is_gone_to_and_kept(drive, arbiter):
    arbiter.take("a", PositionCommand(0.01), NOW)
    states = [drive.tick() for _ in range(200)]
    assert states[-1].travel == pytest.approx(0.01, abs=1e-12)
    assert states[-1].velocity == pytest.approx(0.0, abs=1e-9)
    assert max(state.travel for state in states) < 0.01 + 1e-12  # without overshoot
    assert max(state.velocity for state in states) == 0.05
    assert drive.status().source == "a"
    assert not drive.status().stale


def test_a_source_whose_stamps_run_back_is_out_of_order(arbiter):
    arbiter.take("a", VelocityCommand(0.01, NOW), NOW)
    arbiter.take("a", VelocityCommand(0.01, NOW), NOW)  # the same may come twice
    with pytest.raises(OutdatedError, match="earlier"):
        arbiter.take("a", VelocityCommand(0.02, NOW - 1), NOW)
    arbiter.take("b", VelocityCommand(0.02, NOW - 1), NOW)  # another source has its own order
    arbiter.take("a", VelocityCommand(0.02), NOW)  # a stamp of 0 means now


def test_a_clock_that_is_set_back_does_not_lock_a_source_out(arbiter):
    arbiter.take("a", VelocityCommand(0.01, NOW), NOW)
    arbiter.take("a", VelocityCommand(0.01, 5 * SECOND), 5 * SECOND)
    assert arbiter.counts["a"] == SourceCounts(accepted=2)


def test_a_trajectorys_stamp_says_when_it_starts(drive, arbiter):
    arbiter.take("a", TrajectoryCommand(to(0.01, 1.0), NOW + SECOND // 2), NOW)
    travel = [drive.tick().travel for _ in range(151)]
    assert travel[140] < 0.01 - 1e-5
    assert travel[150] == pytest.approx(0.01, abs=1e-12)
    # An earlier start may come later: it replaces what was planned.
    arbiter.take("a", TrajectoryCommand(to(0.02, 1.0), NOW + SECOND // 4), NOW)
    assert arbiter.counts["a"] == SourceCounts(accepted=2)
