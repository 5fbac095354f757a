"""The gripper, the object and the contact forces as markers for RViz and Foxglove.

All of it is drawn in the frame `MOUNT`: x to the right, z towards the object, so a point
(x, z) of the drawing plane, where z is up, stands at (x, 0, -z).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from geometry_msgs.msg import Point, Vector3
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.states import Snapshot
from hma_gripper_sim.model.joint_names import SIDES
from hma_gripper_sim.results.contact_forces import ContactForce, contact_forces
from hma_gripper_sim.results.gripper_outline import gripper_outline
from hma_gripper_sim.results.robot_description import MOUNT
from hma_gripper_sim.simulation.state import SimulationState

Array = NDArray[np.float64]

METRES_PER_NEWTON = 0.05
"""Length of a force's arrow."""

_AMBER = ColorRGBA(r=0.85, g=0.6, b=0.2, a=1.0)
_GREY = ColorRGBA(r=0.5, g=0.5, b=0.55, a=1.0)
_RED = ColorRGBA(r=0.8, g=0.1, b=0.1, a=1.0)


class MarkerMessages:
    """The markers, made once and refilled.

    Parameters
    ----------
    prefix
        Of names of frames.

    Attributes
    ----------
    message
        ``gripper`` and ``object``, filled outlines, and one ``contact_force`` arrow per side.
    """

    def __init__(self, prefix: str) -> None:
        self._gripper = _marker("gripper", 0, Marker.TRIANGLE_LIST, _AMBER)
        self._object = _marker("object", 0, Marker.TRIANGLE_LIST, _GREY)
        self._arrows = {
            side: _marker("contact_force", i, Marker.ARROW, _RED) for i, side in enumerate(SIDES)
        }
        for arrow in self._arrows.values():
            # Diameters of shaft and head, and the length of the head [m].
            arrow.scale = Vector3(x=0.001, y=0.002, z=0.003)
        self.message = MarkerArray(markers=[self._gripper, self._object, *self._arrows.values()])
        for marker in self.message.markers:
            marker.header.frame_id = prefix + MOUNT
        self._drawn: Scene | None = None

    def fill(self, scene: Scene, state: SimulationState, snapshot: Snapshot, stamp: int) -> None:
        """Draw a state, stamped with a time in nanoseconds."""
        for marker in self.message.markers:
            marker.header.stamp.sec, marker.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        bodies = gripper_outline(scene, state.joint_position).bodies
        _write(self._gripper.points, np.vstack([_triangles(body) for body in bodies]))
        if scene is not self._drawn:
            outline = scene.contour.outline() + np.array(scene.object_position)
            _write(self._object.points, _triangles(outline))
            self._drawn = scene
        self._draw_forces(contact_forces(scene, snapshot))

    def _draw_forces(self, forces: Iterable[ContactForce]) -> None:
        for arrow in self._arrows.values():
            arrow.action = Marker.DELETE
        for force in forces:
            arrow = self._arrows[force.side]
            arrow.action = Marker.ADD
            _write(
                arrow.points,
                np.array([force.place, force.place + METRES_PER_NEWTON * force.force]),
            )


def _marker(namespace: str, number: int, kind: int, color: ColorRGBA) -> Marker:
    marker = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD, color=color)
    marker.pose.orientation.w = 1.0
    marker.scale = Vector3(x=1.0, y=1.0, z=1.0)
    return marker


def _triangles(outline: Array) -> Array:
    """Corners of triangles that fill a closed convex outline, shape (3 k, 2)."""
    second, third = outline[1:-2], outline[2:-1]
    first = np.broadcast_to(outline[0], second.shape)
    return np.stack([first, second, third], axis=1).reshape(-1, 2)


def _write(points: list[Point], places: Array) -> None:
    """Set points to places (x, z) of the drawing plane; there are as many of them afterwards."""
    while len(points) < len(places):
        points.append(Point())
    del points[len(places) :]
    for point, (x, z) in zip(points, places.tolist(), strict=True):
        point.x, point.z = x, -z
