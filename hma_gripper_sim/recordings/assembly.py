"""One signal out of what the connections of its topic say: whose, when, and in SI units."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Collection, Sequence

import numpy as np

from hma_gripper_sim.bags.message_batches import Connection, Findings, Ints, shown
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.recordings.gathering import Samples
from hma_gripper_sim.recordings.signal_map import ANY_PUBLISHER, Signal
from hma_gripper_sim.recordings.signal_sources import Field, FloatArray
from hma_gripper_sim.recordings.stamps import are_set, in_order

_SHOWN = 8
"""Names that an error lists."""

_TURNS, _SETS = 3, 3
"""How often publishers take turns where they do: one that is started anew does so less often. And
the sets of joints that they then name: where these are many, they do not tell publishers apart."""

_SMALLEST_JUMP = {
    "travel": 2e-4,
    "velocity_command": 2e-4,
    "actuator_force": 0.02,
    "phi_left": 0.01,
    "phi_right": 0.01,
    "bending_moment": 1e-4,
}
"""What a signal at rest may jump by [SI]: between two counts of its sensor, for example."""

_BLOCK = 2**17
"""Samples in which jumps are looked for at a time."""

_FEWEST_JUMPS, _JUMPS = 5, 0.01
"""Jumps of a signal to another course and back that are no outliers: at least, and as a share."""

Part = tuple[Connection, Samples | InputError]
"""What a connection says of a signal, or why its messages cannot be read."""


class AbsentError(InputError):
    """A log has nothing at the place where a signal is looked for."""


def assemble(
    signal: Signal, parts: Sequence[Part], findings: Findings
) -> tuple[Ints, FloatArray] | None:
    """Return the stamps [ns], never decreasing, and the values [SI] of a signal, shapes (n,).

    The samples in `parts` are used up. What is left out is noted in `findings`. None: the log
    lacks the signal, and may.

    Raises
    ------
    InputError
        The signal is missing, ambiguous or nowhere finite, or its stamps cannot be used.
    """
    try:
        chosen = _chosen(signal, parts, findings)
        if chosen is None:
            absence = _absence(signal, parts, findings)
            findings.note(f"{signal.topic}: {signal.name} is absent: {absence}")
            return None
        told = [samples for _, samples in chosen]
        _note_passed_over(signal, told, findings)
        stamps, logged, value = _joined(signal, told, findings)
        if signal.publisher is None and isinstance(signal.source, Field):
            _refuse_mixture(signal, chosen, value, findings)
        clock = "header" if any(samples.is_stamped for samples in told) else "log"
        kept, left_out = are_set(stamps, logged, clock)
        if left_out is not None:
            findings.note(f"{signal.topic}: {signal.name}: {left_out}")
            stamps, value = stamps[kept], value[kept]
        kept, left_out = in_order(stamps, clock)
        if left_out is not None:
            findings.note(f"{signal.topic}: {signal.name}: {left_out}")
            stamps, value = stamps[kept], value[kept]
        stamps, value = _finite(signal, stamps, _si(signal, stamps, value), findings)
        return stamps - round(signal.delay * 1e9), value
    except InputError as error:
        reason = f"{signal.name}: {error.reason}"
        raise type(error)(reason, field=signal.topic, source=error.source) from None


def _chosen(
    signal: Signal, parts: Sequence[Part], findings: Findings
) -> list[tuple[Connection, Samples]] | None:
    """Return what the publisher that is meant says; None if a log has nothing, and may."""
    said = [(c, s) for c, s in parts if isinstance(s, Samples) and s.values]
    if signal.publisher not in (None, ANY_PUBLISHER):
        said = [(c, s) for c, s in said if c.publisher == signal.publisher]
    if not said:
        is_wrong = any(isinstance(s, Samples) and s.is_wrong for _, s in parts)
        if signal.optional and not is_wrong:
            return None
        is_elsewhere = not any(isinstance(s, InputError) or s.lack for _, s in parts)
        error = AbsentError if is_elsewhere else InputError
        raise error(_absence(signal, parts, findings))
    if signal.publisher is None:
        most = Counter(connection.file for connection, _ in said).most_common(1)[0]
        if most[1] > 1:
            names = ", ".join(repr(c.publisher) for c, _ in said if c.file == most[0])
            raise InputError(
                f"{most[1]} publishers ({names}); 'publisher: NAME' in a signal map chooses "
                "one, 'publisher: any' takes all"
            )
        merged = max(connection.publishers for connection, _ in said)
        if merged > 1 and not _names_its_own(signal):
            raise InputError(
                f"{merged} publishers, which the recorder did not tell apart; "
                "'publisher: any' in a signal map takes all"
            )
    return said


def _note_passed_over(signal: Signal, told: Sequence[Samples], findings: Findings) -> None:
    """Note the messages that are not about the signal, and those that do not hold it."""
    passed_over = sum(samples.passed_over for samples in told)
    lacking = sum(samples.lacking for samples in told)
    total = passed_over + lacking + sum(len(samples.values) for samples in told)
    where = f"{signal.topic}: "
    if passed_over and isinstance(signal.source, Field) and signal.source.frame is None:
        findings.note(
            f"{where}{passed_over} of {total} messages passed over for {signal.name}: they are "
            "about other joints"
        )
    if lacking:
        lack = next(samples.lack for samples in told if samples.lack)
        findings.note(f"{where}{lacking} of {total} messages passed over for {signal.name}: {lack}")


def _refuse_mixture(
    signal: Signal,
    chosen: Sequence[tuple[Connection, Samples]],
    value: FloatArray,
    findings: Findings,
) -> None:
    """Refuse what several publishers that nothing else tells apart say of one joint or frame."""
    if not _names_its_own(signal):
        return
    remedy = "; 'publisher: any' in a signal map takes all"
    for _, samples in chosen:
        if samples.turns >= _TURNS and 1 < len(samples.among) <= _SETS:
            sets = " and ".join(f"({_list(names)})" for names in samples.among)
            raise InputError(
                f"publishers take turns in naming {signal.source.subject}, among the joints "
                f"{sets}{remedy}"
            )
    jumps = count_jumps(value, _SMALLEST_JUMP[signal.name] / (abs(signal.scale) or 1.0))
    if jumps >= max(_FEWEST_JUMPS, _JUMPS * value.size):
        raise InputError(
            f"its value jumps to and fro {jumps} times in {value.size} samples, as where two "
            f"publishers tell {signal.source.subject}{remedy}"
        )
    merged = max(connection.publishers for connection, _ in chosen)
    if merged > 1 and not any(samples.passed_over for _, samples in chosen):
        findings.note(
            f"{signal.topic}: the recorder noted {merged} publishers, and every message tells "
            f"{signal.source.subject}: {signal.name} may be of several"
        )


def count_jumps(value: FloatArray, least: float) -> int:
    """Return how often a signal leaves its course for one sample, shape (n,).

    That is by more than `least`, a twentieth of its range, and five times what it usually does in
    two sample periods: noise does not do it, and single outliers are few.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        room = float(np.fmax.reduce(value) - np.fmin.reduce(value))
        return sum(
            _jumps_in(value[begin : begin + _BLOCK + 2], max(least, 0.05 * room))
            for begin in range(0, value.size, _BLOCK)
        )


