"""From a gripper design to a chain of rigid bodies and torsional spring-dampers.

Two discretisations of the same gripper:

``thesis``
    A joint at the start of every GBE, the same damping at each joint (thesis 3.2, A.1).
    First order in the GBE's length.
``midpoint``
    A joint in the middle of every GBE, rigid halves on both sides, damping scaled as the
    stiffness is (Kelvin-Voigt).  Second order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.design import GripperDesign, Point
from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.kernels.clearance import (
    SIDE_BEAM,
    TIP_FLANK,
    TIP_SHANK,
    TOP_BEAM,
    Segments,
)

Array = NDArray[np.float64]
Joint = tuple[str, int]

DISCRETISATIONS = ("thesis", "midpoint")


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
    if discretisation == "thesis":
        bodies = _thesis_bodies(design, elements_top, elements_beam)
        tip_origin = (0.0, 0.0)
        nodes = (np.arange(elements_beam) + 0.5) / elements_beam
        first = elements_top
    else:
        bodies = _midpoint_bodies(design, elements_top, elements_beam)
        tip_origin = (0.5 * design.beam_length / elements_beam, 0.0)
        nodes = np.arange(elements_beam + 1) / elements_beam
        first = elements_top - 1
    n = len(bodies)
    lengths = np.array([body.length for body in bodies])
    damping = np.full(n, design.joint_damping)
    if discretisation == "midpoint":
        damping *= design.damping_length / lengths
    whole = [_join(body.pieces) for body in bodies]
    chain = Chain(
        root=np.array([0.5 * design.top_length / elements_top, 0.0]),
        link=np.array([body.link for body in bodies]),
        centre=np.array([piece.centre for piece in whole]),
        rest=np.array([body.rest for body in bodies]),
        mass=np.array([piece.mass for piece in whole]),
        inertia=np.array([piece.inertia for piece in whole]),
        stiffness=design.bending_stiffness / lengths,
        damping=damping,
    )
    # The tangent at mid-length lies between the two nodes (bodies' middles) around it.
    tangent = np.zeros(n)
    position = np.interp(0.5, nodes, np.arange(len(nodes)))
    below = min(int(position), len(nodes) - 1)
    share = position - below
    tangent[first + below] = 1.0 - share
    if share > 0.0:
        tangent[first + below + 1] = share
    weights = np.cumsum(tangent[::-1])[::-1]  # a joint turns all bodies from it outwards
    # The corner body points along the top beam.
    slant = float(tangent[elements_top - 1]) * (design.beam_angle - 0.5 * math.pi)
    return HalfGripper(
        chain,
        tuple(body.joint for body in bodies),
        design.line_density * design.top_length / elements_top,
        np.array(tip_origin),
        math.pi + slant + float(chain.rest @ weights),
        weights,
        (elements_top - 1, np.array(_corner_from_last_top_joint(design, elements_top))),
        (n - 1, np.array(tip_origin)),
        _segments(design, bodies, np.array(tip_origin)),
    )


def cantilever(
    length: float, elements: int, bending_stiffness: float, discretisation: str
) -> Chain:
    """A weightless clamped beam along x (thesis 2.1.3): one link beyond the last body ends it.

    The first GBE of the ``thesis`` discretisation is welded to the clamp.
    """
    element = length / elements
    midpoint = discretisation == "midpoint"
    n = elements if midpoint else elements - 1
    link = np.zeros((n, 2))
    link[:, 0] = element
    if midpoint:
        link[-1, 0] = 0.5 * element
    zeros = np.zeros(n)
    return Chain(
        root=np.array([0.5 * element if midpoint else element, 0.0]),
        link=link,
        centre=np.zeros((n, 2)),
        rest=zeros,
        mass=zeros,
        inertia=zeros,
        stiffness=np.full(n, bending_stiffness / element),
        damping=zeros,
    )


def _thesis_bodies(design: GripperDesign, elements_top: int, elements_beam: int) -> list[_Body]:
    top, beam = design.top_length / elements_top, design.beam_length / elements_beam
    bodies = []
    for i in range(1, elements_top):
        bodies.append(_Body(("top", i), 0.0, top, (top, 0.0), (_bar(design, 0.0, top),)))
    corner = _corner_from_last_top_joint(design, elements_top)
    end = design.top_end - (design.top_length - 0.5 * top)
    bodies.append(_Body(("top", elements_top), 0.0, top, corner, (_bar(design, 0.0, end),)))
    slant = design.beam_angle - 0.5 * math.pi
    for i in range(1, elements_beam + 1):
        rest = slant if i == 1 else 0.0
        bodies.append(_Body(("beam", i), rest, beam, (beam, 0.0), (_bar(design, 0.0, beam),)))
    bodies.append(_Body(("tip", 1), 0.0, beam, (0.0, 0.0), (_tip(design, 0.0),)))
    return bodies


def _midpoint_bodies(design: GripperDesign, elements_top: int, elements_beam: int) -> list[_Body]:
    top, beam = design.top_length / elements_top, design.beam_length / elements_beam
    bodies = []
    for i in range(1, elements_top):
        bodies.append(_Body(("top", i), 0.0, top, (top, 0.0), (_bar(design, 0.0, top),)))
    # The corner block with the half GBEs on both sides of it is one rigid body.
    last = design.top_length - 0.5 * top
    start = _corner_from_last_top_joint(design, elements_top)
    slant = design.beam_angle - 0.5 * math.pi
    along = (math.cos(slant), math.sin(slant))
    half = 0.5 * beam
    corner = (
        _bar(design, 0.0, design.top_end - last),
        _Piece(
            design.line_density * half,
            (start[0] + 0.5 * half * along[0], start[1] + 0.5 * half * along[1]),
            _bar(design, 0.0, half).inertia,
        ),
    )
    link = (start[0] + half * along[0], start[1] + half * along[1])
    bodies.append(_Body(("top", elements_top), 0.0, top, link, corner))
    for i in range(1, elements_beam):
        rest = slant if i == 1 else 0.0
        bodies.append(_Body(("beam", i), rest, beam, (beam, 0.0), (_bar(design, 0.0, beam),)))
    rest = slant if elements_beam == 1 else 0.0
    pieces = (_bar(design, 0.0, half), _tip(design, half))
    bodies.append(_Body(("beam", elements_beam), rest, beam, (0.0, 0.0), pieces))
    return bodies


def _corner_from_last_top_joint(design: GripperDesign, elements_top: int) -> Point:
    last_joint = design.top_length * (1.0 - 0.5 / elements_top)
    return (design.corner[0] - last_joint, design.corner[1])


def _segments(design: GripperDesign, bodies: list[_Body], tip_origin: Array) -> Segments:
    """Axes of all pieces; a bent corner body has one along each beam."""
    rows: list[tuple[int, int, float, float, float, float]] = []
    top_end = design.top_end - design.top_length
    for i, body in enumerate(bodies):
        part, _ = body.joint
        last_top = part == "top" and bodies[i + 1].joint[0] != "top"
        if last_top:
            rows.append((i, TOP_BEAM, 0.0, 0.0, top_end + 0.5 * body.length, 0.0))
            corner = _corner_from_last_top_joint(design, i + 1)
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
