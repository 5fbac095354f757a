"""Runs compared with experiments, on recordings whose figures are known by construction."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from hma_gripper_sim import GripperDesign, InputError, config_directory
from hma_gripper_sim.comparison.experiment_criteria import (
    MAX_TRAVEL_ERROR,
    Comparison,
    align,
    compare,
)
from hma_gripper_sim.experiments.experiment import Criterion
from hma_gripper_sim.experiments.experiment_file import read_experiment
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series

EXPERIMENT = read_experiment(config_directory() / "experiments" / "thesis_2013_box.yaml")
DESIGN = GripperDesign.thesis_2013()
VELOCITY, DEPTH = 0.004, 0.028  # m/s, m: the experiment's approach


def phi_of(travel: FloatArray) -> FloatArray:
    """An angle [rad] that depends on the travel alone, and keeps changing to the end."""
    return np.radians(97.0 + 10.0 * (travel / DEPTH) ** 2)


def recorded(travel: FloatArray, time: FloatArray) -> Recording:
    """A recording in which force and moment are 1 at 12 mm and fall off to both sides."""
    bump = np.exp(-(((travel - 0.012) / 0.003) ** 2))
    values = {
        "travel": travel,
        "phi_left": phi_of(travel) + 0.02,
        "phi_right": phi_of(travel) - 0.02,
        "actuator_force": 0.7 * bump,
        "bending_moment": 5e-3 * bump,
    }
    series = {name: Series(time, value) for name, value in values.items()}
    return Recording("made up", series, start=5_000_000_000)


def pick_up(*, delay: float = 0.0, ramp: float = 0.0, depth: float = DEPTH) -> Recording:
    """Down to `depth` and up again, `delay` [s] late, the velocity rising over `ramp` [s]."""
    time = np.arange(0.0, 16.0 + delay, 0.01)
    moving = np.clip(time - delay, 0.0, None)
    risen = np.minimum(moving, ramp)
    down = VELOCITY * (moving - risen + (0.5 * risen**2 / ramp if ramp else 0.0))
    return recorded(np.where(down <= depth, down, np.maximum(2 * depth - down, 0.0)), time)


def figures(recording: Recording) -> dict[tuple[str, float], float]:
    comparisons = compare(align(recording, EXPERIMENT, DESIGN), EXPERIMENT)
    return {(c.criterion.figure, c.criterion.time): c.value for c in comparisons}


def test_figures_are_read_off_the_approach() -> None:
    """Samples every 10 ms and values linear between them: 1e-6 relative for the bump's peak."""
    found = figures(pick_up())
    assert found["phi_mean", 7.0] == pytest.approx(math.radians(107.0), rel=1e-9)
    assert found["phi_left", 7.0] - found["phi_right", 7.0] == pytest.approx(0.04)
    assert found["phi_mean", 0.0] == pytest.approx(math.radians(97.0))
    assert found["peak_actuator_force", 7.0] == pytest.approx(0.7, rel=1e-6)
    assert found["peak_actuator_force_time", 7.0] == pytest.approx(3.0)
    assert found["max_bending_moment", 7.0] == pytest.approx(5e-3, rel=1e-6)
    assert found["max_stress", 7.0] == pytest.approx(DESIGN.bending_stress(5e-3), rel=1e-6)
    assert found["travel_error", 7.0] == pytest.approx(0.0, abs=1e-12)
    assert found["longest_gap", 7.0] == pytest.approx(0.01)


def test_delay_ramp_and_late_reversal_change_nothing() -> None:
    """The instants of an experiment are found by how far the gripper has come.

    A ramp of T to v costs v T / 2 of travel, which the alignment takes for T / 2 of delay; then
    every later instant sees the same travel as without a ramp.
    """
    plain = figures(pick_up())
    for recording in (
        pick_up(delay=0.37),
        pick_up(delay=0.37, ramp=0.1),
        pick_up(depth=DEPTH + 0.0004),
    ):
        shifted = figures(recording)
        for key in plain:
            if key[1] > 0.0:
                assert shifted[key] == pytest.approx(plain[key], rel=1e-3, abs=1e-9), key
        assert shifted["phi_mean", 7.0] == pytest.approx(plain["phi_mean", 7.0], rel=1e-9)


def test_time_zero_is_the_start_of_the_motion() -> None:
    """Stamps of the recording can be computed from the experiment's time."""
    run = align(pick_up(delay=0.37), EXPERIMENT, DESIGN)
    assert run.recording.start == pytest.approx(5_370_000_000, abs=1000)
    assert run.recording["travel"].at(3.5) == pytest.approx(DEPTH / 2)


