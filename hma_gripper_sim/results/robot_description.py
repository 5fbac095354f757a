"""The gripper as a robot description: a URDF that the node's joint states move.

Frames: `MOUNT` has x to the right and z towards the object, as a tool flange has; a point (x, z)
of the drawing plane, where z is up, stands at (x, 0, -z). Its origin is the middle of the top
beam at travel 0. Every link's frame sits at the joint that carries it and turns with it: on the
unbent top beam it is parallel to `MOUNT`, on a side beam turned by that beam's slant. Joint axes
point along y, out of the plane, so that a positive angle turns counter-clockwise in the drawing
plane, as in JointState.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection, Sequence
from copy import deepcopy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.kernels.clearance import TIP_SHANK
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.joint_names import SLIDE, check_prefix
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.units import quantity

Array = NDArray[np.float64]

MOUNT = "gripper_mount"
"""Link that an arm's flange carries; the actuator wrench is expressed in it."""

_MATERIAL = "hot_melt_adhesive"


def gripper_urdf(
    scene: Scene,
    limits: DriveLimits,
    *,
    parent: str | None = None,
    xyz: Sequence[float] = (0.0, 0.0, 0.0),
    rpy: Sequence[float] = (0.0, 0.0, 0.0),
    arm: str | None = None,
    prefix: str = "",
) -> str:
    """Return the URDF of a scene's gripper, alone or on an arm.

    Joints have the names of ``scene.joint_names`` and stand in that order; the link that a joint
    carries is called ``<joint>_link``. What is seen of a link is also what others may collide
    with. Limits of the revolute joints are where the material's
    linear range ends, and the speed at which a body's far end is as fast as the drive may be; the
    effort of `SLIDE` is what bends the top beam that far when it acts below the corners. The
    simulation itself stops at neither. Inertia in the drawing plane is the simulation's; a tip's
    moments along x and along z, of which a design states the sum only, are taken to be equal.

    Parameters
    ----------
    scene
        The gripper and how it is divided into elements.
    limits
        Of the drive: travel and velocity of `SLIDE`.
    parent
        Link that carries `MOUNT` by a fixed joint, such as an arm's flange: a link of `arm`, or
        else the root of what is returned. None: `MOUNT` is the root.
    xyz, rpy
        Place [m], and roll, pitch and yaw [rad], of `MOUNT` on `parent`.
    arm
        URDF of an arm that the gripper becomes a part of. None: the gripper alone.
    prefix
        Stands before every name of the gripper's, as before those of the node's joint states.

    Raises
    ------
    InputError
        The discretisation is ``gauss``, the name of the parent is empty or taken, a number is
        not finite, a place or an arm is given without a parent, the arm has no such link or
        names of the gripper's, or no name can begin with the prefix.
    """
    if scene.half.chain.straightening.any():
        reason = "its joints slide as they turn, which a URDF cannot say: take another one"
        raise InputError(reason, field="discretisation")
    place = {
        name: [quantity(value, unit, field=name) for value in values]
        for name, values, unit in (("xyz", xyz, "m"), ("rpy", rpy, "rad"))
    }
    if parent is None and any(map(any, place.values())):
        raise InputError("a place needs a link to be on", field="parent")
    check_prefix(prefix, field="prefix")
    own = {*scene.joint_names, *map(_link_name, scene.joint_names), MOUNT, f"{MOUNT}_joint"}
    taken = {prefix + name for name in own}
    robot = _carrier(parent, taken) if arm is None else _arm(arm, parent, taken)
    gripper = _gripper(scene, limits)
    for element in gripper.iter():
        for attribute in ("name", "link"):
            if attribute in element.attrib:
                element.set(attribute, prefix + element.attrib[attribute])
    if parent is not None:
        joint = _joint(f"{prefix}{MOUNT}_joint", "fixed", parent, f"{prefix}{MOUNT}")
        joint.append(_origin(place["xyz"], place["rpy"]))
        robot.append(joint)
    robot.extend(gripper)
    ET.indent(robot)
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def _gripper(scene: Scene, limits: DriveLimits) -> ET.Element:
    """Return a robot of all that belongs to the gripper, from the link `MOUNT` on."""
    gripper = ET.Element("robot")
    material = ET.SubElement(gripper, "material", name=_MATERIAL)
    ET.SubElement(material, "color", rgba="0.85 0.6 0.2 1")
    ET.SubElement(gripper, "link", name=MOUNT)
    gripper.extend(_slide(scene, limits))
    halves = [_half(scene, limits, side) for side in (0, 1)]
    for name in scene.joint_names[1:]:
        gripper.extend(next(half[name] for half in halves if name in half))
    for link in gripper.findall("link"):
        for visual in link.findall("visual"):
            collision = ET.SubElement(link, "collision")
            collision.extend(deepcopy(part) for part in visual if part.tag != "material")
    return gripper


