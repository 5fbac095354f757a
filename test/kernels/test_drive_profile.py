"""The drive's motion without physics is the drive's own, bit for bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.kernels.drive_profile import drive_profile, settle_commands
from hma_gripper_sim.motion.drive_limits import DriveLimits

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
    drive_profile(LIMITS.axis(period), np.array(commands), travel, velocity)
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


def settled(commands: list[float], logged: list[int], noise: float = 0.0) -> tuple[int, list[int]]:
    """What is found out from the travel of a drive about commands that were logged elsewhere."""
    travel, _ = profile(commands, 0.01)
    way = np.diff(travel) + noise * np.cos(np.arange(len(commands)))
    values = np.array([c for c in commands if not math.isnan(c)])
    taken = np.array(logged, dtype=np.int64)
    moved = settle_commands(LIMITS.axis(0.01), 0.0, 0.0, way, values, 2, 9, 10, 1e-10, taken)
    return moved, taken.tolist()


@pytest.mark.parametrize("off", [(0, 0, 0), (1, -1, 2), (-2, 2, -1), (7, -1, 4)])
def test_ticks_that_took_a_command_are_found_in_the_travel(off: tuple[int, ...]) -> None:
    """Changes of the velocity at ticks 5, 30 and 60, renewed every 5 ticks, logged otherwise."""
    true = {5: 0.004, 30: -0.002, 60: 0.003}
    commands = [math.nan] * 80
    for k in range(5, 80, 5):
        commands[k] = true[max(t for t in true if t <= k)]
    ticks = list(range(5, 80, 5))
    wrong = [t + dict(zip(true, off, strict=True)).get(t, 0) for t in ticks]
    moved, found = settled(commands, wrong)
    assert moved == sum(o != 0 for o in off)
    assert found == ticks


def test_commands_stay_as_logged_where_the_travel_is_not_the_drives() -> None:
    """A real axis: a tenth of a micrometre in each tick is enough."""
    commands = [math.nan] * 40
    commands[5] = 0.004
    assert settled(commands, [6], noise=1e-7) == (0, [6])