def test_lift_does_not_count_for_figures_of_the_approach() -> None:
    recording = pick_up()
    for name in ("actuator_force", "bending_moment"):
        recording[name].value[recording[name].time > 7.5] = 9.0
    found = figures(recording)
    assert found["peak_actuator_force", 7.0] == pytest.approx(0.7, rel=1e-6)
    assert found["max_bending_moment", 7.0] == pytest.approx(5e-3, rel=1e-6)


def test_interrupted_approach_is_outside_its_bound() -> None:
    """A stop of 0.1 s at half depth sets the travel back by 0.4 mm against the motion.

    The best offset halves that: 0.2 mm, twice the bound.
    """
    time = np.arange(0.0, 8.0, 0.01)
    moving = time - np.clip(time - 3.5, 0.0, 0.1)
    stopped = recorded(np.minimum(VELOCITY * moving, DEPTH), time)
    comparisons = compare(align(stopped, EXPERIMENT, DESIGN), EXPERIMENT)
    (followed,) = (c for c in comparisons if c.criterion.figure == "travel_error")
    assert followed.value == pytest.approx(2e-4, rel=0.2)
    assert followed.value > MAX_TRAVEL_ERROR
    assert not followed.inside


def test_hole_in_the_record_is_outside_its_bound() -> None:
    """What happened in it is unknown. A single lost sample is not that; a tenth of a second is."""
    whole = pick_up()
    for lost, inside in ((1, True), (10, False)):
        kept = np.ones(whole["actuator_force"].time.size, dtype=bool)
        kept[300 : 300 + lost] = False
        force = Series(*(a[kept] for a in dataclasses.astuple(whole["actuator_force"])))
        holed = dataclasses.replace(whole, signals={**whole.signals, "actuator_force": force})
        comparisons = compare(align(holed, EXPERIMENT, DESIGN), EXPERIMENT)
        (gap,) = (c for c in comparisons if c.criterion.figure == "longest_gap")
        assert gap.value == pytest.approx(0.01 * (lost + 1))
        assert gap.inside is inside


@pytest.mark.parametrize("depth", [0.0, 0.02])
def test_approach_that_is_not_covered_is_refused(depth: float) -> None:
    with pytest.raises(InputError, match="the approach goes from 0 to 28 mm") as caught:
        align(pick_up(depth=depth), EXPERIMENT, DESIGN)
    assert (caught.value.source, caught.value.field) == ("made up", "travel")


def test_recording_that_starts_half_way_is_refused() -> None:
    whole = pick_up()
    half = {n: Series(s.time[400:], s.value[400:]) for n, s in whole.signals.items()}
    with pytest.raises(InputError, match="from 16 to 28 mm"):
        align(dataclasses.replace(whole, signals=half), EXPERIMENT, DESIGN)


@pytest.mark.parametrize(
    ("value", "inside"),
    [(0.98, False), (0.99, True), (1.01, True), (1.02, False), (math.nan, False)],
)
def test_bounds_decide(value: float, inside: bool) -> None:
    criterion = Criterion("phi_mean", 7.0, 1.0, 0.985, 1.015, "here")
    comparison = Comparison(criterion, value)
    assert comparison.judged
    assert comparison.inside is inside
    if inside:
        assert comparison.relative_error == pytest.approx(0.01)


def test_figure_without_a_bound_is_not_judged() -> None:
    comparison = Comparison(Criterion("phi_left", 7.0, 1.0, -math.inf, math.inf, "here"), 5.0)
    assert comparison.inside
    assert not comparison.judged
    assert comparison.relative_error == pytest.approx(4.0)


def test_error_relative_to_nothing_is_not_given() -> None:
    assert (
        Comparison(Criterion("actuator_force", 7.0, 0.0, -1.0, 1.0, "h"), 0.5).relative_error
        is None
    )


def test_figure_outside_the_record_is_not_inside() -> None:
    """A signal that ends early has no value at the instant, and a value that is missing fails."""
    recording = pick_up()
    cut = recording["phi_left"].between(0.0, 5.0)
    recording = dataclasses.replace(recording, signals={**recording.signals, "phi_left": cut})
    comparisons = compare(align(recording, EXPERIMENT, DESIGN), EXPERIMENT)
    failed = {(c.criterion.figure, c.criterion.time): c.value for c in comparisons if not c.inside}
    assert math.isnan(failed["phi_mean", 7.0])
    assert failed["longest_gap", 7.0] == pytest.approx(2.0)