def _carrier(parent: str | None, own: Collection[str]) -> ET.Element:
    """Return a robot that is empty, or a single link."""
    robot = ET.Element("robot", name="hma_gripper")
    if parent is not None:
        if not parent.strip() or parent in own:
            raise InputError(f"{parent!r} is no name for another link", field="parent")
        ET.SubElement(robot, "link", name=parent)
    return robot


def _arm(text: str, parent: str | None, own: Collection[str]) -> ET.Element:
    """Return the robot of an arm's URDF, which has the link and none of the gripper's names."""
    try:
        robot = ET.fromstring(text)
    except ET.ParseError as error:
        raise InputError(f"not XML: {error}", field="arm") from None
    if robot.tag != "robot":
        raise InputError(f"no URDF: its root is <{robot.tag}>", field="arm")
    if any("wiki/xacro" in item.tag for item in robot.iter()):
        raise InputError("expand it first: xacro FILE > arm.urdf", field="arm")
    links, joints = (
        {item.get("name", "") for item in robot.findall(kind)} for kind in ("link", "joint")
    )
    if double := sorted((links | joints) & set(own)):
        raise InputError(
            f"already has a link or joint {double[0]!r}: give the gripper a prefix", field="arm"
        )
    if parent not in links:
        raise InputError(f"must be a link of the arm, got {parent!r}", field="parent")
    return robot


def _slide(scene: Scene, limits: DriveLimits) -> tuple[ET.Element, ET.Element]:
    """The middle GBE on the prismatic joint."""
    half, design = scene.half, scene.design
    middle = float(half.chain.root[0])
    joint = _joint(SLIDE, "prismatic", MOUNT, _link_name(SLIDE))
    ET.SubElement(joint, "axis", xyz="0 0 1")
    force = 2.0 * _largest_moment(scene) / design.corner[0]
    joint.append(_limit(limits.travel_min, limits.travel_max, force, limits.max_velocity))
    link = ET.Element("link", name=_link_name(SLIDE))
    moments = half.middle_mass / 12.0 * np.diag([(2.0 * middle) ** 2, design.width**2])
    link.append(_inertial(half.middle_mass, (0.0, 0.0), moments, design.height))
    link.append(_bar((-middle, 0.0), (middle, 0.0), design.width, design.height))
    return joint, link


def _half(scene: Scene, limits: DriveLimits, side: int) -> dict[str, tuple[ET.Element, ET.Element]]:
    """Joint and link of each body of a half, by the joint's name; side 1 is the mirror image."""
    chain, segments, height = scene.half.chain, scene.half.segments, scene.design.height
    mirror = -1.0 if side else 1.0
    moment = _largest_moment(scene)
    parent, place = SLIDE, chain.root
    elements = {}
    for i, column in enumerate(scene.joint_columns[side]):
        name = scene.joint_names[column]
        joint = _joint(name, "revolute", _link_name(parent), _link_name(name))
        joint.append(_origin(_point(place, mirror), (0.0, mirror * chain.rest[i], 0.0)))
        ET.SubElement(joint, "axis", xyz="0 1 0")
        angle = moment / chain.stiffness[i]
        joint.append(_limit(-angle, angle, moment, limits.max_velocity / segments.reach[i]))
        link = ET.Element("link", name=_link_name(name))
        flip = np.array([mirror, 1.0])
        moments = _second_moments(scene, i) * np.outer(flip, flip)
        link.append(_inertial(chain.mass[i], chain.centre[i] * flip, moments, height))
        for row in np.flatnonzero(segments.body == i):
            start, end = segments.ends[row].reshape(2, 2) * flip
            width = 2.0 * segments.radius[row]
            link.append(_bar(start, end, width, height))
            if segments.part[row] >= TIP_SHANK:  # a capsule in the plane
                link.extend(_disc(centre, width, height) for centre in (start, end))
        elements[name] = joint, link
        parent, place = name, chain.link[i]
    return elements


