"""One half of a gripper as a chain of rigid bodies and torsional spring-dampers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.clearance import (
    SIDE_BEAM,
    TIP_FLANK,
    TIP_SHANK,
    TOP_BEAM,
    Segments,
)
from hma_gripper_sim.mechanics.discretisations.base import Partition
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.model.gripper import GripperDesign, Point

Array = NDArray[np.float64]
Joint = tuple[str, int]


@dataclass(frozen=True)
class HalfGripper:
    """The right half of a gripper as a chain; the left half is its mirror image.

    Parameters
    ----------
    chain
        Bodies and joints from the middle outwards.
    joints
        For each joint its part (``top``, ``beam``, ``tip``) and number in it.
    middle_mass
        Mass of the middle GBE, which the prismatic joint carries [kg].
    tip_origin
        Origin of the tip's frame in the frame of the last body [m], shape (2,).
    phi_rest, phi_weights
        Angle between top beam and the side beam's tangent at mid-length: its stress-free value
        [rad], and what each joint angle adds to it, shape (n,).
    outer
        From each joint along its body to the outer end of its GBE [m], shape (n,).
    beam_start, beam_end
        Ends of the side beam: body and point (x, z) in its frame [m].
    segments
        Axes of the pieces that the half consists of, for drawing and for distances.
    """

    chain: Chain
    joints: tuple[Joint, ...]
    middle_mass: float
    tip_origin: Array
    phi_rest: float
    phi_weights: Array
    outer: Array
    beam_start: tuple[int, Array]
    beam_end: tuple[int, Array]
    segments: Segments


@dataclass(frozen=True)
class _Piece:
    """A rigid piece: mass [kg], centre of gravity [m], inertia about it [kg m^2]."""

    mass: float
    centre: tuple[float, float]
    inertia: float


@dataclass(frozen=True)
class _Body:
    """A body before it enters the chain's arrays; its frame starts at its joint."""

    joint: Joint
    rest: float
    length: float  # of beam that the joint's spring stands for [m]
    link: tuple[float, float]
    pieces: tuple[_Piece, ...]


def discretise(
    design: GripperDesign, discretisation: str, elements_top: int, elements_beam: int
) -> HalfGripper:
    """Split a design into `elements_top` + `elements_beam` GBEs per half."""
    scheme = DISCRETISATIONS[discretisation]
    top = scheme.of_top_beam().partition(elements_top).times(design.top_length)
    beam = scheme.partition(elements_beam).times(design.beam_length)
    corner = (design.corner[0] - float(top.joints[-1]), design.corner[1])
    if scheme.joints_at_sections:
        bodies, end = _bodies_from_sections(design, top, beam, corner), 0.0
        outer = np.concatenate([np.cumsum(top.lengths) - top.joints, beam.lengths, [0.0]])
    else:
        bodies = _bodies_across_sections(design, top, beam, corner)
        end = design.beam_length - float(beam.joints[-1])
        outer = np.concatenate([np.cumsum(part.lengths) - part.joints for part in (top, beam)])
    tip_origin = np.array([end, 0.0])
    n = len(bodies)
    lengths = np.array([body.length for body in bodies])
    damping = np.full(n, design.joint_damping)
    if not scheme.joints_at_sections:
        damping *= design.damping_length / lengths
    slides = np.zeros(n)
    slides[: elements_top + elements_beam] = scheme.straightening((top, beam))
    whole = [_join(body.pieces) for body in bodies]
    chain = Chain(
        root=np.array([top.joints[0], 0.0]),
        link=np.array([body.link for body in bodies]),
        centre=np.array([piece.centre for piece in whole]),
        rest=np.array([body.rest for body in bodies]),
        mass=np.array([piece.mass for piece in whole]),
        inertia=np.array([piece.inertia for piece in whole]),
        stiffness=design.bending_stiffness / lengths,
        damping=damping,
        straightening=slides,
    )
    weights = np.zeros(n)
    weights[:elements_top] = 1.0
    middle = scheme.tangent_weights(elements_beam, np.array([0.5]))[0]
    weights[elements_top : elements_top + elements_beam] = middle
    return HalfGripper(
        chain,
        tuple(body.joint for body in bodies),
        2.0 * design.line_density * float(top.joints[0]),
        tip_origin,
        0.5 * math.pi + design.beam_angle,
        weights,
        outer,
        (elements_top - 1, np.array(corner)),
        (n - 1, tip_origin),
        _segments(design, bodies, corner, tip_origin),
    )


def cantilever(
    length: float, elements: int, bending_stiffness: float, discretisation: str
) -> Chain:
    """A weightless clamped beam along x (thesis 2.1.3): one link beyond the last body ends it.

    The first GBE of a discretisation whose joints are at sections is welded to the clamp.
    """
    scheme = DISCRETISATIONS[discretisation]
    whole = scheme.partition(elements).times(length)
    joints, lengths = whole
    slides = scheme.straightening((whole,))
    if scheme.joints_at_sections:
        joints, lengths, slides = joints[1:], lengths[1:], slides[1:]
    n = len(joints)
    link = np.zeros((n, 2))
    link[:, 0] = np.diff(joints, append=length)
    zeros = np.zeros(n)
    return Chain(
        root=np.array([joints[0], 0.0]),
        link=link,
        centre=np.zeros((n, 2)),
        rest=zeros,
        mass=zeros,
        inertia=zeros,
        stiffness=bending_stiffness / lengths,
        damping=zeros,
        straightening=slides,
    )


