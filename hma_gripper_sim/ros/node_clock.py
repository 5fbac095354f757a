"""The node's clock: that of this machine, or with use_sim_time what comes on /clock."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence

from rclpy.clock import Clock

CLOCK_PATIENCE = 3.0
"""How long a simulated clock may stand before that is worth saying [s of this machine]."""

SET_BACKS = 3
"""So often within `CLOCK_PATIENCE` publishers that disagree set a clock back: a restart once."""


class NodeClock:
    """Reads the clock, and notices when a simulated one stands still, or runs to and fro.

    Parameters
    ----------
    clock
        Of the node.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._latest = 0
        self._moved = time.monotonic()
        self._set_backs: deque[tuple[float, int]] = deque(maxlen=SET_BACKS)

    @property
    def simulated(self) -> bool:
        """Whether the time comes from /clock."""
        return bool(self._clock.ros_time_is_active)

    def now(self) -> int:
        """Present time [ns]; a simulated clock stands at 0 until its first message."""
        # The system's clock itself is ten times cheaper than by way of ROS.
        now = int(self._clock.now().nanoseconds) if self.simulated else time.time_ns()
        if now != self._latest:
            moved = time.monotonic()
            if now < self._latest and self.simulated:
                self._set_backs.append((moved, self._latest - now))
            self._latest, self._moved = now, moved
        return now

    def problem(self, publishers: Sequence[str]) -> str:
        """Say what is wrong with the clock at the last reading; empty: nothing.

        Parameters
        ----------
        publishers
            Full names of the nodes that publish /clock, as far as they are known.
        """
        if not self.simulated:
            return ""
        now = time.monotonic()
        sent = f" (published by {' and '.join(publishers)})" if publishers else ""
        backs = self._set_backs
        if len(backs) == SET_BACKS and backs[0][0] > now - CLOCK_PATIENCE:
            back = 1e-9 * max(back for _, back in backs)
            return f"/clock is set back again and again, by {back:.3g} s{sent}"
        if now - self._moved < CLOCK_PATIENCE:
            return ""
        if self._latest == 0:
            return (
                f"use_sim_time is true, but nothing has come on /clock{sent}: the node waits for it"
            )
        return f"/clock stands still at {1e-9 * self._latest:.3f} s{sent}: the node waits for it"
