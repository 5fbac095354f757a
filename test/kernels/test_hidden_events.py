"""What a step conceals between its ends: bounds and touches against dense evaluation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.interpolate import CubicHermiteSpline

from hma_gripper_sim import Circle, GripperDesign, Polygon, RoundedBox, Scene
from hma_gripper_sim.kernels.base_motion import Motion, Stretch, acceleration_bound, base_motion
from hma_gripper_sim.kernels.contact_law import CLOSED, contact_modes
from hma_gripper_sim.kernels.hidden_events import (
    Passage,
    first_dip,
    first_hidden_touch,
    passage_workspace,
    tip_acceleration,
)
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.kernels.proximity import point_distance, segment_distance
from hma_gripper_sim.kernels.stage import Model

DEPTH = 1e-8  # m
SAMPLES = 4001


def random_scene(rng: np.random.Generator) -> Scene:
    """Any object and discretisation, right above the object."""
    corners = 0.4 * np.pi * (np.arange(5) + rng.uniform(0.0, 0.8, 5))
    contours = (
        Circle(rng.uniform(0.002, 0.02)),
        RoundedBox(rng.uniform(0.002, 0.03), rng.uniform(0.01, 0.03), 0.0),
        Polygon(0.012 * np.column_stack([np.cos(corners), np.sin(corners)]), 0.0005),
    )
    return Scene(
        GripperDesign.thesis_2013(),
        contours[rng.integers(3)],
        offset=rng.uniform(-0.012, 0.012),
        clearance=10 ** rng.uniform(-5.0, -3.0),
        contact=("continuous", "sampled")[rng.integers(2)],
        discretisation=("thesis", "midpoint", "gauss")[rng.integers(3)],
    )


class RandomStep:
    """A step whose ends are drawn at random, and what is between them, densely."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.model: Model = random_scene(rng).models[rng.integers(2)]
        n = self.model.chain.rest.size
        self.h = h = 10 ** rng.uniform(-3.0, 0.5)
        turn = 10 ** rng.uniform(-3.0, -0.5) / n
        self.q0, change = rng.normal(0.0, turn, (2, n))
        self.q1 = self.q0 + change
        self.v0, self.v1 = (change + rng.normal(0.0, turn, (2, n))) / h
        velocity = rng.normal(0.0, 10 ** rng.uniform(-3.0, -1.5) / h, (1, 3)) / [[1.0, h, h * h]]
        travel = Polynomial(velocity[0]).integ()(h)
        self.motion = Motion(
            np.array([0.0, h]), np.array([0.0, travel]), velocity, np.ones(1, dtype=bool)
        )
        self.time = np.linspace(0.0, h, SAMPLES)
        spline = CubicHermiteSpline(
            [0.0, h], np.array([self.q0, self.q1]), np.array([self.v0, self.v1])
        )
        base = np.empty(3)
        fingertip = self.model.fingertip
        self.points = np.empty((SAMPLES, len(fingertip.points)), dtype=complex)
        self.height = np.empty(SAMPLES)
        for i, q in enumerate(spline(self.time)):
            base_motion(self.motion, 0, self.time[i], base)
            pose = place_tip(self.model.chain, -base[0], q)
            local = fingertip.points[:, 0] + 1j * fingertip.points[:, 1]
            self.points[i] = pose[0] + 1j * pose[1] + np.exp(1j * pose[2]) * local
            self.height[i] = base[0]

    def gaps(self) -> np.ndarray:
        """Of each contact candidate at each instant [m], shape (SAMPLES, k)."""
        obstacle, fingertip = self.model.obstacle, self.model.fingertip
        reach = obstacle.radius + fingertip.radius
        if fingertip.capsule:
            rows = [
                [segment_distance(obstacle, a.real, a.imag, b.real, b.imag)[0]]
                for a, b in self.points
            ]
        else:
            rows = [
                [point_distance(obstacle, p.real, p.imag)[0] for p in row] for row in self.points
            ]
        return np.array(rows) - reach

    def first_hidden_touch(self, closed: int | None = None) -> float:
        k = 1 if self.model.fingertip.capsule else len(self.model.fingertip.points)
        modes = contact_modes(k)
        if closed is not None:
            modes.normal[closed] = CLOSED
        workspace = passage_workspace(len(self.q0), len(self.model.fingertip.points), k)
        return first_hidden_touch(
            self.model,
            Stretch(self.motion, 0, 0.0, self.h),
            Passage(self.q0, self.v0, self.q1, self.v1),
            modes,
            modes,
            modes,
            DEPTH,
            workspace,
        )


