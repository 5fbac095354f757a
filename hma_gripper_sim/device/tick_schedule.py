"""When each tick is due, and the time stamp it carries."""

from __future__ import annotations

MAX_LAG_NS = 100_000_000
"""Lag that is made up by hurrying [ns]; beyond it the timeline starts anew from now."""

MAX_SIMULATED_LAG_NS = 10_000_000_000
"""The same where the clock is simulated [ns]: it goes in steps, and not all of them arrive."""


class Timeline:
    """Paces ticks on the node's clock, and stamps them.

    All times are whole nanoseconds of that clock.

    Stamps start at the clock's time and advance in simulated time: one period per tick that
    moved, whatever the real-time factor, so that their differences are what the physics saw.
    While time stands still the stamp does too. At a factor of 1 stamps are the clock's time as
    well: after a pause or an overrun the next one jumps ahead by the time that was lost, for the
    sake of consumers that compare them with their own clock. At other factors they never jump.
    Where the stamps are the clock of others they are simulated time alone, from 0 on.

    Parameters
    ----------
    period
        Simulated duration of a tick [ns].
    factor
        Simulated seconds per second; 0: as fast as possible.
    is_clock
        Others take their time from the stamps.

    Attributes
    ----------
    max_lag
        Lag that is made up [ns].
    """

    def __init__(self, period: int, factor: float, *, is_clock: bool = False) -> None:
        self.stamp = 0
        self.overruns = 0
        self.max_lag = MAX_LAG_NS
        self._due = 0
        self._period = period
        self._factor = factor
        self._is_clock = is_clock

    def start(self, now: int) -> None:
        """Begin, or begin anew: the first tick is due now, and stamped with it."""
        self._due = now
        if not self._is_clock:
            self.stamp = now - self._period

    def set_rate(self, period: int, factor: float) -> None:
        """Change period [ns] and factor, from the tick after the coming one on."""
        self._period = period
        self._factor = factor

    def until_due(self, now: int) -> int:
        """Time left until the next tick [ns]; 0 or less when it is due.

        A clock that was set back, or that restarts, starts the timeline anew.
        """
        left = self._due - now
        if left > max(self._interval(moving=True), self._period) + MAX_LAG_NS:
            self.start(now)
            return 0
        return left

    def advance(self, now: int, *, moved: bool) -> None:
        """Count a tick that has just been made, and stamp it if time `moved` on in it.

        A lag of more than `max_lag` is given up and counted as an overrun.
        """
        if self._due < now - self.max_lag or self._factor == 0.0:
            self.overruns += self._factor != 0.0
            self._due = now
        if moved:
            self.stamp += self._period
            if self._factor == 1.0 and not self._is_clock:
                self.stamp = max(self.stamp, self._due)
        self._due += self._interval(moving=moved)

    def step(self, now: int) -> None:
        """Stamp a tick that was made on request, outside the pace."""
        self.stamp += self._period
        self._due = max(self._due, now)

    def present(self, now: int) -> int:
        """Time of the present state, on the clock of those who send stamped commands.

        That is the stamp, unless the clock has left it behind: while time stands still, and at a
        factor other than 1.
        """
        in_step = abs(self.accounted(now) - self.stamp) <= self._period + MAX_LAG_NS
        return self.stamp if self._is_clock or in_step else now

    def accounted(self, now: int) -> int:
        """The clock's time [ns] up to which all ticks that were due have been made or given up."""
        return min(now, self._due)

    def _interval(self, *, moving: bool) -> int:
        """Clock time from one tick to the next [ns].

        While time stands still, the state is repeated at the nominal rate at any factor.
        """
        if not moving:
            return self._period
        return round(self._period / self._factor) if self._factor else 0
