"""Joint states at the thesis' resolution, recovered from a coarser or finer model.

The angle of a body of the thesis is the beam's tangent at the body's middle, whatever model it
comes from (`Discretisation.tangent_weights`).
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.simulation.trace import Trace, joint_rows

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
    design, half, resolution = scene.design, scene.half, scene.resolution
    n, top, beam = len(half.joints), resolution.elements_top, resolution.elements_beam
    scheme = DISCRETISATIONS[resolution.discretisation]
    ends = np.arange(design.top_elements + 1) / design.top_elements
    middles = (np.arange(design.beam_elements) + 0.5) / design.beam_elements
    angles = np.zeros((len(ends) + len(middles) + 1, n))
    angles[: len(ends), :top] = scheme.of_top_beam().tangent_weights(top, ends)
    angles[len(ends) :, :top] = 1.0
    angles[len(ends) : -1, top : top + beam] = scheme.tangent_weights(beam, middles)
    angles[-1] = 1.0
    return np.diff(angles, axis=0)
