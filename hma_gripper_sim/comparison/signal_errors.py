"""How far two logs differ, signal by signal and phase by phase."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.comparison.coverage import Coverage, coverage, known_at
from hma_gripper_sim.comparison.phases import PHASES, Phases
from hma_gripper_sim.recordings.recording import FloatArray, Recording, Series


@dataclass(frozen=True)
class Quantity:
    """What a signal is called and printed in: so many shown units make one SI unit."""

    label: str
    unit: str
    shown_unit: str
    shown_per_si: float
    decimals: int

    def number(self, value: float) -> str:
        """Return a value [SI] as text without its unit."""
        return f"{value * self.shown_per_si:.{self.decimals}f}"


QUANTITIES: Mapping[str, Quantity] = {
    "travel": Quantity("travel", "m", "mm", 1e3, 4),
    "actuator_force": Quantity("F_act", "N", "N", 1.0, 4),
    "phi_left": Quantity("φ left", "rad", "°", math.degrees(1.0), 3),
    "phi_right": Quantity("φ right", "rad", "°", math.degrees(1.0), 3),
    "phi_mean": Quantity("φ mean", "rad", "°", math.degrees(1.0), 3),
    "bending_moment": Quantity("M", "N*m", "mN m", 1e3, 4),
}
"""The signals that are compared, where both logs have them."""

RELATIVE = (
    "Relative errors are RMSE / largest magnitude of the experiment's signal (for φ nearly Table "
    "5.3's |simulated - measured| / measured); at an instant they are exactly Table 5.3's."
)


@dataclass(frozen=True)
class Errors:
    """Simulated minus measured, over a stretch of time.

    Attributes
    ----------
    count
        Samples compared.
    rmse, maximum, bias
        Root mean square, largest magnitude, and mean [SI].
    time
        Of the largest [s].
    relative
        `rmse` relative to the signal's largest magnitude in the whole experiment; None if 0.
    spread
        How far the experiment itself is spread there [SI]: root mean square difference of its
        left and right angle (of their mean: half of that). None where it has no two.
    """

    count: int
    rmse: float
    maximum: float
    bias: float
    time: float
    relative: float | None
    spread: float | None

    @property
    def within_spread(self) -> bool:
        """Whether the RMSE is no larger than the experiment's own spread."""
        return bool(self.spread) and self.rmse <= (self.spread or 0.0)


@dataclass(frozen=True)
class InstantError:
    """A signal at one instant [SI]."""

    time: float
    simulated: float
    measured: float
    spread: float | None

    @property
    def error(self) -> float:
        """Simulated minus measured [SI]."""
        return self.simulated - self.measured

    @property
    def relative(self) -> float | None:
        """As in Table 5.3, relative to what was measured; None where that was 0."""
        return abs(self.error / self.measured) if self.measured else None

    @property
    def within_spread(self) -> bool:
        """Whether the error is no larger than the experiment's own spread."""
        return bool(self.spread) and abs(self.error) <= (self.spread or 0.0)


@dataclass(frozen=True)
class SignalErrors:
    """Two courses of one signal, and how far they differ.

    Attributes
    ----------
    name
        Key of `QUANTITIES`.
    time, simulated, measured
        Where both are known [s, SI], shape (n,): at the samples of the one with fewer.
    largest
        Largest magnitude that was measured [SI].
    coverage
        How much of what was measured the simulated signal covers.
    skipped
        Samples that were left out because the other log has a gap there.
    overall
        Errors over all of it.
    phases
        Errors by phase, where there is one.
    instants
        Errors at the asked instants.
    """

    name: str
    time: FloatArray
    simulated: FloatArray
    measured: FloatArray
    largest: float
    coverage: Coverage
    skipped: int
    overall: Errors
    phases: Mapping[str, Errors]
    instants: tuple[InstantError, ...]

    @property
    def quantity(self) -> Quantity:
        """What the signal is called and printed in."""
        return QUANTITIES[self.name]


