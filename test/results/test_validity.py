"""Where a run leaves its model: each finding in a scene that has it, none in those that do not."""

from __future__ import annotations

import dataclasses
import pickle
import warnings

import pytest

from hma_gripper_sim import (
    Circle,
    Contour,
    Finding,
    GripperDesign,
    InputError,
    Outcome,
    PenetrationWarning,
    RoundedBox,
    Scene,
    Severity,
    SimulationError,
    ToleranceWarning,
    Trace,
    UnmodelledContactWarning,
    simulate,
)
from hma_gripper_sim.results.error_estimate import ErrorEstimate
from hma_gripper_sim.results.observation import join
from hma_gripper_sim.results.validity import findings, remarks


def run(scene: Scene, velocity: float = 0.004, duration: float = 7.0) -> Trace:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return simulate(scene, velocity, duration)


def named(trace: Trace, name: str) -> list[Finding]:
    return [finding for finding in trace.validity if finding.name == name]


@pytest.mark.parametrize("contact", ["continuous", "sampled"])
@pytest.mark.parametrize("contour", [RoundedBox(0.028, 0.028, 0.002), Circle(0.015)])
def test_the_scenes_of_the_thesis_are_within_the_model(
    design: GripperDesign, contour: Contour, contact: str
) -> None:
    """Nothing is found, and nothing is warned of: 28 mm down on the box and the cylinder."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        trace = simulate(Scene(design, contour, contact=contact, clearance=0.004), 0.004, 7.0)
    assert trace.validity == ()
    assert 1e-6 < trace.max_penetration < 1e-4


def test_a_deep_penetration_is_warned_of_with_the_stiffness_that_would_do(
    design: GripperDesign,
) -> None:
    """A contact as soft as 300 N/m; the stiffness in the warning keeps it below a tenth of 2 mm."""
    scene = Scene(design, Circle(0.015), normal_stiffness=300.0)
    with pytest.warns(PenetrationWarning) as caught:
        trace = simulate(scene, 0.004, 7.0)
    (found,) = named(trace, "penetration")
    assert found.severity is Severity.WARNING
    warning = caught[0].message
    assert isinstance(warning, PenetrationWarning)
    assert found.message == str(warning)
    assert warning.depth == trace.max_penetration > 0.2e-3
    assert found.time == warning.time == trace.penetration_time
    assert f"{1e3 * warning.depth:.3g} mm" in found.message
    stiffer = dataclasses.replace(scene, normal_stiffness=warning.stiffness)
    assert named(run(stiffer), "penetration") == []


def test_the_linear_range_of_the_material(design: GripperDesign) -> None:
    """With a limit of 0.1 MPa the box leaves it, when the stress of the samples passes it."""
    weak = dataclasses.replace(
        design, material=dataclasses.replace(design.material, stress_limit=1e5)
    )
    trace = run(Scene(weak, RoundedBox(0.028, 0.028, 0.002), clearance=0.004))
    (found,) = named(trace, "stress")
    assert found.time is not None
    row = int(trace.time.searchsorted(found.time))
    moments = trace.largest_moments("right")
    assert weak.bending_stress(moments[row]) > 1e5 >= weak.bending_stress(moments[row - 1])
    assert f"{trace.stress_ratio:.3g} times" in found.message
    assert trace.stress_ratio > 1.0


def test_an_object_that_is_not_reached(design: GripperDesign) -> None:
    """2 mm short of it, less what the beams hang down by."""
    (found,) = named(run(Scene(design, Circle(0.015)), duration=0.75), "no_contact")
    assert found.severity is Severity.NOTE
    assert "never touched: the tips came within 1." in found.message


@pytest.mark.parametrize(("offset", "where"), [(0.0, "between"), (0.1, "beside")])
def test_an_object_that_is_passed(design: GripperDesign, offset: float, where: str) -> None:
    """A bar of 4 mm between the tips, or far beside them."""
    trace = run(Scene(design, RoundedBox(0.004, 0.01), offset=offset))
    (found,) = named(trace, "no_contact")
    assert f"passed {where} the tips" in found.message


def test_a_plate_between_sampled_points(design: GripperDesign) -> None:
    """Thinner than their spacing of 3.05 mm: it may go through.  The continuous contour sees it."""
    plate = Scene(design, RoundedBox(0.002, 0.06), offset=0.01, contact="sampled")
    (found,) = named(run(plate), "sampled_contour")
    assert found.severity is Severity.WARNING
    assert "3.05 mm apart" in found.message
    assert "2 mm thin" in found.message
    assert named(run(dataclasses.replace(plate, contact="continuous")), "sampled_contour") == []


def test_a_sharp_corner_between_sampled_points(design: GripperDesign) -> None:
    """Half as deep as the points are apart; that is only a note."""
    scene = Scene(design, RoundedBox(0.028, 0.028), clearance=0.004, contact="sampled")
    (found,) = named(run(scene), "sampled_contour")
    assert found.severity is Severity.NOTE
    assert "1.52 mm" in found.message


def test_parts_that_the_contact_model_leaves_out(design: GripperDesign) -> None:
    """One finding for each warning, with its time."""
    trace = run(Scene(design, RoundedBox(0.028, 0.12, 0.002), clearance=0.004), duration=20.0)
    found = named(trace, "unmodelled_contact")
    assert [finding.message for finding in found] == [str(touch) for touch in trace.warnings]
    assert [finding.time for finding in found] == [touch.time for touch in trace.warnings]
    assert found


@pytest.mark.parametrize(
    ("discretisation", "said"), [("thesis", True), ("midpoint", False), ("gauss", False)]
)
def test_the_price_of_the_thesis_discretisation(
    design: GripperDesign, discretisation: str, said: bool
) -> None:
    """It is said where another design than the thesis' meets the thesis' discretisation."""
    longer = dataclasses.replace(design, beam_length=0.05)
    scene = Scene(longer, Circle(0.015), discretisation=discretisation)
    trace = run(scene, duration=0.1)
    found = named(trace, "discretisation")
    assert bool(found) == said
    assert all(finding.severity is Severity.NOTE for finding in found)


ESTIMATE = ErrorEstimate(
    1e-3, 1e-2, 1e-4, 1e-3, 2.5, 0.031, 1e-3, ("the moved run ended early",), None, None
)


def test_outcome_sensitivity_and_failed_companions(design: GripperDesign) -> None:
    """The outcome comes first; the remarks start with the estimate."""
    scene = Scene(dataclasses.replace(design, beam_length=0.05), Circle(0.015))
    observed = dataclasses.replace(
        run(scene, duration=2.0).observed, outcome=Outcome.STEP_TOO_SMALL, end=1.25
    )
    found = findings(scene, observed, ESTIMATE)
    assert (found[0].name, found[0].severity, found[0].time) == ("outcome", Severity.ERROR, 1.25)
    assert Outcome.STEP_TOO_SMALL.remedy in found[0].message
    by_name = {finding.name: finding for finding in found}
    assert by_name["sensitive"].time == 2.5
    assert by_name["verification"].message == "the moved run ended early"
    assert "here it is 3.1 %" in by_name["discretisation"].message
    lines = remarks(found, ESTIMATE)
    assert "force 0.1 % RMS" in lines[0]
    assert lines[1:] == tuple(map(str, found))


def test_parts_of_a_run_are_judged_together(design: GripperDesign) -> None:
    """The deepest, the first and the last of them; touched if any part is."""
    scene = Scene(design, Circle(0.015))
    one = run(scene, duration=0.5).observed
    two = dataclasses.replace(
        one, touched=True, penetration=3e-4, penetration_time=0.7, overstress_time=0.9, end=1.0
    )
    three = dataclasses.replace(one, penetration=2e-4, overstress_time=1.2, end=1.5)
    joined = join([one, two, three])
    assert (joined.touched, joined.end) == (True, 1.5)
    assert (joined.penetration, joined.penetration_time) == (3e-4, 0.7)
    assert joined.overstress_time == 0.9
    assert join([one]) == one


def test_warnings_and_errors_pass_between_processes() -> None:
    """Pickled and read again they say the same: a pool of processes hands them on."""
    scene = Scene(GripperDesign.thesis_2013(), Circle(0.015))
    for said in (
        ToleranceWarning(2.5),
        PenetrationWarning(scene, 0.003, 1.0),
        UnmodelledContactWarning("top beam", "right", 1.0, (0.001, -0.02)),
        SimulationError(Outcome.STEP_TOO_SMALL, 1.5),
        InputError("must be positive", field="contour.width", source="a.yaml"),
    ):
        again = pickle.loads(pickle.dumps(said))
        assert (type(again), str(again)) == (type(said), str(said))
        assert {**vars(again)} == {**vars(said)}
