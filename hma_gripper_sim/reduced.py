"""Joint states at the thesis' resolution, recovered from a coarser or finer model.

The angle of a body is the beam's tangent at the body's middle.  Between these the tangent is
interpolated linearly, which keeps the second order of the midpoint discretisation.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.trace import Trace, joint_rows

Array = NDArray[np.float64]


class JointStates(NamedTuple):
    """Joint states over time.

    `names` of the joints; `position` [m, rad], `velocity` [m/s, rad/s] and `effort` [N, N m],
    each of shape (n_samples, n_joints).
    """

    names: tuple[str, ...]
    position: Array
    velocity: Array
    effort: Array


def thesis_joint_states(trace: Trace) -> JointStates:
    """Joint states of the thesis' 63 joints, whatever was simulated."""
    scene = trace.scene
    thesis = dataclasses.replace(
        scene, discretisation="thesis", elements_top=None, elements_beam=None
    )
    turns = _turns(trace)
    slide = np.stack([trace.travel, trace.velocity, trace.actuator_force])
    right, left = (
        tuple(rows @ turns.T for rows in trace.half_rows(side)) for side in ("right", "left")
    )
    return JointStates(
        thesis.joint_names,
        *joint_rows(thesis, slide, (right[0], right[1]), (left[0], left[1])),
    )


def _turns(trace: Trace) -> Array:
    """Matrix from the model's joint angles to the thesis', shape (n_thesis, n)."""
    scene = trace.scene
    design, half = scene.design, scene.half
    n = len(half.joints)
    bodies = np.vstack([np.zeros(n), np.tril(np.ones((n, n)))])  # body angles; row 0: the base
    top = sum(part == "top" for part, _ in half.joints)
    beam = sum(part == "beam" for part, _ in half.joints)
    top_nodes = np.arange(top + 1) * design.top_length / top
    if scene.resolution.discretisation == "midpoint":
        beam_nodes, beam_bodies = np.arange(beam + 1) / beam, bodies[top:]
    else:
        beam_nodes, beam_bodies = (np.arange(beam) + 0.5) / beam, bodies[top + 1 : -1]
    wanted_top = np.arange(design.top_elements + 1) * design.top_length / design.top_elements
    wanted_beam = (np.arange(design.beam_elements) + 0.5) / design.beam_elements
    angles = np.vstack(
        [
            _interpolate(wanted_top, top_nodes, bodies[: top + 1]),
            _interpolate(wanted_beam, beam_nodes, beam_bodies),
            bodies[-1:],
        ]
    )
    return np.diff(angles, axis=0)


def _interpolate(at: Array, nodes: Array, rows: Array) -> Array:
    return np.column_stack([np.interp(at, nodes, column) for column in rows.T])