def signal_errors(
    simulated: Recording,
    experiment: Recording,
    phases: Phases | None,
    instants: Sequence[float] = (),
) -> Iterator[SignalErrors]:
    """Compare every signal that both recordings have, on one clock.

    The signal with fewer samples where both are known is compared at these samples; the other is
    interpolated linearly.

    Parameters
    ----------
    phases
        Of the experiment.
    instants
        Times to report as well [s].
    """
    for name in QUANTITIES:
        own, other = _signal(simulated, name), _signal(experiment, name)
        if own is None or other is None:
            continue
        time, ours, theirs, skipped = _on_common_times(own, other)
        if not len(time):
            continue
        spread = _spread(experiment, name, time)
        largest = float(np.abs(other.value).max())

        def errors(
            kept: npt.NDArray[np.bool_],
            time: FloatArray = time,
            difference: FloatArray = ours - theirs,
            spread: FloatArray | None = spread,
            largest: float = largest,
        ) -> Errors:
            return _errors(
                time[kept],
                difference[kept],
                None if spread is None else spread[kept],
                largest,
            )

        by_phase = {}
        if phases is not None:
            labels = phases.at(time)
            for index, phase in enumerate(PHASES):
                if (labels == index).any():
                    by_phase[phase] = errors(labels == index)
        yield SignalErrors(
            name,
            time,
            ours,
            theirs,
            largest,
            coverage(own, other),
            skipped,
            errors(np.ones(len(time), dtype=np.bool_)),
            by_phase,
            tuple(_at(own, other, experiment, name, instant) for instant in instants),
        )


def _errors(
    time: FloatArray, difference: FloatArray, spread: FloatArray | None, largest: float
) -> Errors:
    worst = int(np.argmax(np.abs(difference)))
    rmse = float(np.sqrt(np.mean(difference**2)))
    return Errors(
        count=len(time),
        rmse=rmse,
        maximum=float(abs(difference[worst])),
        bias=float(np.mean(difference)),
        time=float(time[worst]),
        relative=rmse / largest if largest else None,
        spread=None if spread is None else float(np.sqrt(np.mean(spread**2))),
    )


def _at(
    ours: Series, theirs: Series, experiment: Recording, name: str, time: float
) -> InstantError:
    spread = _spread(experiment, name, np.array([time]))
    return InstantError(
        time, ours.at(time), theirs.at(time), None if spread is None else float(spread[0])
    )


def _signal(recording: Recording, name: str) -> Series | None:
    if name != "phi_mean":
        return recording.signals.get(name)
    left, right = (recording.signals.get(f"phi_{side}") for side in ("left", "right"))
    if left is None or right is None:
        return None
    both = known_at(right, left.time)
    if not both.any():
        return None
    time = left.time[both]
    return Series(time, 0.5 * (left.value[both] + np.interp(time, right.time, right.value)))


def _on_common_times(
    ours: Series, theirs: Series
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return times, both signals there, and how many samples were left out for gaps."""
    start, end = max(ours.time[0], theirs.time[0]), min(ours.time[-1], theirs.time[-1])
    here, there = ours.between(start, end), theirs.between(start, end)
    if len(here.time) < len(there.time):
        time, other = here.time, theirs
    else:
        time, other = there.time, ours
    kept = known_at(other, time)
    time = time[kept]
    return (
        time,
        np.interp(time, ours.time, ours.value),
        np.interp(time, theirs.time, theirs.value),
        int(np.count_nonzero(~kept)),
    )


def _spread(experiment: Recording, name: str, time: FloatArray) -> FloatArray | None:
    """How far the experiment's left and right angle differ; of their mean: half of it [rad]."""
    if not name.startswith("phi"):
        return None
    left, right = (experiment.signals.get(f"phi_{side}") for side in ("left", "right"))
    if left is None or right is None:
        return None
    difference = np.interp(time, left.time, left.value) - np.interp(time, right.time, right.value)
    return np.abs(difference) * (0.5 if name == "phi_mean" else 1.0)
