"""The core of the node, without ROS: whatever is asked of it, its outputs obey the invariants."""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from hma_gripper_sim import InputError, Simulation
from hma_gripper_sim.device.arbitration import Arbiter, TrajectoryCommand, VelocityCommand
from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.device.settings import Settings
from hma_gripper_sim.device.tick_schedule import Timeline
from hma_gripper_sim.motion.trajectory import LARGEST, Trajectory, WayPoint

SECOND = 1_000_000_000
SOURCES = ("cmd_velocity", "commands", "joint_commands", "joint_trajectory")
START = Settings.parse(
    {"discretisation": "midpoint", "elements_top": 1, "elements_beam": 3, "travel_min": -0.005}
)

wild = st.floats() | st.sampled_from([math.nan, math.inf, -math.inf, 1e300, -1e300])
near = st.floats(-0.08, 0.08)
# Stamps by their distance to the clock: mostly right, some late, early or absent.
stamps = st.sampled_from([None, 0.0, 0.0, -0.1, -1.0, 0.2, 5.0])
polygons = st.sampled_from(
    [
        ((-0.01, 0.0), (0.01, 0.0), (0.0, 0.015)),
        ((-0.012, 0.0), (0.008, 0.0), (0.008, 0.02), (-0.012, 0.02)),
        ((-0.01, 0.0), (0.01, 0.02), (0.01, 0.0), (-0.01, 0.02)),  # crosses itself
        ((-10.0, 0.0), (10.0, 0.0), (0.0, 15.0)),  # millimetres
        ((0.0, 0.0), (math.nan, 0.0), (0.0, 0.01)),
    ]
)


@st.composite
def way_points(draw):
    """A few way points; mostly a trajectory, sometimes none."""
    times = draw(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=4))
    with_positions = draw(st.booleans())
    value = near | st.floats(-LARGEST, LARGEST) if draw(st.booleans()) else near
    points = []
    for time in sorted(times):
        numbers = {"velocity": draw(value)} if draw(st.booleans()) or not with_positions else {}
        if with_positions:
            numbers["position"] = draw(value)
        points.append(WayPoint(time=time, **numbers))
    if points[-1].velocity is not None:
        points[-1] = replace(points[-1], velocity=0.0)
    return points


