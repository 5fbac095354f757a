"""Peers are set up well enough to be compared with: they reach the errors that are known."""

from __future__ import annotations

import pytest

from hma_gripper_benchmarks import peers, this_package
from hma_gripper_benchmarks.cantilever import exact_deflection, loaded_chain
from hma_gripper_benchmarks.scenes import tasks
from hma_gripper_benchmarks.series import deviation


def load(name):
    if peers.installed_version(name) is None:
        pytest.skip(f"{name} is not installed")
    return peers.load(name)


@pytest.fixture(scope="module")
def reference():
    return this_package.reference(tasks()["cylinder_sampled"], full=False)


@pytest.mark.parametrize(
    ("name", "setting", "rms", "largest"),
    [
        ("MuJoCo", "discrete + PGS, 1 ms", 0.004, 0.094),
        ("MuJoCo", "implicitfast + PGS, 0.2 ms", 0.0006, 0.012),
        ("Exudyn", "generalised-α ρ∞ = 0, 5 ms", 0.0131, 0.46),
        ("scipy", "Radau, tolerance 1e-03", 0.0004, 0.01),
    ],
)
def test_a_peer_reaches_its_known_error_on_the_cylinder(name, setting, rms, largest, reference):
    task = tasks()["cylinder_sampled"]
    candidates = load(name).candidates(task, full=False)
    candidate = next(item for item in candidates if item.setting == setting)
    found = deviation(candidate.series(candidate.run()), reference)
    assert found.force_rms <= rms
    assert found.force_max <= largest


def test_mujoco_holds_with_little_creep():
    task = tasks()["hold"]
    reference = this_package.reference(task, full=False)
    candidates = load("MuJoCo").candidates(task, full=True)
    errors = [deviation(item.series(item.run()), reference).force_rms for item in candidates]
    assert min(errors) < 0.002


@pytest.mark.parametrize("name", ["MuJoCo", "Exudyn"])
def test_a_peer_finds_the_rest_of_the_cantilever(name):
    for run in load(name).cantilever_runs(loaded_chain(20), 9.81, 1.0).values():
        assert run() == pytest.approx(exact_deflection(20), rel=1e-4)


def test_mujoco_cannot_express_forces_along_the_tips_normals():
    assert load("MuJoCo").candidates(tasks()["box_sampled"], full=True) == []
