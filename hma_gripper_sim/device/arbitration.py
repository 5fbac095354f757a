"""Several sources of commands for one drive: the last one that sent is in charge.

Every source passes the same checks. A command that cannot be used is counted for its source and
changes nothing, not even who is in charge.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from hma_gripper_sim.device.drive import Drive
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.motion.trajectory import Trajectory

MAX_AHEAD_NS = 500_000_000
"""How far a velocity's stamp may be ahead of the clock [ns]: clocks of other machines differ."""

MAX_WAIT_NS = 60_000_000_000
"""How far a trajectory's stamp may be ahead [ns]: beyond it, it is of another clock."""


@dataclass(frozen=True)
class VelocityCommand:
    """Move at a velocity [m/s, towards the object].

    Attributes
    ----------
    stamp
        When it was sent [ns]; 0: now.
    """

    velocity: float
    stamp: int = 0


@dataclass(frozen=True)
class PositionCommand:
    """Go to a travel [m], as fast as the drive may, and stay there.

    Attributes
    ----------
    stamp
        When it was sent [ns]; 0: now.
    """

    travel: float
    stamp: int = 0


@dataclass(frozen=True)
class TrajectoryCommand:
    """Follow a trajectory.

    Attributes
    ----------
    stamp
        When it starts [ns]; 0: now.
    """

    trajectory: Trajectory
    stamp: int = 0


Command = VelocityCommand | PositionCommand | TrajectoryCommand


@dataclass
class SourceCounts:
    """How many commands of one source were taken, rejected as unusable, dropped as out of date."""

    accepted: int = 0
    rejected: int = 0
    outdated: int = 0


class OutdatedError(InputError):
    """A command whose stamp says that it comes too late or out of order."""


class Arbiter:
    """Passes the commands of several sources on to a drive.

    Stamped commands are dropped as out of date by these rules. A velocity or a travel: its stamp is
    earlier than one already taken from the same source, older than the command timeout (a velocity
    would have expired), or more than `MAX_AHEAD_NS` in the future. A trajectory: its last point has
    passed, or it would begin more than `MAX_WAIT_NS` from now. Otherwise its stamp may lie in the
    past or in the future, and in any order, since it says when to start.

    Parameters
    ----------
    drive
        What is commanded.
    sources
        Names of the sources.
    """

    def __init__(self, drive: Drive, sources: Iterable[str]) -> None:
        self._drive = drive
        self._counts = {source: SourceCounts() for source in sources}
        self._newest = dict.fromkeys(self._counts, 0)

    @property
    def counts(self) -> Mapping[str, SourceCounts]:
        """What became of the commands of each source."""
        return MappingProxyType(self._counts)

    def take(self, source: str, command: Command, now: int, lag: int = 0) -> None:
        """Put a command into force.

        Parameters
        ----------
        now
            Time of the present state, on the clock of the stamps [ns].
        lag
            How far the senders' clock is ahead of it, while ticks are made up [ns].

        Raises
        ------
        InputError
            It cannot be used: counted, nothing else changes.
        """
        counts = self._counts[source]
        try:
            if isinstance(command, TrajectoryCommand):
                self._follow(source, command, now)
            else:
                self._check_stamp(source, command.stamp, now, lag)
                if isinstance(command, VelocityCommand):
                    self._drive.command(command.velocity, source)
                else:
                    self._drive.go_to(command.travel, source)
                self._newest[source] = command.stamp or self._newest[source]
        except OutdatedError:
            counts.outdated += 1
            raise
        except InputError:
            counts.rejected += 1
            raise
        counts.accepted += 1

    def reject(self, source: str) -> None:
        """Count a message of a source that is no command at all."""
        self._counts[source].rejected += 1

    def _check_stamp(self, source: str, stamp: int, now: int, lag: int) -> None:
        latest = now + lag + MAX_AHEAD_NS
        if self._newest[source] > latest:  # the clock has been set back
            self._newest[source] = 0
        timeout = self._drive.limits.command_timeout
        if stamp == 0:
            return
        if stamp < self._newest[source]:
            raise OutdatedError("is earlier than that of a command already taken", field="stamp")
        if stamp > latest:
            raise OutdatedError(f"is {1e-9 * (stamp - now):.3g} s in the future", field="stamp")
        if timeout and now - stamp > 1e9 * timeout:
            raise OutdatedError(f"is {1e-9 * (now - stamp):.3g} s old", field="stamp")

    def _follow(self, source: str, command: TrajectoryCommand, now: int) -> None:
        delay = 1e-9 * (command.stamp - now) if command.stamp else 0.0
        if command.trajectory.end + delay < 0.0:
            late = -(command.trajectory.end + delay)
            raise OutdatedError(f"the trajectory ended {late:.3g} s ago", field="stamp")
        if delay > 1e-9 * MAX_WAIT_NS:
            raise OutdatedError(
                f"is {delay:.3g} s in the future: the sender has another clock "
                "(use_sim_time on both or on neither)",
                field="stamp",
            )
        self._drive.follow(command.trajectory, delay, source)
