"""The drive's motion without physics is the drive's own, bit for bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.drive import Drive
from hma_gripper_sim.drive_limits import DriveLimits
from hma_gripper_sim.kernels.drive_profile import drive_profile

FAR = Scene(
    GripperDesign.thesis_2013(),
    Circle(0.015),
    clearance=0.2,
    discretisation="midpoint",
    elements_top=1,
    elements_beam=1,
)
SIMULATION = Simulation(FAR)
LIMITS = DriveLimits(
    max_velocity=0.05, max_acceleration=0.5, travel_min=-0.001, travel_max=0.01, command_timeout=0.1
)

COMMANDS = st.lists(
    st.one_of(st.just(math.nan), st.just(0.0), st.floats(-0.1, 0.1)), min_size=1, max_size=60
)


def profile(commands, period):
    travel, velocity = np.zeros((2, len(commands) + 1))
    drive_profile(
        np.array(commands),
        LIMITS.max_velocity,
        LIMITS.max_acceleration * period,
        LIMITS.travel_min,
        LIMITS.travel_max,
        LIMITS.timeout_ticks(period),
        period,
        travel,
        velocity,
    )
    return travel, velocity


@settings(max_examples=25, deadline=None)
@given(COMMANDS, st.sampled_from([0.001, 0.01, 0.05]))
def test_profile_is_the_drives_motion(commands: list[float], period: float) -> None:
    """Limits of velocity, acceleration and travel, and the timeout, in any order of commands."""
    SIMULATION.reset()
    drive = Drive(SIMULATION, {"far": FAR}, "far", period=period, limits=LIMITS)
    travel, velocity = profile(commands, period)
    for k, command in enumerate(commands, start=1):
        if not math.isnan(command):
            drive.command(command)
        state = drive.tick()
        assert (state.travel, state.velocity) == (travel[k], velocity[k])


def test_an_expired_command_ramps_to_rest() -> None:
    """0.1 s after the only command; 0.5 m/s² takes 0.02 m/s off in 0.04 s."""
    _, velocity = profile([0.02] + [math.nan] * 19, 0.01)
    assert velocity[10] == pytest.approx(0.02)
    assert velocity[14:] == pytest.approx(0.0, abs=1e-15)
