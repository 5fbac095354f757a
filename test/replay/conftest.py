"""A short course on a coarse gripper, replayed once."""

from __future__ import annotations

from pathlib import Path

import pytest

from hma_gripper_sim.experiment import Segment
from hma_gripper_sim.replay.course import Course, planned
from hma_gripper_sim.replay.parameters import Parameters
from hma_gripper_sim.replay.replaying import Replay, replay

PERIOD_NS = 10_000_000


@pytest.fixture(scope="session")
def parameters() -> Parameters:
    return Parameters.parse(
        {
            "contour": "cylinder",
            "discretisation": "midpoint",
            "elements_top": 2,
            "elements_beam": 8,
            "travel_max": 0.012,
        }
    )


@pytest.fixture(scope="session")
def course(parameters: Parameters) -> Course:
    """3 s down, half a second of rest, and up again."""
    segments = (Segment(0.004, 3.0), Segment(0.0, 0.5), Segment(-0.004, 3.0))
    return planned(segments, parameters.limits, PERIOD_NS * 1e-9)


@pytest.fixture(scope="session")
def replayed(
    course: Course, parameters: Parameters, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Replay]:
    path = tmp_path_factory.mktemp("replayed") / "log"
    return path, replay(course, parameters, path, PERIOD_NS)
