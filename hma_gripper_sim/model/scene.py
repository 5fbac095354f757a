"""A scene: a gripper above an object, with the contact law between them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.contact import ContactLaw, Fingertip
from hma_gripper_sim.kernels.integrator import HalfState
from hma_gripper_sim.kernels.proximity import Obstacle, point_distance, segment_distance
from hma_gripper_sim.kernels.stage import Model
from hma_gripper_sim.mechanics.asked_accuracy import (
    Choice,
    Resolution,
    choose_resolution,
    explain_stepping,
)
from hma_gripper_sim.mechanics.discretisation import DISCRETISATIONS, HalfGripper, discretise
from hma_gripper_sim.mechanics.start_pose import start_state
from hma_gripper_sim.model.contours.shapes import Circle, Contour, face_normals
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.units import choice, quantity, whole_number

Array = NDArray[np.float64]

CONTACTS = ("continuous", "sampled")
SAMPLED_NORMALS = ("tip", "object")
SIDES = ("right", "left")
GRAZE = 5e-7  # depth over which contact damping sets in, relative to the tip's radius
TOUCH = 5e-5  # way in which a touch is looked for step by step, relative to the tip's radius


@dataclass(frozen=True)
class Scene:
    """What is simulated, and with which model of it.

    Drawing plane: x to the right, z up (REP-103), the origin where the middle of the top
    beam is at travel 0.

    Parameters
    ----------
    design
        The gripper.
    contour
        The object; fixed and rigid.
    friction
        Coefficient of friction between tip and object.
    clearance
        Travel from the start pose to the first touch of the stress-free gripper [m].  An
        object that passes between the tips has its top that far below their lowest points.
    contact
        ``continuous``: the tip's capsule; ``sampled``: the contact points of the thesis.
    discretisation
        ``thesis``, ``midpoint`` or ``gauss`` (see `hma_gripper_sim.mechanics.discretisation`);
        None: ``thesis``, or ``gauss`` when an accuracy is asked for.
    elements_top, elements_beam
        GBEs of half the top beam and of a side beam; None: as in the design for ``thesis``,
        2 and 8 for ``midpoint``, for ``gauss`` as for an accuracy of 0.1 (2 and 4), or as many
        as the accuracy needs.
    sampled_normal
        Direction of sampled contact forces: the normal of the ``tip`` or of the ``object``;
        None: of the object for circles, of the tip otherwise, as in the thesis.
    offset
        Lateral offset of the object from the gripper's axis [m].
    symmetry
        None: step one half where both are mirror images; False: always both.
    normal_stiffness, normal_damping
        Of the contact [N/m, N s/m].
    slip_velocity
        0: set-valued Coulomb friction; otherwise the slip velocity below which the
        regularised law of the thesis is linear [m/s].
    gravity
        [m/s^2]
    accuracy
        Error to be reached, of model and time stepping together: RMS over a run, of the actuator
        force relative to its largest and of angles relative to a radian.  The scene then
        chooses by itself what is left open; `choices` says what and why, and which error of
        the model is to be expected.

    Raises
    ------
    InputError
        Names the field that cannot be used and why.
    """

    design: GripperDesign
    contour: Contour
    friction: float = 0.6
    clearance: float = 0.005
    contact: str = "continuous"
    discretisation: str | None = None
    elements_top: int | None = None
    elements_beam: int | None = None
    sampled_normal: str | None = None
    offset: float = 0.0
    symmetry: bool | None = None
    normal_stiffness: float = 1e4
    normal_damping: float = 1.0
    slip_velocity: float = 0.0
    gravity: float = 9.81
    accuracy: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.design, GripperDesign):
            raise _refuse("design", f"expected a GripperDesign, got {self.design!r}")
        if not isinstance(self.contour, Contour):
            raise _refuse("contour", f"expected a contour, got {self.contour!r}")
        for name, unit in (
            ("friction", ""),
            ("clearance", "m"),
            ("normal_damping", "N*s/m"),
            ("slip_velocity", "m/s"),
            ("gravity", "m/s^2"),
        ):
            self._set(
                name, quantity(getattr(self, name), unit, field=name, source="Scene", minimum=0.0)
            )
        self._set("offset", quantity(self.offset, "m", field="offset", source="Scene"))
        stiffness = quantity(
            self.normal_stiffness,
            "N/m",
            field="normal_stiffness",
            source="Scene",
            minimum=0.0,
            exclusive=True,
        )
        self._set("normal_stiffness", stiffness)
        choice(self.contact, CONTACTS, field="contact", source="Scene")
        if self.sampled_normal is None:
            self._set("sampled_normal", "object" if isinstance(self.contour, Circle) else "tip")
        choice(self.sampled_normal, SAMPLED_NORMALS, field="sampled_normal", source="Scene")
        if self.symmetry is not None and self.symmetry is not False:
            raise _refuse("symmetry", f"must be None or False, got {self.symmetry!r}")
        if self.accuracy is not None:
            value = quantity(
                self.accuracy, "", field="accuracy", source="Scene", minimum=1e-6, maximum=0.1
            )
            self._set("accuracy", value)
        if self.discretisation is not None:
            choice(self.discretisation, DISCRETISATIONS, field="discretisation", source="Scene")
        for name in ("elements_top", "elements_beam"):
            if getattr(self, name) is not None:
                count = whole_number(getattr(self, name), field=name, source="Scene")
                self._set(name, count)

    def rediscretised(self, discretisation: str, elements_top: int, elements_beam: int) -> Scene:
        """Return the same scene with another discretisation of the gripper.

        The stress-free gripper is the same in all of them, and so is the object's place.
        """
        scene = replace(
            self,
            discretisation=discretisation,
            elements_top=elements_top,
            elements_beam=elements_beam,
            accuracy=None,
        )
        scene._set("object_position", self.object_position)
        return scene

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    @cached_property
    def resolution(self) -> Resolution:
        """Discretisation and numbers of GBEs that are simulated."""
        return choose_resolution(
            self.design, self.accuracy, self.discretisation, self.elements_top, self.elements_beam
        )

    @cached_property
    def choices(self) -> tuple[Choice, ...]:
        """What of the scene is simulated, and why."""
        return (*self.resolution.choices, *explain_stepping(self.asymmetry))

    @cached_property
    def half(self) -> HalfGripper:
        """The right half of the gripper as a chain."""
        resolution = self.resolution
        return discretise(
            self.design,
            resolution.discretisation,
            resolution.elements_top,
            resolution.elements_beam,
        )

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """``slide``, then part by part, right before left, numbered from the middle outwards."""
        return ("slide", *(name for name, _, _ in self._revolute_joints))

    @cached_property
    def joint_columns(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Where in `joint_names` the joints of the right and of the left half are, each (n,)."""
        columns = np.empty((2, len(self.half.joints)), dtype=np.intp)
        for column, (_, side, joint) in enumerate(self._revolute_joints, start=1):
            columns[side, joint] = column
        return columns[0], columns[1]

    @property
    def _revolute_joints(self) -> Iterator[tuple[str, int, int]]:
        """Name, side and number in the chain of each joint, in the order of `joint_names`."""
        for part in ("top", "beam", "tip"):
            for side, side_name in enumerate(SIDES):
                for joint, (kind, number) in enumerate(self.half.joints):
                    if kind == part:
                        name = f"{part}_{side_name}"
                        yield name if part == "tip" else f"{name}_{number}", side, joint

    @cached_property
    def is_symmetric(self) -> bool:
        """Whether both halves are mirror images and one is enough."""
        return self.asymmetry is None

    @cached_property
    def asymmetry(self) -> str | None:
        """Why both halves are stepped; None when one is enough."""
        if self.symmetry is False:
            return "asked for"
        if self.offset != 0.0:
            return "the object is off the axis"
        return None if self.contour.is_symmetric else "the contour is not symmetric"

    @cached_property
    def object_position(self) -> tuple[float, float]:
        """Origin of the contour's frame in world coordinates (x, z) [m]."""
        return (self.offset, self._first_touch() - self.clearance)

    @cached_property
    def models(self) -> tuple[Model, Model]:
        """The right half, and the left half mirrored, ready for the kernels."""
        law = ContactLaw(
            self.normal_stiffness,
            self.normal_damping,
            self.friction,
            self.slip_velocity,
            GRAZE * self.design.tip.radius,
        )
        right, left = (
            Model(
                self.half.chain,
                self._fingertip,
                self._obstacle(side, self.object_position),
                law,
                self.gravity,
                _bending_force(self.half.chain),
            )
            for side in SIDES
        )
        return right, left

    @cached_property
    def start_states(self) -> tuple[HalfState, HalfState]:
        """Both halves at rest at travel 0 (see `mechanics.start_pose`); not to be changed.

        Raises
        ------
        SimulationError
            There is no static equilibrium.
        """
        right, left = self.models
        state = start_state(right)
        return state, state if self.is_symmetric else start_state(left)

    @cached_property
    def _fingertip(self) -> Fingertip:
        tip = self.design.tip
        if self.contact == "continuous":
            points = np.array([tip.capsule_start, tip.capsule_end])
            normals, radius = np.zeros((2, 2)), tip.radius
        else:
            points = np.array(tip.points)
            angles = np.array(tip.normal_angles)
            normals, radius = np.column_stack([np.cos(angles), np.sin(angles)]), 0.0
        sampled = self.contact == "sampled"
        return Fingertip(
            points + self.half.tip_origin,
            normals,
            radius,
            not sampled,
            sampled and self.sampled_normal == "tip",
        )

    def _obstacle(self, side: str, position: tuple[float, float]) -> Obstacle:
        core = self.contour.core + position
        own_image = self.offset == 0.0 and self.contour.is_symmetric
        if side == "left" and not own_image:
            core = (core * (-1.0, 1.0))[::-1]
        return Obstacle(
            np.ascontiguousarray(core),
            face_normals(core),
            core.mean(axis=0),
            self.contour.core_radius,
        )

    def _first_touch(self) -> float:
        """Height of the contour's origin at which it touches the stress-free gripper."""
        chain, fingertip = self.half.chain, self._fingertip
        angle, position = 0.0, chain.root.copy()
        for rest, link in zip(chain.rest, chain.link, strict=True):
            angle += rest
            position += _rotate(link, angle)
        points = position + _rotate(fingertip.points, angle)
        lowest = points[:, 1].min() - fingertip.radius
        highest = points[:, 1].max() + fingertip.radius
        top = self.contour.core[:, 1].max() + self.contour.core_radius
        size = np.ptp(self.contour.core[:, 1]) + 2.0 * self.contour.core_radius

        def gap(height: float) -> float:
            smallest = np.inf
            for side in SIDES:
                obstacle = self._obstacle(side, (self.offset, height))
                if fingertip.capsule:
                    distance = segment_distance(obstacle, *points[0], *points[1])[0]
                else:
                    distance = min(point_distance(obstacle, x, z)[0] for x, z in points)
                smallest = min(smallest, distance)
            return smallest - obstacle.radius - fingertip.radius

        # Rise by the gap, which cannot pass a touch, until there is one or none is left.
        near = TOUCH * self.design.tip.radius
        start = lowest - top
        height = start
        while height < highest - top + size:
            free = gap(height)
            if free < near:
                beyond = height
                while gap(beyond) > 0.0 and beyond < height + 100.0 * near:
                    beyond += 10.0 * near
                if gap(beyond) <= 0.0:
                    return float(brentq(gap, height - near, beyond, xtol=1e-8 * near))
            height += max(free, near)
        return float(start)


def _bending_force(chain: Chain) -> float:
    """Force across the end of a straight chain that bends it by about two radians [N]."""
    length = float(np.hypot(chain.link[:, 0], chain.link[:, 1]).sum())
    return 2.0 / (float((1.0 / chain.stiffness).sum()) * length)


def _rotate(vectors: Array, angle: float) -> Array:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(vectors @ np.array([[cos, sin], [-sin, cos]]))


def _refuse(field: str, reason: str) -> InputError:
    return InputError(reason, field=field, source="Scene")