@pytest.mark.parametrize("seed", range(20))
def test_points_of_the_tip_accelerate_no_more_than_the_bound(seed: int) -> None:
    """Second differences of densely placed points, relative to the base."""
    step = RandomStep(seed)
    model = step.model
    passage = Passage(step.q0, step.v0, step.q1, step.v1)
    bound = tip_acceleration(model.chain, model.fingertip, step.h, passage)
    places = step.points - 1j * step.height[:, None]
    second = np.abs(np.diff(places, 2, axis=0)).max() / step.time[1] ** 2
    rounding = 1e-15 / step.time[1] ** 2
    assert second <= bound + rounding
    assert bound <= 1e3 * second + rounding  # and it is a bound of some use


@pytest.mark.parametrize("seed", range(80))
def test_no_touch_is_missed_and_none_is_made_up(seed: int) -> None:
    """Against dense gaps: clear until the time returned, and touching shortly after it.

    A contact that overlaps at an end may be as deep between them.
    """
    step = RandomStep(seed)
    gaps = step.gaps()
    floor = np.minimum(0.0, np.minimum(gaps[0], gaps[-1])) - DEPTH
    touch = step.first_hidden_touch()
    before = step.time <= touch
    rounding = 1e-15
    assert (gaps[before] >= floor - rounding).all()
    if touch < np.inf:
        soon = (step.time >= touch) & (step.time <= 1.01 * touch + 2.0 * step.time[1])
        assert (gaps[soon] < floor + 1e-2 * np.ptp(gaps, axis=0)).any()


def test_the_random_steps_hide_touches() -> None:
    """Of the steps above some conceal a touch and some do not, or they would show nothing."""
    found = [RandomStep(seed).first_hidden_touch() < np.inf for seed in range(80)]
    assert 10 < sum(found) < 70


def test_contacts_that_are_not_open_are_left_out() -> None:
    """The same step, with its only candidate closed."""
    seed = next(
        seed
        for seed in range(80)
        if RandomStep(seed).model.fingertip.capsule
        and RandomStep(seed).first_hidden_touch() < np.inf
    )
    assert RandomStep(seed).first_hidden_touch(closed=0) == np.inf


@pytest.mark.parametrize("seed", range(10))
def test_base_accelerates_no_more_than_the_bound(seed: int) -> None:
    """A piecewise polynomial, evaluated densely over a part of it."""
    rng = np.random.default_rng(seed)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.5, 4))])
    motion = Motion(time, np.zeros(5), rng.normal(0.0, 1.0, (4, 5)), np.zeros(4, dtype=bool))
    start, end = np.sort(rng.uniform(0.0, time[-1], 2))
    segment = int(np.searchsorted(time, start, side="right")) - 1
    stretch = Stretch(motion, segment, start, end - start)
    base, largest = np.empty(3), 0.0
    for t in np.linspace(start, end, 500):
        base_motion(motion, segment, t, base)
        largest = max(largest, abs(base[2]))
    assert largest <= acceleration_bound(stretch) * (1.0 + 1e-12)


def test_a_dip_below_zero_is_timed_exactly() -> None:
    """Quadratics with known zeros within the step, at 0.2 and 0.7 of it."""
    h, inner = 0.5, 0.15
    parabola = Polynomial.fromroots([0.1, 0.35])
    values = parabola(0.0), parabola(inner), parabola(h)
    assert first_dip(h, inner, *values, -1e-6) == pytest.approx(0.1, rel=1e-12)
    assert first_dip(h, inner, *values, 2.0 * parabola(0.225)) == np.inf  # too shallow to count
    raised = parabola + 0.02
    assert first_dip(h, inner, raised(0.0), raised(inner), raised(h), -1e-6) == np.inf
    falling = Polynomial([1.0, -4.0])  # shown by the end itself
    assert first_dip(h, inner, falling(0.0), falling(inner), falling(h), -1e-6) == np.inf
