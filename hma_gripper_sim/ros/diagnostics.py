"""What the node says about itself on /diagnostics, with the levels of REP-107."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from hma_gripper_sim.device.arbitration import SourceCounts
from hma_gripper_sim.device.drive import DriveStatus
from hma_gripper_sim.mechanics.states import Snapshot
from hma_gripper_sim.model.gripper import GripperDesign
from hma_gripper_sim.results.validity import Finding, Severity
from hma_gripper_sim.simulation.state import SimulationState

OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK,
    DiagnosticStatus.WARN,
    DiagnosticStatus.ERROR,
    DiagnosticStatus.STALE,
)

SLOW = 0.95
"""Share of the wanted real-time factor below which the node warns."""

FINDINGS = ("unmodelled contact", "penetration", "sampled contour", "discretisation")
"""What is looked for at the moment of a report, as `validity.Finding` names it."""


class Pace:
    """What the ticks since the last report took.

    Attributes
    ----------
    ticks
        How many there were.
    moved
        In how many of them time went on.
    busy, longest
        Time that all of them took, and the longest [s].
    moment
        Largest bending moment of any section [N m].
    """

    def __init__(self) -> None:
        self.ticks = self.moved = 0
        self.busy = self.longest = self.moment = 0.0

    def add(self, state: SimulationState, took: float, *, moved: bool) -> None:
        """Count a tick that took so long [s]."""
        self.ticks += 1
        self.moved += moved
        self.busy += took
        self.longest = max(self.longest, took)
        self.moment = max(self.moment, state.moment_left, state.moment_right)


class Diagnostics:
    """Puts reports together, each about the time since the one before.

    Parameters
    ----------
    name
        Of the node.
    design
        The gripper.
    """

    def __init__(self, name: str, design: GripperDesign) -> None:
        self._name = name
        self._design = design
        self._counts: dict[str, SourceCounts] = {}
        self._overruns = 0
        self._rejected = 0

    def report(
        self,
        stamp: Time,
        status: DriveStatus,
        counts: Mapping[str, SourceCounts],
        snapshot: Snapshot,
        validity: Sequence[Finding],
        pace: Pace,
        overruns: int,
        *,
        period: float,
        factor: float,
        elapsed: float,
        clock_elapsed: float,
        clock_problem: str,
        company: Sequence[str],
    ) -> DiagnosticArray:
        """Return a report.

        Parameters
        ----------
        stamp
            Time of the report.
        status, counts, snapshot, validity
            Of the drive, its sources, the simulation and its present state.
        pace
            What happened since the last report.
        overruns
            All so far.
        period, factor
            Simulated duration of a tick [s], and the real-time factor that is wanted; 0: any.
        elapsed, clock_elapsed
            Time since the last report, on this machine's clock and on the node's; the latter up to
            the last tick that was due [s].
        clock_problem
            What is wrong with the node's clock; empty: nothing.
        company
            Who is in the way on the ROS graph.
        """
        array = DiagnosticArray(
            status=[
                self._drive(status, counts),
                self._timing(
                    pace,
                    overruns,
                    period,
                    0.0 if status.paused else factor,
                    elapsed,
                    clock_elapsed,
                    clock_problem,
                ),
                self._solver(status, snapshot),
                self._stress(pace),
                self._validity(validity),
                self._graph(company),
            ]
        )
        array.header.stamp = stamp
        return array

    def _drive(self, status: DriveStatus, counts: Mapping[str, SourceCounts]) -> DiagnosticStatus:
        refused = sum(count.rejected + count.outdated for count in counts.values())
        level, message = OK, "no command yet"
        if status.source:
            level, message = OK, f"{status.source} is in charge"
        if status.paused:
            message = "paused"
        elif status.stale:
            level, message = STALE, f"no command from {status.source} within command_timeout"
        elif status.at_limit:
            level, message = WARN, "held back by a travel limit"
        elif status.clamped:
            level, message = WARN, "the command is beyond max_velocity"
        elif refused > self._rejected:
            level, message = WARN, "commands were refused"
        self._rejected = refused
        values = {
            "in charge": status.source or "nobody",
            "trajectory": status.following,
            "contour": status.contour,
            "paused": status.paused,
            "stale": status.stale,
            "clamped": status.clamped,
            "at travel limit": status.at_limit,
            "commands clamped": status.clamps,
            "commands expired": status.timeouts,
        }
        for source, count in counts.items():
            values[f"{source}: accepted"] = count.accepted
            values[f"{source}: rejected"] = count.rejected
            values[f"{source}: out of date"] = count.outdated
        return self._status("drive", level, message, values)

    def _timing(
        self,
        pace: Pace,
        overruns: int,
        period: float,
        wanted: float,
        elapsed: float,
        clock_elapsed: float,
        clock_problem: str,
    ) -> DiagnosticStatus:
        moved = pace.moved * period
        achieved = moved / elapsed
        level, message = OK, f"{achieved:.2f} times real time"
        if clock_problem:
            level, message = WARN, clock_problem
        elif overruns > self._overruns:
            level, message = WARN, "fell behind the clock: lag given up"
        elif wanted and clock_elapsed > 0.0 and moved < SLOW * wanted * clock_elapsed:
            level = WARN
            message = f"only {moved / clock_elapsed:.2f} of {wanted:g} times the node's clock"
        self._overruns = overruns
        values = {
            "real-time factor": f"{achieved:.4f}",
            "overruns": overruns,
            "ticks per second": f"{pace.ticks / elapsed:.1f}",
            "mean duration of a tick [ms]": f"{1e3 * pace.busy / max(1, pace.ticks):.3f}",
            "longest duration of a tick [ms]": f"{1e3 * pace.longest:.3f}",
        }
        return self._status("timing", level, message, values)

    def _solver(self, status: DriveStatus, snapshot: Snapshot) -> DiagnosticStatus:
        steps, rejected, iterations = np.sum([half.counts for half in snapshot.halves], axis=0)
        level, message = OK, "converged"
        if status.failure:
            level, message = ERROR, f"{status.failure}; ~/reset returns to the start pose"
        values = {
            "ticks": status.ticks,
            "steps since reset": steps,
            "rejected steps since reset": rejected,
            "Newton iterations since reset": iterations,
        }
        return self._status("solver", level, message, values)

    def _stress(self, pace: Pace) -> DiagnosticStatus:
        stress = self._design.bending_stress(pace.moment)
        limit = self._design.material.stress_limit
        ratio = stress / limit
        level, message = OK, f"{100.0 * ratio:.0f} % of the material's linear range"
        if ratio > 1.0:
            level, message = WARN, "beyond the material's linear range: " + message
        values = {"largest stress [Pa]": f"{stress:.4g}", "linear limit [Pa]": f"{limit:.4g}"}
        return self._status("stress", level, message, values)

    def _validity(self, validity: Sequence[Finding]) -> DiagnosticStatus:
        level, message = OK, "within what the model describes"
        if validity and validity[0].severity is not Severity.NOTE:
            level, message = WARN, validity[0].message
        values = {
            name: "; ".join(f.message for f in validity if f.name.replace("_", " ") == name)
            or "none"
            for name in FINDINGS
        }
        return self._status("validity", level, message, values)

    def _graph(self, company: Sequence[str]) -> DiagnosticStatus:
        level, message = (WARN, company[0]) if company else (OK, "nobody is in the way")
        return self._status("graph", level, message, {"in the way": "; ".join(company) or "nobody"})

    def _status(
        self, part: str, level: bytes, message: str, values: Mapping[str, object]
    ) -> DiagnosticStatus:
        pairs = [KeyValue(key=key, value=_shown(value)) for key, value in values.items()]
        return DiagnosticStatus(
            level=level,
            name=f"{self._name}: {part}",
            message=message,
            hardware_id=self._name,
            values=pairs,
        )


def _shown(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
