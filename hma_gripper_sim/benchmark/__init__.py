"""Speed against error, measured: scenes, peers, references, hard cases, results page.

Nothing is imported here; `hma_gripper_sim.cli.benchmark` is the way in.
"""

from __future__ import annotations