def _bodies_from_sections(
    design: GripperDesign, top: Partition, beam: Partition, corner: Point
) -> list[_Body]:
    """Bodies between joints that stand at the starts of the side beam's GBEs."""
    bodies = _top_bodies(design, top)
    end = design.top_end - float(top.joints[-1])
    bodies.append(
        _Body(("top", len(top.joints)), 0.0, top.lengths[-1], corner, (_bar(design, 0.0, end),))
    )
    for i, length in enumerate(beam.lengths):
        rest = _slant(design) if i == 0 else 0.0
        bar = _bar(design, 0.0, length)
        bodies.append(_Body(("beam", i + 1), rest, length, (length, 0.0), (bar,)))
    bodies.append(_Body(("tip", 1), 0.0, beam.lengths[-1], (0.0, 0.0), (_tip(design, 0.0),)))
    return bodies


def _bodies_across_sections(
    design: GripperDesign, top: Partition, beam: Partition, corner: Point
) -> list[_Body]:
    """Bodies between joints that stand within their GBEs."""
    bodies = _top_bodies(design, top)
    # The corner block with what is rigid on both sides of it is one body.
    along = (math.cos(_slant(design)), math.sin(_slant(design)))
    first = float(beam.joints[0])
    bar = _bar(design, 0.0, first)
    centre = (corner[0] + 0.5 * first * along[0], corner[1] + 0.5 * first * along[1])
    pieces = (
        _bar(design, 0.0, design.top_end - float(top.joints[-1])),
        _Piece(bar.mass, centre, bar.inertia),
    )
    link = (corner[0] + first * along[0], corner[1] + first * along[1])
    bodies.append(_Body(("top", len(top.joints)), 0.0, top.lengths[-1], link, pieces))
    steps = np.diff(beam.joints, append=design.beam_length)
    for i, (step, length) in enumerate(zip(steps, beam.lengths, strict=True)):
        rest = _slant(design) if i == 0 else 0.0
        bar = _bar(design, 0.0, step)
        if i < len(steps) - 1:
            bodies.append(_Body(("beam", i + 1), rest, length, (step, 0.0), (bar,)))
        else:
            pieces = (bar, _tip(design, step))
            bodies.append(_Body(("beam", i + 1), rest, length, (0.0, 0.0), pieces))
    return bodies


def _top_bodies(design: GripperDesign, top: Partition) -> list[_Body]:
    """All bodies of the top beam but the last."""
    return [
        _Body(("top", i + 1), 0.0, top.lengths[i], (step, 0.0), (_bar(design, 0.0, step),))
        for i, step in enumerate(np.diff(top.joints))
    ]


def _slant(design: GripperDesign) -> float:
    """Direction of the stress-free side beam [rad]."""
    return design.beam_angle - 0.5 * math.pi


def _segments(
    design: GripperDesign, bodies: list[_Body], corner: Point, tip_origin: Array
) -> Segments:
    """Axes of all pieces; a bent corner body has one along each beam."""
    rows: list[tuple[int, int, float, float, float, float]] = []
    for i, body in enumerate(bodies):
        part, _ = body.joint
        last_top = part == "top" and bodies[i + 1].joint[0] != "top"
        if last_top:
            far = corner[0] + design.top_end - design.corner[0]
            rows.append((i, TOP_BEAM, 0.0, 0.0, far, 0.0))
            if body.link != corner:
                rows.append((i, SIDE_BEAM, *corner, *body.link))
        elif i < len(bodies) - 1:
            rows.append((i, TOP_BEAM if part == "top" else SIDE_BEAM, 0.0, 0.0, *body.link))
        elif tip_origin[0] > 0.0:
            rows.append((i, SIDE_BEAM, 0.0, 0.0, *tip_origin))
    tip = len(bodies) - 1
    start, end = np.array(design.tip.capsule_start), np.array(design.tip.capsule_end)
    rows.append((tip, TIP_SHANK, *tip_origin, *(tip_origin + end)))
    rows.append((tip, TIP_FLANK, *(tip_origin + start), *(tip_origin + end)))
    radius = [0.5 * design.width if row[1] < TIP_SHANK else design.tip.radius for row in rows]
    reach = [math.hypot(*body.link) for body in bodies]
    for i, _, *ends in rows:
        reach[i] = max(reach[i], math.hypot(*ends[:2]), math.hypot(*ends[2:]))
    return Segments(
        np.array([row[0] for row in rows]),
        np.array([row[1] for row in rows]),
        np.array([row[2:] for row in rows]),
        np.array(radius),
        np.array(reach),
    )


def _bar(design: GripperDesign, start: float, end: float) -> _Piece:
    """A straight piece of beam along x, a cuboid."""
    mass = design.line_density * (end - start)
    inertia = mass * ((end - start) ** 2 + design.width**2) / 12.0
    return _Piece(mass, (0.5 * (start + end), 0.0), inertia)


def _tip(design: GripperDesign, start: float) -> _Piece:
    x, y = design.tip.centre_of_gravity
    return _Piece(design.tip_mass, (start + x, y), design.tip.inertia)


def _join(pieces: tuple[_Piece, ...]) -> _Piece:
    mass = sum(piece.mass for piece in pieces)
    x = sum(piece.mass * piece.centre[0] for piece in pieces) / mass
    y = sum(piece.mass * piece.centre[1] for piece in pieces) / mass
    inertia = sum(
        piece.inertia + piece.mass * ((piece.centre[0] - x) ** 2 + (piece.centre[1] - y) ** 2)
        for piece in pieces
    )
    return _Piece(mass, (x, y), inertia)
