"""The node's clock: that of this machine, or with use_sim_time what comes on /clock."""

from __future__ import annotations

import time

from rclpy.clock import Clock

CLOCK_PATIENCE = 3.0
"""How long a simulated clock may stand before that is worth saying [s of this machine]."""


class NodeClock:
    """Reads the clock, and notices when a simulated one stands still.

    Parameters
    ----------
    clock
        Of the node.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._latest = 0
        self._moved = time.monotonic()

    @property
    def simulated(self) -> bool:
        """Whether the time comes from /clock."""
        return bool(self._clock.ros_time_is_active)

    def now(self) -> int:
        """Present time [ns]; a simulated clock stands at 0 until its first message."""
        # The system's clock itself is ten times cheaper than by way of ROS.
        now = int(self._clock.now().nanoseconds) if self.simulated else time.time_ns()
        if now != self._latest:
            self._latest, self._moved = now, time.monotonic()
        return now

    @property
    def problem(self) -> str:
        """What is wrong with the clock at the last reading; empty: nothing."""
        stood = time.monotonic() - self._moved
        if not self.simulated or stood < CLOCK_PATIENCE:
            return ""
        if self._latest == 0:
            return "use_sim_time is true, but nothing has come on /clock: the node waits for it"
        return f"/clock stands still at {1e-9 * self._latest:.3f} s: the node waits for it"
