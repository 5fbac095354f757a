"""Judging the stamps of a signal: time that runs back, jumps or was never set."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hma_gripper_sim.bags.message_batches import Ints, shown
from hma_gripper_sim.errors import InputError

MAX_GAP = 86_400 * 10**9
"""A longer time between two samples [ns] is a clock that was set, not a pause."""

MAX_SETBACK = 10**9
"""A sample that comes later than this [ns] is of another time, not out of order."""

_STEPS = 10
"""Usual times between two samples that the first of them may take."""

_REMEDY = "; 'time: log' in a signal map takes the time when it was logged"


def are_set(stamps: Ints, logged: Ints, clock: str) -> tuple[npt.NDArray[np.bool_], str | None]:
    """Choose the samples that have a time at all.

    A message that is stamped before the sender's clock has come has the stamp 0.

    Parameters
    ----------
    stamps, logged
        When, and when it was logged [ns], in the order they were logged, shape (n,), n > 0.
    clock
        Where the stamps are from: ``header``, or ``log``, of which 0 is a time like others.

    Returns
    -------
    As of `in_order`.

    Raises
    ------
    InputError
        None of them is set.
    """
    kept = np.ones(stamps.size, dtype=np.bool_)
    if clock == "log" or stamps.all():
        return kept, None
    later = np.flatnonzero(stamps)
    if not later.size:
        if not logged.any():
            return kept, None
        raise InputError(f"its stamps are not set{_REMEDY}")
    first = int(later[0])
    kept = stamps != 0
    if first and _goes_on(stamps, logged, later):
        kept[:first] = True
    left_out = int(np.count_nonzero(~kept))
    if not left_out:
        return kept, None
    return kept, f"{left_out} of {stamps.size} samples left out because their stamp is not set (0)"


def _goes_on(stamps: Ints, logged: Ints, later: Ints) -> bool:
    """Return whether a clock that began at 0 came to the first later stamp in its usual steps."""
    first = int(later[0])
    step = int(stamps[first])
    usual = max(0, int(np.median(np.diff(stamps[later])))) if later.size > 1 else 0
    waited = int(logged[first] - logged[first - 1])
    return step <= MAX_SETBACK or step <= _STEPS * usual or step - waited <= MAX_SETBACK


def in_order(stamps: Ints, clock: str) -> tuple[npt.NDArray[np.bool_], str | None]:
    """Choose the samples whose time does not run back.

    Parameters
    ----------
    stamps
        In the order they were logged [ns], shape (n,), n > 0.
    clock
        Where the stamps are from: ``header`` or ``log``.

    Returns
    -------
    Which samples are kept, shape (n,), and what was left out in words, if anything.

    Raises
    ------
    InputError
        Time runs back or ahead by more than samples that are out of order or a pause explain.
    """
    remedy = _REMEDY if clock == "header" else ""
    latest = np.maximum.accumulate(stamps)
    setback = latest - stamps
    worst = int(setback.argmax())
    if setback[worst] > MAX_SETBACK:
        first = int(np.argmax(setback > MAX_SETBACK))
        reason = f"time runs back by {_duration(setback[first])} at stamp {shown(stamps[first])}"
        raise InputError(reason + remedy)
    gaps = np.diff(latest)
    if gaps.size and gaps.max() > MAX_GAP:
        before = int(np.argmax(gaps > MAX_GAP))
        reason = f"time jumps ahead by {_duration(gaps[before])} at stamp {shown(stamps[before])}"
        raise InputError(reason + remedy)
    kept = setback == 0
    left_out = int(np.count_nonzero(~kept))
    if not left_out:
        return kept, None
    first = int(np.argmin(kept))
    return kept, (
        f"{left_out} of {stamps.size} samples left out because their time runs back, "
        f"by at most {_duration(setback[worst])}, the first at stamp {shown(stamps[first])}"
    )


def refuse_other_clocks(starts: dict[str, int]) -> None:
    """Raise `InputError` if signals, whose first stamps [ns] are given, are days apart."""
    if not starts:
        return
    first, last = min(starts, key=starts.__getitem__), max(starts, key=starts.__getitem__)
    apart = starts[last] - starts[first]
    if apart > MAX_GAP:
        raise InputError(
            f"{last} begins {_duration(apart)} after {first}: their stamps are of "
            f"different clocks{_REMEDY}"
        )


def _duration(nanoseconds: int | np.int64) -> str:
    seconds = int(nanoseconds) * 1e-9
    for unit, size in (("years", 365.25 * 86_400), ("days", 86_400.0)):
        if seconds >= size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.6g} s"
