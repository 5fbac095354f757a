"""What the node reports about itself, and at which level."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation
from hma_gripper_sim.device.arbitration import SourceCounts
from hma_gripper_sim.device.drive import DriveStatus
from hma_gripper_sim.results.validity import Finding, Severity

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from builtin_interfaces.msg import Time

from hma_gripper_sim.ros.diagnostics import ERROR, OK, STALE, WARN, Diagnostics, Pace

DESIGN = GripperDesign.thesis_2013()
SIMULATION = Simulation(Scene(DESIGN, Circle(0.015)))
FINE = DriveStatus(
    contour="box", source="commands", following=False, paused=False, failure=None, stale=False,
    clamped=False, at_limit=False, ticks=7, clamps=0, timeouts=0,
)  # fmt: skip


def report(
    diagnostics,
    status=FINE,
    counts=None,
    validity=(),
    overruns=0,
    moved=100,
    factor=1.0,
    moment=0.0,
    clock_elapsed=1.0,
    clock_problem="",
    company=(),
):
    """Levels and statuses by part, of a second in which so many ticks of 10 ms moved."""
    state = replace(SIMULATION.state(), moment_left=moment)
    pace = Pace()
    for i in range(100):
        pace.add(state, 0.002, moved=i < moved)
    message = diagnostics.report(
        Time(), status, counts or {}, SIMULATION.snapshot(), validity, pace, overruns,
        period=0.01, factor=factor, elapsed=1.0, clock_elapsed=clock_elapsed,
        clock_problem=clock_problem, company=company,
    )  # fmt: skip
    parts = {item.name.split(": ")[1]: item for item in message.status}
    assert set(parts) == {"drive", "timing", "solver", "stress", "validity", "graph"}
    return {name: item.level for name, item in parts.items()}, parts


def values(status):
    return {pair.key: pair.value for pair in status.values}


@pytest.fixture
def diagnostics():
    return Diagnostics("hma_gripper_sim", DESIGN)


def test_all_is_well(diagnostics):
    levels, parts = report(diagnostics)
    assert set(levels.values()) == {OK}
    assert parts["drive"].message == "commands is in charge"
    assert values(parts["timing"])["real-time factor"] == "1.0000"
    assert values(parts["timing"])["mean duration of a tick [ms]"] == "2.000"
    assert all(item.hardware_id == "hma_gripper_sim" for item in parts.values())


@pytest.mark.parametrize(
    ("change", "part", "level", "text"),
    [
        ({"source": ""}, "drive", OK, "no command yet"),
        ({"paused": True}, "drive", OK, "paused"),
        ({"stale": True}, "drive", STALE, "within command_timeout"),
        ({"clamped": True}, "drive", WARN, "max_velocity"),
        ({"at_limit": True}, "drive", WARN, "travel limit"),
        ({"failure": "no way on"}, "solver", ERROR, "no way on; ~/reset"),
    ],
)
def test_what_the_drive_does_decides_the_level(diagnostics, change, part, level, text):
    levels, parts = report(diagnostics, FINE._replace(**change))
    assert levels[part] == level
    assert text in parts[part].message


def test_refused_commands_warn_once_and_are_counted_by_source(diagnostics):
    counts = {"commands": SourceCounts(5, 2, 1)}
    levels, parts = report(diagnostics, counts=counts)
    assert levels["drive"] == WARN
    shown = values(parts["drive"])
    assert [shown[f"commands: {key}"] for key in ("accepted", "rejected", "out of date")] == [
        "5", "2", "1",
    ]  # fmt: skip
    assert report(diagnostics, counts=counts)[0]["drive"] == OK


def test_slowness_is_counted_on_the_nodes_clock(diagnostics):
    """A simulated clock at a tenth of real time is not the node's fault, nor is one that stands."""
    levels, parts = report(diagnostics, moved=10, clock_elapsed=0.1)
    assert levels["timing"] == OK
    assert parts["timing"].message == "0.10 times real time"
    assert report(diagnostics, moved=0, clock_elapsed=0.0)[0]["timing"] == OK
    assert report(diagnostics, moved=100, clock_elapsed=2.0)[0]["timing"] == WARN


def test_a_clock_that_stands_and_company_that_is_in_the_way_warn(diagnostics):
    levels, parts = report(diagnostics, clock_problem="/clock stands", company=("a", "b"))
    assert levels["timing"] == levels["graph"] == WARN
    assert parts["timing"].message == "/clock stands"
    assert values(parts["graph"])["in the way"] == "a; b"


def test_overruns_and_slowness_warn(diagnostics):
    assert report(diagnostics, overruns=2)[0]["timing"] == WARN
    assert report(diagnostics, overruns=2)[0]["timing"] == OK
    assert report(diagnostics, overruns=2, moved=50)[0]["timing"] == WARN
    assert report(diagnostics, overruns=2, moved=50, factor=0.0)[0]["timing"] == OK
    # While paused no time is wanted to pass.
    assert report(diagnostics, FINE._replace(paused=True), overruns=2, moved=0)[0]["timing"] == OK


@pytest.mark.parametrize(("share", "level"), [(0.9, OK), (1.1, WARN)])
def test_stress_beyond_the_linear_range_warns(diagnostics, share, level):
    # Thesis Eq. 5.1: stress = M (w / 2) / I, of a section w thick and h high, I = h w³ / 12.
    inertia = DESIGN.height * DESIGN.width**3 / 12
    moment = share * DESIGN.material.stress_limit * inertia / (DESIGN.width / 2)
    levels, parts = report(diagnostics, moment=moment)
    assert levels["stress"] == level
    assert f"{100 * share:.0f} %" in parts["stress"].message


def test_validity_warns_of_the_worst_and_names_all(diagnostics):
    note = Finding("discretisation", Severity.NOTE, "a coarse one")
    assert report(diagnostics, validity=(note,))[0]["validity"] == OK
    deep = Finding("penetration", Severity.WARNING, "2 mm deep", 1.0)
    parts = [Finding("unmodelled_contact", Severity.WARNING, text) for text in ("left", "right")]
    levels, found = report(diagnostics, validity=(deep, *parts, note))
    assert levels["validity"] == WARN
    assert found["validity"].message == "2 mm deep"
    assert values(found["validity"]) == {
        "penetration": "2 mm deep",
        "unmodelled contact": "left; right",
        "discretisation": "a coarse one",
        "sampled contour": "none",
    }