def _jumps_in(value: FloatArray, least: float) -> int:
    value = value[np.isfinite(value)]
    if value.size < _FEWEST_JUMPS:
        return 0
    steps = np.diff(value)
    least = max(least, 5.0 * float(np.median(np.abs(value[2:] - value[:-2]))))
    there, back = steps[:-1], steps[1:]
    opposite = np.sign(there) != np.sign(back)
    return int(np.count_nonzero(opposite & (np.abs(there) > least) & (np.abs(back) > least)))


def _names_its_own(signal: Signal) -> bool:
    """Return whether the signal's messages name a joint or frame, which tells them from others."""
    source = signal.source
    return not isinstance(source, Field) or bool(source.joint or source.frame)


def _absence(signal: Signal, parts: Sequence[Part], findings: Findings) -> str:
    """Return why a signal is not there."""
    if signal.topic not in findings.topics:
        return missing_topic(findings)
    for _, said in parts:
        if isinstance(said, InputError):
            return said.reason
    publishers = {c.publisher for c, s in parts if isinstance(s, Samples) and s.values}
    if publishers:
        return f"no publisher {signal.publisher!r} (there are: {_list(publishers)})"
    for _, said in parts:
        if isinstance(said, Samples) and said.lack:
            return f"{said.lack}, nor has any other" if not said.is_wrong else said.lack
    others: set[str] = set().union(*(s.others for _, s in parts if isinstance(s, Samples)))
    if others:
        return f"no message is about {signal.source.subject} (there are: {_list(others)})"
    return "no messages on this topic"


def missing_topic(findings: Findings) -> str:
    """Return that a topic is missing, and which there are."""
    return f"no such topic in this log (there are: {_list(findings.topics) or 'none'})"


def _list(names: Collection[str]) -> str:
    listed = sorted(names)
    return ", ".join(listed[:_SHOWN]) + (", …" if len(listed) > _SHOWN else "")


def _joined(
    signal: Signal, told: Sequence[Samples], findings: Findings
) -> tuple[Ints, Ints, FloatArray]:
    """Put the samples of a signal together, in the order they were logged: stamps, logged, values.

    Of several publishers it is the order of their stamps.
    """
    stamps = np.concatenate([np.frombuffer(samples.stamps, np.int64) for samples in told])
    for samples in told:  # they may be much of the memory
        samples.stamps = array("q")
    value = np.concatenate([np.frombuffer(samples.values, np.float64) for samples in told])
    logged = np.concatenate([part for samples in told for part in samples.logged])
    for samples in told:
        samples.values, samples.logged = array("d"), []
    several = len(told) > 1 and signal.publisher == ANY_PUBLISHER
    by = stamps if several else logged
    if (np.diff(by) < 0).any():
        order = np.argsort(by, kind="stable")
        if not several:
            findings.note(
                f"{signal.topic}: its messages lie in another order in the log than they were "
                "logged: taken as logged"
            )
        return stamps[order], logged[order], value[order]
    return stamps, logged, value


def _si(signal: Signal, stamps: Ints, value: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        si = value * signal.scale
        if signal.tare:
            first = si[stamps <= stamps[0] + round(signal.tare * 1e9)]
            si -= first[np.isfinite(first)].mean() if np.isfinite(first).any() else np.nan
        si += signal.offset
    return si


def _finite(
    signal: Signal, stamps: Ints, value: FloatArray, findings: Findings
) -> tuple[Ints, FloatArray]:
    finite = np.isfinite(value)
    if finite.all():
        return stamps, value
    first = int(np.argmin(finite))
    left_out = int(np.count_nonzero(~finite))
    if left_out == value.size:
        raise InputError(f"none of its {value.size} samples is finite")
    findings.note(
        f"{signal.topic}: {signal.name}: {left_out} of {value.size} samples left out because they "
        f"are not finite, the first ({value[first]}) at stamp {shown(stamps[first])}"
    )
    return stamps[finite], value[finite]
