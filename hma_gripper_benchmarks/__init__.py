"""Speed against error, measured: scenes, peers, references, hard cases, results page.

``hma_gripper benchmark`` is the way in.
"""

from __future__ import annotations
