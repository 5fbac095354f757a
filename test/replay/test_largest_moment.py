"""The largest bending moment is one number: of a trace, a state, a log, and what is read of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hma_gripper_sim import Simulation
from hma_gripper_sim.device.topics import JOINT_STATES, PHI
from hma_gripper_sim.experiments.experiment import Segment
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.recordings.reading import read_messages, read_recording
from hma_gripper_sim.recordings.run_figures import FIGURES, Run
from hma_gripper_sim.replay.course import planned
from hma_gripper_sim.replay.simulated_log import replay
from hma_gripper_sim.replay.simulated_settings import SimulatedSettings

PERIOD = 0.01  # s


@pytest.mark.parametrize("discretisation", DISCRETISATIONS)
def test_trace_state_and_log_agree(discretisation: str, tmp_path: Path) -> None:
    """Bit by bit where it is read, to rounding where it is computed from the state itself."""
    known = SimulatedSettings.parse({"contour": "wedge"})  # no mirror image: the sides differ
    scene = replace(
        known.scene, discretisation=discretisation, elements_top=3, elements_beam=6, offset=1e-3
    )
    course = planned((Segment(0.004, 2.5),), known.limits, PERIOD)
    log = tmp_path / "log"
    replayed = replay(course, replace(known, scene=scene), log, round(1e9 * PERIOD)).recording

    simulation = Simulation(scene, known.tolerance)
    trace = simulation.solve_along(course.motion, PERIOD)
    largest = np.maximum(trace.largest_moments("left"), trace.largest_moments("right"))
    assert trace.max_bending_moment == largest.max() > 1e-3
    state = simulation.state()
    for side, moment in (("left", state.moment_left), ("right", state.moment_right)):
        assert trace.largest_moments(side)[-1] == pytest.approx(moment, rel=1e-9)

    np.testing.assert_allclose(replayed["bending_moment"].value, largest, rtol=1e-9)
    read = read_recording(log)
    assert np.array_equal(read["bending_moment"].value, replayed["bending_moment"].value)
    end = read["bending_moment"].time[-1]
    figure = FIGURES["max_bending_moment"].evaluate(Run(read, scene.design, 0.0), end)
    assert figure == read["bending_moment"].value.max()


def test_moments_of_joints_are_another_number(tmp_path: Path) -> None:
    """That of `midpoint`'s joints, within their GBEs, is smaller than that of the sections."""
    known = SimulatedSettings.parse({"contour": "cylinder", "discretisation": "midpoint"})
    course = planned((Segment(0.004, 2.0),), known.limits, PERIOD)
    replay(course, known, tmp_path / "log", round(1e9 * PERIOD))
    joints, phi = (
        [
            np.abs(message.content.effort[first:]).max()
            for message in read_messages(tmp_path / "log", [topic.name])
        ]
        for topic, first in ((JOINT_STATES, 1), (PHI, 0))
    )
    assert max(joints) < 0.97 * max(phi)
    assert read_recording(tmp_path / "log")["bending_moment"].value.tolist() == phi


def test_logs_of_the_thesis_have_no_second_copy(tmp_path: Path) -> None:
    """Its joints stand at the sections: their efforts say it, as in logs of every version."""
    known = SimulatedSettings.parse({"contour": "cylinder"})
    course = planned((Segment(0.004, 0.5),), known.limits, PERIOD)
    replay(course, known, tmp_path / "log", round(1e9 * PERIOD))
    assert all(not len(m.content.effort) for m in read_messages(tmp_path / "log", [PHI.name]))
