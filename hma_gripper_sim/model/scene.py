"""A scene as it is described: a gripper above an object, and the contact law between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.model.contours.base import Contour
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.model.numbers import check_numbers, number, positive
from hma_gripper_sim.units import choice

CONTACTS = ("continuous", "sampled")
SAMPLED_NORMALS = ("tip", "object")


@dataclass(frozen=True)
class SceneDescription:
    """What is simulated, and with which model of it, as a person describes it.

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
        ``thesis``, ``midpoint`` or ``gauss`` (see `hma_gripper_sim.mechanics.discretisations`);
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
        force relative to its largest and of angles relative to a radian.  What is left open is
        then chosen so that it is reached.

    Raises
    ------
    InputError
        Names the field that cannot be used and why.
    """

    design: GripperDesign
    contour: Contour
    friction: float = field(
        default=0.6,
        metadata=number("", "Coulomb friction coefficient between tip and object.", minimum=0.0),
    )
    clearance: float = field(
        default=0.005,
        metadata=number(
            "m",
            "Travel from the start pose to the first touch of the stress-free gripper [m].",
            minimum=0.0,
        ),
    )
    contact: str = "continuous"
    discretisation: str | None = None
    elements_top: int | None = field(
        default=None, metadata=number("", minimum=1, whole=True, optional=True)
    )
    elements_beam: int | None = field(
        default=None, metadata=number("", minimum=1, whole=True, optional=True)
    )
    sampled_normal: str | None = None
    offset: float = field(
        default=0.0,
        metadata=number("m", "Distance of the object from the gripper's axis, to the right [m]."),
    )
    symmetry: bool | None = None
    normal_stiffness: float = field(
        default=1e4, metadata=positive("N/m", "Stiffness of the contact along its normal [N/m].")
    )
    normal_damping: float = field(
        default=1.0,
        metadata=number("N*s/m", "Damping of the contact along its normal [N s/m].", minimum=0.0),
    )
    slip_velocity: float = field(
        default=0.0,
        metadata=number(
            "m/s",
            "Sliding speed at which friction is fully developed [m/s]; 0: true sticking, a held "
            "object does not creep.",
            minimum=0.0,
        ),
    )
    gravity: float = field(default=9.81, metadata=number("m/s^2", minimum=0.0))
    accuracy: float | None = field(
        default=None, metadata=number("", minimum=1e-6, maximum=0.1, optional=True)
    )

    def __post_init__(self) -> None:
        if not isinstance(self.design, GripperDesign):
            raise _refuse("design", f"expected a GripperDesign, got {self.design!r}")
        if not isinstance(self.contour, Contour):
            raise _refuse("contour", f"expected a contour, got {self.contour!r}")
        check_numbers(self)
        choice(self.contact, CONTACTS, field="contact", source="Scene")
        if self.sampled_normal is None:
            object.__setattr__(self, "sampled_normal", self.contour.sampled_normal)
        choice(self.sampled_normal, SAMPLED_NORMALS, field="sampled_normal", source="Scene")
        if self.symmetry is not None and self.symmetry is not False:
            raise _refuse("symmetry", f"must be None or False, got {self.symmetry!r}")

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


def _refuse(field: str, reason: str) -> InputError:
    return InputError(reason, field=field, source="Scene")
