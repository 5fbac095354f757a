"""An experiment's scene as parameters of the node."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.model.contours.base import Contour


def node_parameters(experiments: Sequence[Experiment]) -> dict[str, Any]:
    """Return what a node needs to carry out experiments of one gripper and one contact law.

    Returns
    -------
    dict
        By parameter name, ``contours`` nested; the first experiment's object is in place. Where a
        motion is stated, the drive goes no deeper and no faster.
    """
    depths = [travel for experiment in experiments for _, travel in experiment.way_points]
    speeds = [abs(s.velocity) for experiment in experiments for s in experiment.motion]
    first = experiments[0]
    limits = {"travel_max": max(depths), "max_velocity": max(speeds)} if speeds else {}
    return {
        **limits,
        "friction": first.friction,
        "contact": first.contact,
        "contour": first.contour_name,
        "design": first.design_file or "",
        "contours": {
            experiment.contour_name: {
                **_contour_parameters(experiment.contour),
                "clearance": experiment.clearance,
            }
            for experiment in experiments
        },
    }


def _contour_parameters(contour: Contour) -> dict[str, object]:
    """Return a contour as the node's parameters: SI, and points as a flat list."""
    arguments = [field.name for field in dataclasses.fields(cast(Any, contour)) if field.init]
    shape = {name: np.asarray(getattr(contour, name)) for name in arguments}
    flat = {name: value.ravel() if value.ndim else value for name, value in shape.items()}
    return {"type": contour.kind, **{name: v.tolist() for name, v in flat.items()}}
