"""Known parameters are recovered from noisy simulated experiments, within the stated errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, InputError, Scene, Simulation
from hma_gripper_sim.calibration import fitting, observations
from hma_gripper_sim.calibration.fitting import autocorrelation_time, calibrate
from hma_gripper_sim.calibration.free_parameters import PARAMETERS, FreeParameter, free_parameters
from hma_gripper_sim.calibration.observations import AVERAGED, SIGNALS, Trial, averaged
from hma_gripper_sim.calibration.tables import remarks
from hma_gripper_sim.motion.prescribed_motion import follow
from hma_gripper_sim.recordings.recording import Series

TRUTH = Scene(
    GripperDesign.thesis_2013(),
    Circle(0.015),
    friction=0.6,
    clearance=0.005,
    discretisation="midpoint",
    elements_top=1,
    elements_beam=4,
)
MOTION = follow(lambda t: 0.004 if t < 5.0 else 0.0 if t < 6.0 else -0.004, 0.0, 0.0, 11.0)
NOISE = {"actuator_force": 0.01, "phi_left": np.radians(0.3), "phi_right": np.radians(0.3)}


@pytest.fixture(scope="module")
def clean() -> dict[str, Series]:
    trace = Simulation(TRUTH, 1e-5).advance_along(MOTION, 0.01)
    return {name: Series(trace.time, getattr(trace, name)) for name in SIGNALS}


def white(rng: np.random.Generator, size: int) -> np.ndarray:
    return rng.normal(size=size)


def slow(rng: np.random.Generator, size: int) -> np.ndarray:
    """An autoregressive process of unit variance; neighbours at 100 Hz are correlated by 0.98."""
    values = rng.normal(size=size)
    for i in range(1, size):
        values[i] = 0.98 * values[i - 1] + np.sqrt(1.0 - 0.98**2) * values[i]
    return values


def measured(clean: dict[str, Series], seed: int, process=white) -> Trial:
    rng = np.random.default_rng(seed)
    return Trial(
        MOTION,
        tuple(
            averaged(
                name,
                Series(s.time, s.value + NOISE[name] * process(rng, len(s.time))),
                None,
                AVERAGED,
            )
            for name, s in clean.items()
        ),
    )


def wrong() -> tuple[Scene, tuple[FreeParameter, ...]]:
    """A start that is a quarter off."""
    scene = PARAMETERS["youngs_modulus"].put(TRUTH, 7.0e6)
    scene = PARAMETERS["friction"].put(scene, 0.45)
    return scene, free_parameters("friction,E", scene)


def observed(trial: Trial, scene: Scene) -> list[np.ndarray]:
    """What a scene gives for each observation."""
    return trial.observed(trial.simulate(scene))


def deviations(result) -> list[float]:
    """How many standard errors each value is from the truth."""
    return [(f.value - f.free.parameter.of(TRUTH)) / f.standard_error for f in result.parameters]


@pytest.mark.parametrize("process", [white, slow])
def test_parameters_are_recovered_within_their_stated_errors(clean, process) -> None:
    """z = (found - true) / standard error over 8 seeds and 2 parameters.

    Their squares add up to χ² with 16 degrees of freedom: between 5.1 and 34.3 in 99 % of all cases
    if the errors are stated correctly. Correlated noise must be seen to count as fewer samples:
    taken for white its z would be five times larger.
    """
    found, times = [], []
    for seed in range(8):
        scene, free = wrong()
        result = calibrate(scene, measured(clean, seed, process), free)
        assert result.converged
        assert not any(f.at_bound for f in result.parameters)
        found += deviations(result)
        times += [signal.autocorrelation for signal in result.signals]
    # (1 + a) / (1 - a) with a = 0.98⁵ from average to average is 19.8; 220 of them show half of it.
    lowest, highest = (1.0, 1.3) if process is white else (5.0, 25.0)
    assert lowest <= np.median(times) <= highest
    total = sum(z * z for z in found)
    assert 5.1 < total < 34.3, found
    assert np.abs(found).max() < 4.0


def test_error_and_values_are_better_than_before(clean) -> None:
    scene, free = wrong()
    result = calibrate(scene, measured(clean, 1), free)
    force = result.signals[0]
    assert force.rmse_before > 10.0 * force.rmse_after
    friction, modulus = result.parameters
    assert friction.value == pytest.approx(0.6, rel=0.02)
    assert modulus.value == pytest.approx(8.9e6, rel=0.05)
    assert np.diag(result.correlation) == pytest.approx(1.0)
    assert abs(result.correlation[0, 1]) < 0.95


@pytest.mark.parametrize("names", ["friction", "friction,E", "friction,force_delay,angle_bias"])
def test_nothing_is_simulated_twice(clean, monkeypatch, names: str) -> None:
    """Neither where the second search begins, nor for other delays and biases of one scene."""
    scene, _ = wrong()
    scenes = []
    simulate = Trial.simulate

    def noted(self, simulated):
        scenes.append(simulated)
        return simulate(self, simulated)

    monkeypatch.setattr(Trial, "simulate", noted)
    found = calibrate(scene, measured(clean, 1), free_parameters(names, scene))
    values = {(s.friction, s.design.material.youngs_modulus) for s in scenes}
    assert len(values) == len(scenes) == found.simulations


@pytest.mark.parametrize("names", ["friction,E", "friction,clearance,force_delay"])
def test_tighter_search_and_simulation_find_the_same(clean, monkeypatch, names: str) -> None:
    """Far within the standard errors, which are those of 1100 samples with little noise."""
    scene, _ = wrong()
    trial, free = measured(clean, 1), free_parameters(names, scene)
    found = calibrate(scene, trial, free)
    monkeypatch.setattr(observations, "TOLERANCE", 1e-6)
    monkeypatch.setattr(fitting, "ROUGH", 1e-6)
    monkeypatch.setattr(fitting, "FINE", 1e-7)
    for loose, tight in zip(
        found.parameters, calibrate(scene, trial, free).parameters, strict=True
    ):
        assert abs(loose.value - tight.value) < 0.05 * tight.standard_error
        assert loose.standard_error == pytest.approx(tight.standard_error, rel=0.02)


def test_a_bound_that_holds_a_value_is_said(clean) -> None:
    scene, _ = wrong()
    free = free_parameters("friction,E", scene, ["friction=0.3..0.5"])
    friction, _ = calibrate(scene, measured(clean, 1), free).parameters
    assert friction.at_bound
    assert friction.value == pytest.approx(0.5, abs=1e-3)


def test_what_cannot_be_told_is_refused(clean) -> None:
    few = averaged("phi_left", Series(np.array([4.0]), np.array([1.8])), 0.01, AVERAGED)
    scene, free = wrong()
    with pytest.raises(InputError, match="1 measurements cannot tell 2 parameters"):
        calibrate(scene, Trial(MOTION, (few,)), free)
    short = follow(0.004, 0.0, 0.0, 0.5)  # it touches after 1.2 s
    time = np.arange(0.0, 0.5, 0.01)
    angle = averaged("phi_left", Series(time, np.full(len(time), 1.68)), None, AVERAGED)
    with pytest.raises(InputError, match="friction has no effect"):
        calibrate(scene, Trial(short, (angle,)), free)


def test_what_the_data_hardly_show_is_not_told(clean) -> None:
    """A force whose noise is much larger than what friction does to it, and no angles."""
    force = clean["actuator_force"]
    noise = np.random.default_rng(1).normal(scale=50.0, size=len(force.time))
    trial = Trial(
        MOTION,
        (averaged("actuator_force", Series(force.time, force.value + noise), None, AVERAGED),),
    )
    found = calibrate(replace(TRUTH, friction=0.5), trial, free_parameters("friction", TRUTH))
    assert found.untold == ("friction",)
    assert found.parameters[0].standard_error > 3.0 / np.sqrt(12.0)
    said = list(remarks(found))
    assert any("the experiment cannot tell 1 friction" in remark for remark in said)
    assert any("the residual hardly fell" in remark for remark in said)
    assert calibrate(TRUTH, measured(clean, 1), free_parameters("friction", TRUTH)).untold == ()


def delayed(trial: Trial, delay: float, bias: float = 0.0) -> Trial:
    """The force comes into the log so late, and with a bias."""
    force, *angles = trial.observations
    kept = force.time + delay < MOTION.time[-1]
    late = replace(
        force,
        time=force.time[kept] + delay,
        value=force.value[kept] + bias,
        width=force.width[kept],
    )
    return replace(trial, observations=(late, *angles))


@pytest.mark.parametrize("delay", [0.05, 0.2, -0.1])
def test_force_that_is_late_is_noted_and_found(clean, delay: float) -> None:
    trial = delayed(measured(clean, 1), delay)
    alone = calibrate(TRUTH, trial, free_parameters("friction", TRUTH))
    (said,) = [remark for remark in remarks(alone) if "the force seems to come" in remark]
    assert ("ms late" in said) == (delay > 0.0)
    both = calibrate(TRUTH, trial, free_parameters("friction,force_delay,force_bias", TRUTH))
    for fitted, true in zip(both.parameters, (0.6, delay, 0.0), strict=True):
        assert abs(fitted.value - true) < 4.0 * fitted.standard_error, fitted
    assert both.parameters[1].standard_error < 0.01
    assert not any("seems to come" in remark for remark in remarks(both))


def test_biases_are_found(clean) -> None:
    trial = delayed(measured(clean, 2), 0.0, bias=0.05)
    force, left, right = trial.observations
    tilted = tuple(replace(o, value=o.value + np.radians(2.0)) for o in (left, right))
    trial = replace(trial, observations=(force, *tilted))
    found = calibrate(TRUTH, trial, free_parameters("friction,force_bias,angle_bias", TRUTH))
    for fitted, true in zip(found.parameters, (0.6, 0.05, np.radians(2.0)), strict=True):
        assert abs(fitted.value - true) < 4.0 * fitted.standard_error, fitted


def test_on_time_signals_are_not_noted(clean) -> None:
    found = calibrate(TRUTH, measured(clean, 3), free_parameters("friction", TRUTH))
    assert {delay.name for delay in found.delays} == {"force_delay", "angle_delay"}
    assert not any("seems to come" in remark for remark in remarks(found))


def test_directions_are_those_of_the_covariance(clean) -> None:
    scene, free = wrong()
    found = calibrate(scene, measured(clean, 1), free)
    assert [d.singular_value for d in found.directions] == sorted(
        (d.singular_value for d in found.directions), reverse=True
    )
    assert all(np.linalg.norm(d.shares) == pytest.approx(1.0) for d in found.directions)
    rooms = np.array([f.free.upper - f.free.lower for f in found.parameters])
    errors = np.array([f.standard_error for f in found.parameters]) / rooms
    total = sum(d.standard_error**2 for d in found.directions)
    assert total == pytest.approx(float(errors @ errors), rel=1e-9)


def test_signal_that_the_model_does_not_explain_is_named(clean) -> None:
    """φ left of a camera that shows something else."""
    trial = measured(clean, 1)
    force, left, right = trial.observations
    other = replace(left, value=left.value + 0.2 * np.sin(3.0 * left.time))
    trial = replace(trial, observations=(force, other, right))
    said = list(remarks(calibrate(TRUTH, trial, free_parameters("friction", TRUTH))))
    assert [r for r in said if "does not explain" in r and "φ left" in r]
    assert not [r for r in said if "does not explain" in r and "φ right" in r]


def test_stated_uncertainties_carry_over_to_a_single_reading() -> None:
    """One angle, one parameter: the error is that of the reading, over the slope."""
    scene = TRUTH
    motion = follow(0.004, 0.0, 0.0, 3.0)
    free = free_parameters("friction", scene)
    reading = averaged("phi_left", Series(np.array([2.9]), np.array([1.8])), 0.01, 1e-9)
    trial = Trial(motion, (reading,))
    trial = replace(trial, observations=(replace(reading, value=observed(trial, scene)[0]),))
    (found,) = calibrate(scene, trial, free).parameters
    at = [
        observed(trial, PARAMETERS["friction"].put(scene, found.value + d))[0][0]
        for d in (-0.005, 0.005)
    ]
    assert found.standard_error == pytest.approx(0.01 / abs((at[1] - at[0]) / 0.01), rel=0.05)


def test_autocorrelation_time_of_known_processes() -> None:
    """White: 1. Autoregressive with a: (1 + a) / (1 - a)."""
    rng = np.random.default_rng(5)
    assert autocorrelation_time(rng.normal(size=20_000)) == pytest.approx(1.0, abs=0.1)
    values = np.zeros(50_000)
    for i in range(1, len(values)):
        values[i] = 0.8 * values[i - 1] + rng.normal()
    assert autocorrelation_time(values) == pytest.approx(9.0, rel=0.1)
    assert autocorrelation_time(np.zeros(20)) == 1.0
