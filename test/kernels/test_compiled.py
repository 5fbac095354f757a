"""The kernels without numba: the same results, more slowly, and one line that says so."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
from patience import patience

from hma_gripper_sim import GripperDesign, RoundedBox, Scene, simulate
from hma_gripper_sim.analysis import cantilever_deflection
from hma_gripper_sim.kernels.compiled import COMPILED

PLAIN = """
import json, sys, warnings
sys.modules["numba"] = None  # makes `import numba` fail
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from hma_gripper_sim import GripperDesign, RoundedBox, Scene, simulate
    from hma_gripper_sim.analysis import cantilever_deflection
    from hma_gripper_sim.kernels.compiled import COMPILED
results = {}
for contact in ("continuous", "sampled"):
    scene = Scene(GripperDesign.thesis_2013(), RoundedBox(0.028, 0.028, 0.002), contact=contact,
                  discretisation="midpoint", clearance=0.001, offset=0.001)
    trace = simulate(scene, 0.004, 1.0, sample_period=0.01)
    results[contact] = [trace.actuator_force.tolist(), trace.joint_position.tolist()]
json.dump({
    "compiled": COMPILED,
    "warnings": [(w.category.__name__, str(w.message)) for w in caught],
    "results": results,
    "deflection": cantilever_deflection(10),
}, sys.stdout)
"""


def test_plain_python_gives_the_same_results() -> None:
    """A second of pressing on the box, off its axis, both contact models; a cantilever.

    The same arithmetic in the same order: equal to 1e-7 N and 1e-9 rad (compiled code may contract
    a product and a sum, which shifts where within 0.2 µs an event is met).  One warning of one
    line names the remedy.
    """
    if not COMPILED:
        pytest.skip("numba is missing or switched off: there is nothing to compare with")
    run = subprocess.run(
        [sys.executable, "-c", PLAIN],
        capture_output=True,
        text=True,
        check=True,
        timeout=patience(300.0),
    )
    plain = json.loads(run.stdout)
    assert plain["compiled"] is False
    ours = [text for category, text in plain["warnings"] if category == "RuntimeWarning"]
    assert len(ours) == 1
    assert "\n" not in ours[0]
    assert "pip install numba" in ours[0]
    for contact, (force, position) in plain["results"].items():
        scene = Scene(
            GripperDesign.thesis_2013(),
            RoundedBox(0.028, 0.028, 0.002),
            contact=contact,
            discretisation="midpoint",
            clearance=0.001,
            offset=0.001,
        )
        trace = simulate(scene, 0.004, 1.0, sample_period=0.01)
        np.testing.assert_allclose(force, trace.actuator_force, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(position, trace.joint_position, rtol=0.0, atol=1e-9)
        assert np.ptp(trace.actuator_force) > 0.1
    assert plain["deflection"] == pytest.approx(cantilever_deflection(10), rel=1e-12)
