"""Random scenes, each drawn from a seed: what holds for them holds for scenes nobody chose.

Three populations: scenes of all kinds; natural picks of the thesis' gripper; and scenes of all
kinds that ask for an accuracy and leave the model open.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import count
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly
from scipy.spatial import ConvexHull

from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD, Phase, Task, phases
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.contours.base import Contour
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.model.contours.polygon import Polygon
from hma_gripper_sim.model.contours.rounded_box import RoundedBox
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.motion.prescribed_motion import Velocity

Array = NDArray[np.float64]
Random = np.random.Generator

LONGEST = 60.0  # s; a motion is cut off there
FASTEST, SLOWEST = 0.2, 5e-4  # m/s
CONTINUUM = (6, 16)  # GBEs of a half in `gauss` that stand for the continuum
SELF_LOCKING = 1.3  # friction beyond it has no converged continuum to compare with
GBES = {  # of half the top beam and of a side beam
    "thesis": ((5, 25),),
    "midpoint": ((2, 8), (3, 12), (5, 25)),
    "gauss": ((2, 4), (2, 5), (3, 6)),
}


@dataclass(frozen=True)
class Drawn:
    """A scene and a motion that were drawn.

    Parameters
    ----------
    seed
        What it was drawn from.
    kind
        Of the motion.
    scene
        What is simulated; of a scene that asks for an accuracy, its model is still open.
    motion
        Velocity of the prismatic joint in one of the forms that `simulate` takes.
    as_function
        Whether the motion is handed over as a bare function of time that says nothing of its
        jumps and kinks.
    duration
        [s]
    by_accuracy
        Whether an asked error is an accuracy of the scene rather than a tolerance.
    """

    seed: int
    kind: str
    scene: Scene
    motion: Velocity
    as_function: bool
    duration: float
    by_accuracy: bool = False

    @property
    def velocity(self) -> Velocity:
        """The motion as it is handed over."""
        if not self.as_function:
            return self.motion
        if isinstance(self.motion, PPoly):
            polynomial = self.motion
            return lambda t: float(polynomial(t))
        return phases(*cast("tuple[Phase, ...]", self.motion))

    def asking(self, error: float) -> tuple[Scene, float | None]:
        """Scene and tolerance of a run that asks for an error."""
        if self.by_accuracy:
            return replace(self.scene, accuracy=error), None
        return self.scene, error

    @property
    def converged(self) -> Scene:
        """The scene of the reference."""
        if not self.by_accuracy:
            return self.scene
        top, beam = CONTINUUM
        return replace(self.scene, discretisation="gauss", elements_top=top, elements_beam=beam)


@dataclass(frozen=True)
class Population:
    """A way of drawing scenes.

    Parameters
    ----------
    key, title
        For files and for people.
    asked
        Errors that are asked for.
    draw
        Draws a scene from a seed.
    """

    key: str
    title: str
    asked: tuple[float, ...]
    draw: Callable[[int], Drawn]


@dataclass(frozen=True)
class Way:
    """What a motion has to cover: to the object at a speed, and some way beyond the touch."""

    clearance: float  # m
    depth: float  # m
    speed: float  # m/s

    @property
    def length(self) -> float:
        """[m]"""
        return self.clearance + self.depth

    @property
    def time(self) -> float:
        """[s]"""
        return self.length / self.speed


def _log_uniform(random: Random, low: float, high: float) -> float:
    return math.exp(random.uniform(math.log(low), math.log(high)))


def _constant(random: Random, way: Way) -> tuple[Velocity, float]:
    return way.speed, way.time


def _down_hold_up(random: Random, way: Way) -> tuple[Velocity, float]:
    """Down, rest, and up by part of the way or beyond its start."""
    up = max(_log_uniform(random, SLOWEST, FASTEST), way.speed / 20.0)
    parts = (
        (way.time, way.speed),
        (random.uniform(0.1, 3.0), 0.0),
        (random.uniform(0.3, 1.2) * way.length / up, -up),
    )
    return _in_segments(parts)


def _reversals(random: Random, way: Way) -> tuple[Velocity, float]:
    """Down, then up and down by the same stroke a few times."""
    stroke = random.uniform(5e-4, way.depth) / way.speed
    cycles = int(random.integers(1, 6)) * ((stroke, -way.speed), (stroke, way.speed))
    return _in_segments(((way.time, way.speed), *cycles))


def _steps(random: Random, way: Way) -> tuple[Velocity, float]:
    """Down to the object, then from place to place at random speeds, with rests."""
    place = way.clearance + random.uniform(0.3, 1.0) * way.depth
    parts = [(place / way.speed, way.speed)]
    for _ in range(int(random.integers(3, 11))):
        if random.random() < 0.25:
            parts.append((random.uniform(0.05, 1.0), 0.0))
            continue
        goal = random.uniform(0.8 * way.clearance, way.length)
        time = abs(goal - place) / _log_uniform(random, 1e-3, FASTEST) + 1e-3
        parts.append((time, (goal - place) / time))
        place = goal
    return _in_segments(tuple(parts))


def _in_segments(parts: tuple[Phase, ...]) -> tuple[Velocity, float]:
    return parts, sum(time for time, _ in parts)


@dataclass(frozen=True)
class Sine:
    """A velocity [m/s] that oscillates about a mean."""

    mean: float  # m/s
    amplitude: float  # m/s
    frequency: float  # Hz
    phase: float  # rad

    def __call__(self, t: float) -> float:
        """At a time [s]."""
        turn = 2.0 * math.pi * self.frequency * t + self.phase
        return self.mean + self.amplitude * math.cos(turn)


def _sine(random: Random, way: Way) -> tuple[Velocity, float]:
    """Down on the whole, vibrating by 0.5 to 8 mm at 0.2 to 20 Hz."""
    frequency = _log_uniform(random, 0.2, 20.0)
    amplitude = min(FASTEST, 2.0 * math.pi * frequency * random.uniform(5e-4, 8e-3))
    duration = min(max(4.0 / frequency, 2.0), 8.0)
    phase = random.uniform(0.0, 2.0 * math.pi)
    return Sine(way.length / duration, amplitude, frequency, phase), duration


def _ramps(random: Random, way: Way) -> tuple[Velocity, float]:
    """Down and up again, each with a trapezoidal velocity, and a rest between them."""
    speed = max(way.speed, 2e-3)
    rise = random.uniform(0.02, 0.5)
    cruise = max(way.length / speed - rise, 0.01)
    rest = float(random.choice((0.01, 0.1, 0.5)))
    time = np.cumsum([0.0, rise, cruise, rise, rest, rise, cruise, rise])
    value = speed * np.array([0.0, 1.0, 1.0, 0.0, 0.0, -1.0, -1.0, 0.0])
    return PPoly(np.array([np.diff(value) / np.diff(time), value[:-1]]), time), float(time[-1])


def _minimum_jerk(random: Random, way: Way) -> tuple[Velocity, float]:
    """After a while down, after a rest up again, each with the least jerk that is possible."""
    time = random.uniform(0.3, 2.0)
    lengths = [random.uniform(0.01, 2.0), time, float(random.choice((0.01, 0.1, 0.5))), time, 0.2]
    # 30 d/T s^2 (1 - s)^2 with s = t/T, highest power first.
    bell = 30.0 * way.length * np.array([time**-5, -2.0 * time**-4, time**-3, 0.0, 0.0])
    rest = np.zeros(5)
    corners = np.cumsum([0.0, *lengths])
    return PPoly(np.array([rest, bell, rest, -bell, rest]).T, corners), float(corners[-1])


MOTIONS: dict[str, Callable[[Random, Way], tuple[Velocity, float]]] = {
    "constant": _constant,
    "down, hold, up": _down_hold_up,
    "sine": _sine,
    "reversals": _reversals,
    "steps": _steps,
    "ramps": _ramps,
    "minimum jerk": _minimum_jerk,
}
NATURAL = ("down, hold, up", "ramps", "minimum jerk")


def _motion(random: Random, kinds: tuple[str, ...], way: Way) -> tuple[str, Velocity, bool, float]:
    kind = kinds[int(random.integers(len(kinds)))]
    motion, duration = MOTIONS[kind](random, way)
    as_function = bool(random.random() < 0.5) and kind not in ("constant", "sine")
    return kind, motion, as_function, min(duration, LONGEST)


def _polygon(random: Random) -> Contour:
    """Hull of random points, turned at will, centred, its corners sharp or rounded."""
    while True:
        points = random.uniform(-1.0, 1.0, (int(random.integers(3, 14)), 2))
        points *= random.uniform(6e-3, 25e-3, 2)
        turn = random.uniform(0.0, 2.0 * math.pi)
        corners = points[ConvexHull(points).vertices]
        corners = corners @ [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]]
        corners -= 0.5 * (corners.max(axis=0) + corners.min(axis=0))
        rounding = 0.0 if random.random() < 0.5 else random.uniform(1e-4, 1.5e-3)
        edges = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
        if edges.min() < 1e-3 or np.ptp(corners, axis=0).min() < 6e-3:
            continue
        try:
            return Polygon(corners, rounding)
        except InputError:  # the rounding leaves nothing of it
            continue


def _box(random: Random) -> Contour:
    width, height = random.uniform(0.01, 0.06, 2)
    sharp = random.random() < 0.3
    rounding = 0.0 if sharp else random.uniform(0.0, 0.45 * min(width, height))
    return RoundedBox(float(width), float(height), rounding)


def _contour(random: Random) -> Contour:
    kind = random.random()
    if kind < 0.35:
        return Circle(random.uniform(6e-3, 30e-3))
    return _box(random) if kind < 0.65 else _polygon(random)


def _design(random: Random) -> GripperDesign:
    """The thesis' design in half of all cases, else one of other lengths and another material."""
    thesis = GripperDesign.thesis_2013()
    if random.random() < 0.5:
        return thesis
    modulus = _log_uniform(random, 1e5, 1e9)
    damping = 0.0 if random.random() < 0.08 else _log_uniform(random, 1.0 / 30.0, 10.0)
    return replace(
        thesis,
        material=replace(thesis.material, youngs_modulus=modulus),
        beam_length=random.uniform(0.02, 0.08),
        width=random.uniform(2e-3, 6e-3),
        beam_angle=math.radians(random.uniform(0.0, 20.0)),
        joint_damping=damping * thesis.joint_damping,
    )


