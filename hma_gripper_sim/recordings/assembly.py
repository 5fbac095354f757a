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
from hma_gripper_sim.recordings.stamps import in_order

_SHOWN = 8
"""Names that an error lists."""

Part = tuple[Connection, Samples | InputError]
"""What a connection says of a signal, or why its messages cannot be read."""


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
        stamps, value = _joined(signal, chosen)
        passed_over = sum(samples.passed_over for samples in chosen)
        if passed_over and isinstance(signal.source, Field) and signal.source.frame is None:
            findings.note(
                f"{signal.topic}: {passed_over} of {passed_over + value.size} messages passed "
                f"over for {signal.name}: they are about other joints"
            )
        stamps, value = _in_order(signal, stamps, value, findings)
        return _finite(signal, stamps, _si(signal, stamps, value), findings)
    except InputError as error:
        reason = f"{signal.name}: {error.reason}"
        raise InputError(reason, field=signal.topic, source=error.source) from None


def _chosen(signal: Signal, parts: Sequence[Part], findings: Findings) -> list[Samples] | None:
    """Return the samples of the publisher that is meant; None if a log has none, and may."""
    said = [(c, s) for c, s in parts if isinstance(s, Samples) and s.values]
    if signal.publisher not in (None, ANY_PUBLISHER):
        said = [(c, s) for c, s in said if c.publisher == signal.publisher]
    if not said:
        if signal.optional:
            return None
        raise InputError(_absence(signal, parts, findings))
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
    return [samples for _, samples in said]


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


def _joined(signal: Signal, chosen: Sequence[Samples]) -> tuple[Ints, FloatArray]:
    """Put the samples of a signal together."""
    stamps = np.concatenate([np.frombuffer(samples.stamps, np.int64) for samples in chosen])
    value = np.concatenate([np.frombuffer(samples.values, np.float64) for samples in chosen])
    for samples in chosen:  # they may be much of the memory
        samples.stamps, samples.values = array("q"), array("d")
    several = len(chosen) > 1 and signal.publisher == ANY_PUBLISHER
    if (several or signal.clock == "log") and (np.diff(stamps) < 0).any():
        order = np.argsort(stamps, kind="stable")
        return stamps[order], value[order]
    return stamps, value


def _in_order(
    signal: Signal, stamps: Ints, value: FloatArray, findings: Findings
) -> tuple[Ints, FloatArray]:
    kept, left_out = in_order(stamps, signal.clock)
    if left_out is None:
        return stamps, value
    findings.note(f"{signal.topic}: {signal.name}: {left_out}")
    return stamps[kept], value[kept]


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
