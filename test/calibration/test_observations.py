"""What was measured, averaged, and the same out of a simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, InputError, Scene
from hma_gripper_sim.calibration.observations import Trial, averaged, trial
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.motion.prescribed_motion import follow
from hma_gripper_sim.recordings.recording import Recording, Series

SCENE = Scene(
    GripperDesign.thesis_2013(),
    Circle(0.015),
    discretisation="midpoint",
    elements_top=1,
    elements_beam=3,
)


def test_averages_belong_to_the_mean_time_of_their_samples() -> None:
    """A straight line averages to itself; the last stretch has fewer samples."""
    time = np.arange(0.0, 1.02, 0.01)
    observation = averaged("phi_left", Series(time, 3.0 * time), 0.1, 0.05)
    assert observation.value == pytest.approx(3.0 * observation.time)
    assert observation.width[:-1] == pytest.approx(0.05)
    assert len(observation.time) == 21
    assert observation.uncertainty is not None
    assert observation.uncertainty[0] == pytest.approx(0.1 / np.sqrt(5))


@pytest.mark.parametrize("period", [0.001, 0.01, 0.2])
def test_a_simulation_is_averaged_as_the_samples_were(period: float) -> None:
    """At any rate of the log; the force of a free gripper that is pulled jumps with the motion."""
    motion = follow(lambda t: 0.004 if t < 1.0 else -0.004, 0.0, 0.0, 2.0)
    time = np.arange(0.0, 2.0, period)
    dense = averaged("phi_left", Series(time, np.zeros(len(time))), None, 0.05)
    trial = Trial(motion, (dense,))
    (simulated,) = trial.observed(trial.simulate(SCENE))
    samples = np.arange(0.0, 2.0, 0.001)
    trial = Trial(motion, (averaged("phi_left", Series(samples, samples), None, 1e-9),))
    (fine,) = trial.observed(trial.simulate(SCENE))
    expected = [
        fine[(samples >= t - 0.5 * w) & (samples < t + 0.5 * w)].mean()
        for t, w in zip(dense.time, dense.width, strict=True)
    ]
    assert simulated == pytest.approx(expected, abs=1e-4)


def test_instants_of_an_experiment() -> None:
    """Table 5.3, box: two angles at 7 s, read to 0.5°; the motion up to there."""
    observed = trial(read_experiment("thesis_2013_box"), "box", 1e-6)
    assert [o.name for o in observed.observations] == ["phi_left", "phi_right"]
    left, right = observed.observations
    assert np.degrees([left.value[0], right.value[0]]) == pytest.approx([112.1, 106.9])
    assert np.degrees(left.uncertainty) == pytest.approx([0.5])
    assert observed.motion.time[-1] == 7.0
    assert observed.motion.travel[-1] == pytest.approx(0.028)


def test_parameters_that_cannot_be_simulated_are_told_apart(monkeypatch) -> None:
    from hma_gripper_sim.mechanics.outcome import Outcome, SimulationError
    from hma_gripper_sim.simulation.simulation import Simulation

    def fails(self, *_):
        raise SimulationError(Outcome.NO_EQUILIBRIUM, 0.0)

    motion = follow(0.004, 0.0, 0.0, 1.0)
    point = averaged("phi_left", Series(np.zeros(1), np.zeros(1)), None, 0.05)
    monkeypatch.setattr(Simulation, "__init__", fails)
    assert Trial(motion, (point,)).simulate(SCENE) is None


def test_what_was_recovered_in_a_log_is_passed_on(monkeypatch) -> None:
    from hma_gripper_sim.experiments.experiment import ExperimentLog

    time = np.arange(0.0, 2.0, 0.01)
    noisy = 0.001 * time + np.random.default_rng(0).normal(0.0, 5e-6, len(time))
    recording = Recording(
        "log",
        {"travel": Series(time, noisy), "phi_left": Series(time, np.ones(len(time)))},
        0,
        ("3 samples of travel are NaN",),
    )
    monkeypatch.setattr(ExperimentLog, "recording", recording)
    log = ExperimentLog(Path("log"), None, {})
    experiment = replace(read_experiment("thesis_2013_box"), log=log)
    recovered, scatters = trial(experiment, "box", 1e-6).notes
    assert recovered == "3 samples of travel are NaN"
    assert "scatters" in scatters


def test_a_log_without_force_and_angles_is_refused(tmp_path) -> None:
    from hma_gripper_sim.replay.course import planned
    from hma_gripper_sim.replay.simulated_log import replay
    from hma_gripper_sim.replay.simulated_settings import SimulatedSettings

    parameters = SimulatedSettings.parse({"discretisation": "midpoint", "travel_max": 0.001})
    course = planned(read_experiment("thesis_2013_box").motion[:1], parameters.limits, 0.01)
    replay(course, parameters, tmp_path / "log", 100_000_000)
    file = tmp_path / "blind.yaml"
    file.write_text(
        "{title: T, source: S, scene: {contour: {name: c, type: circle, radius: 15 mm},"
        " clearance: 5 mm, friction: 0.5, contact: continuous}, log: {path: log,"
        " signals: {travel: {topic: /joint_states, field: position, joint: slide}}}}"
    )
    with pytest.raises(InputError, match="blind: has none of actuator_force"):
        trial(read_experiment(file), "blind", 1e-6)
