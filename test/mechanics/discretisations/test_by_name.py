"""Discretisations are found in their room, and one file is all that one takes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from patience import patience

from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS

LOPSIDED = '''
"""Joints at two fifths of GBEs."""

from __future__ import annotations

import numpy as np

from hma_gripper_sim.mechanics.discretisations.base import Discretisation, Partition


class Lopsided(Discretisation):
    """A joint at two fifths of every GBE."""

    name = "lopsided"
    column_error = (1.0, 1)

    def partition(self, elements: int) -> Partition:
        """Joints at two fifths of equal GBEs."""
        return Partition((np.arange(elements) + 0.4) / elements, np.full(elements, 1.0 / elements))

    def tangent_weights(self, elements: int, at: np.ndarray) -> np.ndarray:
        """The curvature is constant over a GBE."""
        return np.clip(np.asarray(at)[:, None] * elements - np.arange(elements), 0.0, 1.0)
'''

USES = """
import sys
from hma_gripper_sim.mechanics import discretisations

discretisations.__path__.append(sys.argv[1])
from hma_gripper_sim import Circle, GripperDesign, Scene, simulate
from hma_gripper_sim.device.settings import Settings

design, largest = GripperDesign.thesis_2013(), []
for kind in ("midpoint", "lopsided"):
    scene = Scene(design, Circle(0.015), discretisation=kind, elements_top=2, elements_beam=8)
    trace = simulate(scene, 0.004, 3.0)
    assert trace.energy.relative_residual < 1e-3
    largest.append(trace.actuator_force.max())
print(abs(largest[1] / largest[0] - 1.0))
Settings.parse({"discretisation": "lopsided", "elements_top": 2, "elements_beam": 8})
"""


def test_the_lowest_order_comes_first() -> None:
    orders = [each.column_error[1] for each in DISCRETISATIONS.values()]
    assert orders == sorted(orders)
    assert {"thesis": 1, "midpoint": 2, "gauss": 4}.items() <= {
        name: each.column_error[1] for name, each in DISCRETISATIONS.items()
    }.items()


def test_a_new_discretisation_is_one_new_file(tmp_path: Path) -> None:
    """Scenes and the node's parameters know it; joints a tenth of a GBE off cost a few percent."""
    (tmp_path / "lopsided.py").write_text(LOPSIDED)
    done = subprocess.run(
        [sys.executable, "-c", USES, str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=patience(300.0),
    )
    assert done.returncode == 0, done.stderr
    assert 1e-4 < float(done.stdout) < 0.1