def _second_moments(scene: Scene, body: int) -> Array:
    """Mass moments ∫ x xᵀ dm of a body in the plane, about its centre of gravity, shape (2, 2)."""
    half, design = scene.half, scene.design
    segments, centre = half.segments, half.chain.centre[body]
    total = np.zeros((2, 2))
    rows = segments.body == body
    for ends in segments.ends[rows & (segments.part < TIP_SHANK)]:
        start, end = ends.reshape(2, 2)
        length = float(np.linalg.norm(end - start))
        mass = design.line_density * length
        along = (end - start) / length
        across = np.array([-along[1], along[0]])
        arm = 0.5 * (start + end) - centre
        total += mass / 12.0 * length**2 * np.outer(along, along)
        total += mass / 12.0 * design.width**2 * np.outer(across, across)
        total += mass * np.outer(arm, arm)
    if np.any(segments.part[rows] >= TIP_SHANK):
        arm = half.tip_origin + design.tip.centre_of_gravity - centre
        total += 0.5 * design.tip.inertia * np.eye(2) + design.tip_mass * np.outer(arm, arm)
    return total


def _largest_moment(scene: Scene) -> float:
    """Bending moment at which the material's linear range ends [N m]."""
    return scene.design.material.stress_limit / scene.design.bending_stress(1.0)


def _inertial(mass: float, centre: ArrayLike, moments: Array, height: float) -> ET.Element:
    """A body that is `height` thick across the plane; `moments` as by `_second_moments`."""
    element = ET.Element("inertial")
    element.append(_origin(_point(centre)))
    ET.SubElement(element, "mass", value=_decimal(mass))
    across = mass * height**2 / 12.0
    (x, xz), (_, z) = moments
    values = {
        "ixx": z + across,
        "iyy": x + z,
        "izz": x + across,
        "ixy": 0.0,
        "ixz": xz,  # -∫ x z dm, with the link's z pointing down
        "iyz": 0.0,
    }
    ET.SubElement(element, "inertia", {name: _decimal(value) for name, value in values.items()})
    return element


def _bar(start: ArrayLike, end: ArrayLike, width: float, height: float) -> ET.Element:
    a, b = np.asarray(start), np.asarray(end)
    x, z = b - a
    visual, geometry = _visual(_point(0.5 * (a + b)), (0.0, math.atan2(z, x), 0.0))
    ET.SubElement(geometry, "box", size=_texts((math.hypot(x, z), height, width)))
    return visual


def _disc(centre: ArrayLike, diameter: float, height: float) -> ET.Element:
    visual, geometry = _visual(_point(centre), (0.5 * math.pi, 0.0, 0.0))
    ET.SubElement(geometry, "cylinder", radius=_decimal(0.5 * diameter), length=_decimal(height))
    return visual


def _visual(xyz: Sequence[float], rpy: Sequence[float]) -> tuple[ET.Element, ET.Element]:
    visual = ET.Element("visual")
    visual.append(_origin(xyz, rpy))
    geometry = ET.SubElement(visual, "geometry")
    ET.SubElement(visual, "material", name=_MATERIAL)
    return visual, geometry


def _joint(name: str, kind: str, parent: str, child: str) -> ET.Element:
    joint = ET.Element("joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _limit(lower: float, upper: float, effort: float, velocity: float) -> ET.Element:
    values = {"lower": lower, "upper": upper, "effort": effort, "velocity": velocity}
    return ET.Element("limit", {name: _decimal(value) for name, value in values.items()})


def _origin(xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> ET.Element:
    return ET.Element("origin", xyz=_texts(xyz), rpy=_texts(rpy))


def _point(place: ArrayLike, mirror: float = 1.0) -> tuple[float, float, float]:
    """A place (x, z) of the drawing plane in a link's frame."""
    x, z = np.asarray(place)
    return (mirror * x, 0.0, -z)


def _link_name(joint: str) -> str:
    return f"{joint}_link"


def _texts(values: Sequence[float]) -> str:
    return " ".join(map(_decimal, values))


def _decimal(value: float) -> str:
    return f"{value + 0.0:.15g}"  # without -0