def _draw_general(seed: int) -> Drawn:
    random = np.random.default_rng((seed, 1))
    discretisation = list(GBES)[int(random.integers(len(GBES)))]
    top, beam = GBES[discretisation][int(random.integers(len(GBES[discretisation])))]
    scene = Scene(
        _design(random),
        _contour(random),
        friction=0.0 if random.random() < 0.06 else random.uniform(0.0, 1.4),
        clearance=random.uniform(1e-3, 10e-3),
        contact="continuous" if random.random() < 0.6 else "sampled",
        discretisation=discretisation,
        elements_top=top,
        elements_beam=beam,
        offset=0.0 if random.random() < 0.5 else random.uniform(-8e-3, 8e-3),
    )
    speed = _log_uniform(random, SLOWEST, FASTEST)
    way = Way(scene.clearance, random.uniform(2e-3, 25e-3), speed)
    kind, motion, as_function, duration = _motion(random, tuple(MOTIONS), way)
    return Drawn(seed, kind, scene, motion, as_function, duration)


def _draw_pick(seed: int) -> Drawn:
    random = np.random.default_rng((seed, 2))
    if random.random() < 0.5:
        contour: Contour = Circle(random.uniform(6e-3, 30e-3))
    else:
        contour = RoundedBox(random.uniform(0.01, 0.05), random.uniform(0.02, 0.05), 2e-3)
    scene = Scene(
        GripperDesign.thesis_2013(),
        contour,
        friction=random.uniform(0.3, 1.4),
        clearance=random.uniform(1e-3, 10e-3),
        offset=0.0 if random.random() < 0.5 else random.uniform(-8e-3, 8e-3),
    )
    way = Way(scene.clearance, random.uniform(2e-3, 25e-3), _log_uniform(random, 2e-3, 0.1))
    kind, motion, as_function, duration = _motion(random, NATURAL, way)
    return Drawn(seed, kind, scene, motion, as_function, duration)


