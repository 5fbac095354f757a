"""A scene made computable: the described gripper as chains, the object where they meet it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.contact_law import ContactLaw
from hma_gripper_sim.kernels.integrator import HalfState
from hma_gripper_sim.kernels.stage import Model
from hma_gripper_sim.kernels.touch import Fingertip
from hma_gripper_sim.mechanics.asked_accuracy import (
    Choice,
    Resolution,
    choose_resolution,
    explain_stepping,
)
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.mechanics.half_gripper import HalfGripper, discretise
from hma_gripper_sim.mechanics.placement import fingertip, height_of_first_touch, obstacle
from hma_gripper_sim.mechanics.start_pose import start_state
from hma_gripper_sim.model.joint_names import PARTS, SIDES, SLIDE, joint_name
from hma_gripper_sim.model.scene import SceneDescription
from hma_gripper_sim.units import choice

GRAZE = 5e-7  # depth over which contact damping sets in, relative to the tip's radius


class Scene(SceneDescription):
    """A scene that can be simulated: a `SceneDescription`, whose parameters it takes.

    What is computed from the description is computed when it is first asked for: `choices` says
    what was chosen where the description leaves it open, `joint_names` how the columns of
    joint arrays are called, `object_position` where the object stands.

    Raises
    ------
    InputError
        Names the field that cannot be used and why.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.discretisation is not None:
            known = tuple(DISCRETISATIONS)
            choice(self.discretisation, known, field="discretisation", source="Scene")

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
        scene.__dict__["object_position"] = self.object_position
        return scene

    @cached_property
    def resolution(self) -> Resolution:
        """Discretisation and numbers of GBEs that are simulated."""
        return choose_resolution(
            self.design, self.accuracy, self.discretisation, self.elements_top, self.elements_beam
        )

    @cached_property
    def choices(self) -> tuple[Choice, ...]:
        """What of the scene is simulated, and why, and the model's error to be expected."""
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
        return (SLIDE, *(name for name, _, _ in self._revolute_joints))

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
        for part in PARTS:
            for side, side_name in enumerate(SIDES):
                for joint, (kind, number) in enumerate(self.half.joints):
                    if kind == part:
                        yield joint_name(part, side_name, number), side, joint

    @cached_property
    def object_position(self) -> tuple[float, float]:
        """Origin of the contour's frame in world coordinates (x, z) [m]."""
        height = height_of_first_touch(self, self.half.chain, self._fingertip)
        return (self.offset, height - self.clearance)

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
                obstacle(self, side, self.object_position),
                law,
                self.gravity,
                _bending_force(self.half.chain),
            )
            for side in SIDES
        )
        return right, left

    @cached_property
    def _fingertip(self) -> Fingertip:
        return fingertip(self, self.half.tip_origin)

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


def _bending_force(chain: Chain) -> float:
    """Force across the end of a straight chain that bends it by about two radians [N]."""
    length = float(np.hypot(chain.link[:, 0], chain.link[:, 1]).sum())
    return 2.0 / (float((1.0 / chain.stiffness).sum()) * length)
