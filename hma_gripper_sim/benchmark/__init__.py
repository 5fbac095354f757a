"""Speed against error, measured: scenes, peers, references, hard cases, results page.

Nothing is imported here; `command` is the way in.
"""

from __future__ import annotations