class Core(RuleBasedStateMachine):
    """A drive with its arbiter, settings and timeline, as the node puts them together."""

    def __init__(self):
        super().__init__()
        self.settings = START
        scenes, contour = START.scenes, START.contour
        self.drive = Drive(
            Simulation(scenes[contour]), scenes, contour, period=START.period, limits=START.limits
        )
        self.arbiter = Arbiter(self.drive, SOURCES)
        self.timeline = Timeline(START.period_ns, 1.0)
        self.now = 1000 * SECOND
        self.timeline.start(self.now)

    def identity(self):
        """All that a refused request must leave alone."""
        drive = self.drive
        return drive.status(), drive.limits, drive.period, drive.state, dict(drive.scenes)

    def attempt(self, call):
        """Make a request; if it is refused, nothing has changed."""
        before, counts = self.identity(), copy.deepcopy(dict(self.arbiter.counts))
        try:
            call()
        except InputError:
            assert self.identity() == before
            accepted = {name: count.accepted for name, count in self.arbiter.counts.items()}
            assert accepted == {name: count.accepted for name, count in counts.items()}

    def stamped(self, offset):
        return 0 if offset is None else self.now + round(offset * SECOND)

    @rule(source=st.sampled_from(SOURCES[:3]), velocity=near | near | wild, stamp=stamps)
    def command(self, source, velocity, stamp):
        command = VelocityCommand(velocity, self.stamped(stamp))
        self.attempt(lambda: self.arbiter.take(source, command, self.now))

    @rule(points=way_points(), stamp=stamps)
    def follow(self, points, stamp):
        def take():
            command = TrajectoryCommand(Trajectory(points), self.stamped(stamp))
            self.arbiter.take(SOURCES[3], command, self.now)

        self.attempt(take)

    @rule(paused=st.booleans())
    def pause(self, paused):
        self.drive.pause(paused)

    @rule()
    def reset(self):
        self.drive.reset()
        assert self.drive.state.travel == self.drive.state.velocity == 0.0

    @rule(name=st.sampled_from(["box", "cylinder", "outline", "mug"]))
    def select(self, name):
        self.change({"contour": name})

    @rule(
        change=st.sampled_from(
            [
                {"friction": 0.1}, {"friction": 1.2}, {"friction": -1.0}, {"friction": math.nan},
                {"publish_rate": 1000.0}, {"publish_rate": 100.0}, {"publish_rate": 37.0},
                {"publish_rate": 0.0}, {"travel_max": 0.004}, {"travel_max": 0.03},
                {"travel_max": 0.0, "travel_min": 0.0}, {"max_velocity": 0.01},
                {"max_velocity": 0.05}, {"max_acceleration": 0.05}, {"max_acceleration": 5.0},
                {"command_timeout": 0.0}, {"command_timeout": 0.05}, {"contours.box.width": 0.03},
                {"contours.box.width": -1.0}, {"real_time_factor": 0.0}, {"nonsense": 1.0},
            ]
        )
    )  # fmt: skip
    def change(self, change):
        self.attempt(lambda: self.apply(self.settings.changed(change)))

    @rule(points=polygons)
    def outline(self, points):
        self.attempt(lambda: self.apply(self.settings.with_outline(points)))

    def apply(self, new):
        self.drive.configure(
            scenes=new.scenes, contour=new.contour, limits=new.limits, period=new.period
        )
        self.settings = new
        self.timeline.set_rate(new.period_ns, new.real_time_factor)

    @rule(count=st.integers(1, 30), lag=st.sampled_from([0, 0, 0, 50_000_000, 400_000_000]))
    def tick(self, count, lag):
        self.now += lag
        for _ in range(count):
            self.now += max(0, self.timeline.until_due(self.now))
            before, stamp = self.drive.state, self.timeline.stamp
            after = self.drive.tick()
            moved = self.drive.running
            self.timeline.advance(self.now, moved=moved)
            if moved:
                self.check_motion(before, after)
                assert self.timeline.stamp >= stamp + self.settings.period_ns
            else:
                assert after is before
                assert self.timeline.stamp == stamp

    @precondition(lambda self: self.drive.status().paused)
    @rule(count=st.integers(1, 10))
    def step(self, count):
        for _ in range(count):
            before, stamp = self.drive.state, self.timeline.stamp
            after = self.drive.step()
            if self.drive.status().failure is None:
                self.timeline.step(self.now)
                self.check_motion(before, after)
                assert self.timeline.stamp == stamp + self.settings.period_ns

    def check_motion(self, before, after):
        limits, period = self.drive.limits, self.drive.period
        travelled = 0.5 * period * (before.velocity + after.velocity)
        assert after.travel - before.travel == pytest.approx(travelled, abs=1e-15)
        change = limits.max_acceleration * period
        assert abs(after.velocity - before.velocity) <= change * (1 + 1e-9)
        # A limit that was lowered in motion is reached by the ramp, not by a jump.
        assert abs(after.velocity) <= max(limits.max_velocity, abs(before.velocity))

    @invariant()
    def outputs_are_complete_and_finite(self):
        state = self.drive.state
        for numbers in (state.joint_position, state.joint_velocity, state.joint_effort):
            assert numbers.shape == (len(START.scenes["box"].joint_names),)
            assert np.isfinite(numbers).all()
        assert state.joint_position[0] == state.travel
        assert state.joint_velocity[0] == state.velocity
        assert state.joint_effort[0] == state.actuator_force
        assert math.isfinite(state.phi_left + state.phi_right)
        assert math.isfinite(state.phi_left_rate + state.phi_right_rate)

    @invariant()
    def travel_is_within_its_limits(self):
        limits = self.drive.limits
        assert limits.travel_min <= self.drive.state.travel <= limits.travel_max


TestCore = Core.TestCase
TestCore.settings = settings(max_examples=40, stateful_step_count=40, deadline=None)