def _draw_for_accuracy(seed: int) -> Drawn:
    drawn = _draw_general(seed)
    scene = replace(
        drawn.scene,
        contact="continuous",
        friction=min(drawn.scene.friction, SELF_LOCKING),
        discretisation=None,
        elements_top=None,
        elements_beam=None,
    )
    return replace(drawn, scene=scene, by_accuracy=True)


POPULATIONS = {
    population.key: population
    for population in (
        Population("general", "Scenes of all kinds", (1e-2, 1e-3, 1e-4), _draw_general),
        Population("picks", "Natural picks", (1e-2, 1e-3, 1e-4), _draw_pick),
        Population("accuracy", "Scenes by accuracy", (1e-1, 1e-2, 1e-3), _draw_for_accuracy),
    )
}


def task_of(drawn: Drawn, longest: float) -> Task | None:
    """The drawn scene with its motion in phases that are whole numbers of sample periods.

    Other simulators can follow these exactly. None where the motion is no such phases. What
    goes on for longer than `longest` [s] is cut off.
    """
    motion = drawn.motion
    if isinstance(motion, float):
        parts = [(drawn.duration, motion)]
    elif isinstance(motion, tuple):
        parts = list(motion)
    else:
        return None
    rounded: list[Phase] = []
    left = round(longest / SAMPLE_PERIOD)
    for duration, velocity in parts:
        periods = min(max(1, round(duration / SAMPLE_PERIOD)), left)
        left -= periods
        if periods:
            rounded.append((periods * SAMPLE_PERIOD, velocity))
    return Task(f"seed_{drawn.seed}", _title(drawn), drawn.scene, tuple(rounded))


def _title(drawn: Drawn) -> str:
    names = {Circle: "circle", RoundedBox: "box", Polygon: "polygon"}
    return f"{names[type(drawn.scene.contour)]}, {drawn.kind}"


def plain_tasks(longest: float, wanted: Callable[[Scene], bool]) -> Iterator[Task]:
    """Yield tasks of the general population, in the order of their seeds, without an end.

    Those whose scene is `wanted`, whose motion other simulators can follow exactly, and whose
    contacts and chain they can express: everything but joints that slide (`gauss`).
    """
    for seed in count():
        drawn = _draw_general(seed)
        if drawn.scene.discretisation == "gauss" or not wanted(drawn.scene):
            continue
        task = task_of(drawn, longest)
        if task is not None:
            yield task
