"""What is in a log: topics, joints, frames and fields, and where the signals may be."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from rich import box
from rich.markup import escape
from rich.table import Table

from hma_gripper_sim.bags.message_batches import Batch, Connection, shown
from hma_gripper_sim.bags.message_layout import Layout
from hma_gripper_sim.bags.stored_log import Log
from hma_gripper_sim.errors import InputError, first_line, printable
from hma_gripper_sim.recordings.signal_sources import Frame, joint_names, transforms

_LISTED = 12
"""Joints, frames and fields that a table names of each topic."""

_GUESSED = 6
"""Places of a signal that a starter map names."""


@dataclass
class Sender:
    """What one publisher, or all whom the recorder did not tell apart, sent on a topic.

    Attributes
    ----------
    connection
        The topic, its type, and who sends.
    count
        Messages.
    first, last
        When the first and the last were logged [ns].
    is_stamped
        Whether they have a header with a stamp.
    fields
        Paths of their numbers; arrays end in ``[]``.
    joints
        That they name.
    frames
        Transforms that they hold, and the frames in their headers, as text.
    transforms
        Transforms that they hold.
    unreadable
        Why they cannot be read; empty if they can.
    effort
        What looking into messages may still take: 100 each, and 1 for every number.
    """

    connection: Connection
    count: int = 0
    first: int = 2**63 - 1
    last: int = 0
    is_stamped: bool = False
    fields: dict[str, None] = field(default_factory=dict)
    joints: dict[str, None] = field(default_factory=dict)
    frames: dict[str, None] = field(default_factory=dict)
    transforms: dict[Frame, None] = field(default_factory=dict)
    unreadable: str = ""
    effort: int = 50_000

    @property
    def rate(self) -> float:
        """How many messages there were per second; NaN where that is not known."""
        return (
            (self.count - 1) / ((self.last - self.first) * 1e-9)
            if self.last > self.first
            else np.nan
        )

    @property
    def content(self) -> str:
        """What is in the messages, in words."""
        parts = [f"cannot be read: {self.unreadable}"] if self.unreadable else []
        for name, entries in (
            ("joints", self.joints),
            ("frames", self.frames),
            ("fields", self.fields),
        ):
            if entries:
                listed = ", ".join([*entries][:_LISTED])
                parts.append(f"{name}: {listed}" + (", …" if len(entries) > _LISTED else ""))
        return "; ".join(parts)

    def take_up(self, batch: Batch) -> None:
        """Count messages, and look into the first of them."""
        self.count += batch.logged.size
        self.first = min(self.first, int(batch.logged.min()))
        self.last = max(self.last, int(batch.logged.max()))
        for start, size in zip(batch.starts.tolist(), batch.sizes.tolist(), strict=True):
            if self.effort <= 0:
                break
            self._look_into(batch.data[start : start + size].tobytes())

    def _look_into(self, data: bytes) -> None:
        self.effort -= 100
        try:
            layout = self.connection.layout(data)
        except InputError as error:
            self.effort, self.unreadable = 0, error.reason
            return
        except Exception as error:  # a damaged message makes its parser raise almost anything
            self.effort = 0
            self.unreadable = f"a message is damaged ({first_line(error)})"
            return
        self.effort -= len(layout.numbers)
        self.is_stamped |= "header.stamp.sec" in layout.numbers
        for path, numbers in layout.numbers.items():
            if path.startswith("header."):
                continue
            self.fields.setdefault(path if numbers.length is None else f"{path}[]")
        self.joints.update(dict.fromkeys(joint_names(layout)))
        self._take_up_frames(layout)

    def _take_up_frames(self, layout: Layout) -> None:
        held = transforms(layout)
        self.transforms.update(dict.fromkeys(held))
        self.frames.update(dict.fromkeys(map(str, held)))
        frame = layout.texts.get("header.frame_id")
        if frame:
            self.frames.setdefault(str(frame))


@dataclass(frozen=True)
class Inspection:
    """What is in a log.

    Attributes
    ----------
    source
        The log's path.
    senders
        By topic.
    notes
        What is damaged, missing or cannot be read.
    """

    source: str
    senders: tuple[Sender, ...]
    notes: tuple[str, ...]

    @property
    def span(self) -> tuple[int, int]:
        """When the first and the last message were logged [ns]; twice 0 without messages."""
        heard = [sender for sender in self.senders if sender.count]
        if not heard:
            return 0, 0
        return min(sender.first for sender in heard), max(sender.last for sender in heard)


def inspect_log(path: str | Path) -> Inspection:
    """Read all of a log to say what is in it.

    Raises
    ------
    InputError
        The log cannot be read.
    """
    log = Log(path)
    senders: dict[Connection, Sender] = {}
    for batch in log.batches():
        for connection, messages in batch.split():
            senders.setdefault(connection, Sender(connection)).take_up(messages)
    ordered = sorted(senders.values(), key=lambda sender: sender.connection.topic)
    silent = log.findings.topics - {sender.connection.topic for sender in ordered}
    notes = [f"{topic}: no messages" for topic in sorted(silent)]
    return Inspection(
        log.source, tuple(ordered), (*log.findings.losses, *log.findings.notes, *notes)
    )


def heading(inspection: Inspection) -> str:
    """Return the time span in words."""
    first, last = inspection.span
    count = sum(sender.count for sender in inspection.senders)
    begin = datetime.fromtimestamp(first // 10**9, tz=timezone.utc).isoformat(sep=" ")
    return (
        f"{inspection.source}: {count} messages in {(last - first) * 1e-9:.6g} s, logged from "
        f"{shown(first)} ({begin}) to {shown(last)}"
    )


def inspection_table(inspection: Inspection) -> Table:
    """Return topics, and what is in their messages, as a table for a rich console."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name in ("topic", "type", "publisher", "messages", "Hz", "stamped"):
        numeric = name in ("messages", "Hz")
        table.add_column(name, justify="right" if numeric else "left", no_wrap=True)
    table.add_column("joints, frames, fields")
    for sender in inspection.senders:
        connection = sender.connection
        several = connection.publishers > 1
        cells = (
            connection.topic,
            connection.msgtype,
            f"{connection.publishers} together" if several else connection.publisher,
            str(sender.count),
            "" if np.isnan(sender.rate) else f"{sender.rate:.4g}",
            "yes" if sender.is_stamped else "no",
            sender.content,
        )
        table.add_row(*(escape(printable(cell)) for cell in cells))
    return table


def starter_map(inspection: Inspection) -> str:
    """Return a signal map to edit: where each signal may be, the likeliest first."""
    lines = [
        "# Where the signals may be, guessed from types and names: keep one of each, and check",
        "# sign, unit and tare. All are positive towards the object (docs/logs.md).",
    ]
    for name, guesses in _guesses(inspection).items():
        if not guesses:
            lines += ["", f"# {name}: found nothing that it could be"]
        for index, guess in enumerate([*dict.fromkeys(guesses)][:_GUESSED]):
            mark = "" if index == 0 else "# "
            lines += [""] if index == 0 else []
            lines += [f"{mark}{name}: {guess}"]
    return "\n".join(lines) + "\n"


def _guesses(inspection: Inspection) -> dict[str, list[str]]:
    """Return by signal the entries that may be right, in order."""
    guesses: dict[str, list[str]] = {
        name: []
        for name in ("travel", "velocity_command", "actuator_force", "phi_left", "phi_right")
    }
    for _, name, entry in sorted(_candidates(inspection)):
        guesses[name].append(entry)
    return guesses


def _candidates(inspection: Inspection) -> Iterator[tuple[int, str, str]]:
    """Yield how far-fetched an entry is, the signal, and the entry."""
    senders = Counter((s.connection.file, s.connection.topic) for s in inspection.senders)
    for sender in inspection.senders:
        topic = quoted(sender.connection.topic)
        if senders[sender.connection.file, sender.connection.topic] > 1:
            topic += f", publisher: {quoted(sender.connection.publisher)}"
        elif sender.connection.publishers > 1 and not sender.joints and not sender.transforms:
            topic += ", publisher: any"
        kind = sender.connection.msgtype.rpartition("/")[2]
        is_command = any(word in sender.connection.topic for word in ("cmd", "command"))
        for side in ("left", "right"):
            for joint in sender.joints:
                if "phi" in joint and side in joint:
                    yield 0, f"phi_{side}", _entry(topic, "position", joint=joint)
            if "phi" in sender.connection.topic and "data[]" in sender.fields:
                index = int(side == "right")
                yield 1, f"phi_{side}", _entry(topic, f"data[{index}]", unit="deg")
        if "position[]" in sender.fields and not is_command:
            for joint in sender.joints:
                if "phi" not in joint:
                    likely = any(word in joint for word in ("slide", "lift", "linear", "prismatic"))
                    yield 2 - 2 * likely, "travel", _entry(topic, "position", joint=joint)
        for frame in sender.transforms:
            link = f"{{parent: {quoted(frame.parent)}, child: {quoted(frame.child)}}}"
            place = f"topic: {topic}, frame: {link}, field: transform.translation.z"
            yield 3, "travel", f"{{{place}, scale: -1, tare: 0.5 s}}"
        if "pose.position.z" in sender.fields:
            yield 1, "travel", _entry(topic, "pose.position.z", scale="-1", tare="0.5 s")
        if "wrench.force.z" in sender.fields:
            ours = "actuator" in sender.connection.topic
            extra = {} if ours else {"scale": "-1", "tare": "0.5 s"}
            yield int(not ours), "actuator_force", _entry(topic, "wrench.force.z", **extra)
        if "force" in sender.connection.topic and "data" in sender.fields:
            yield 2, "actuator_force", _entry(topic, "data", tare="0.5 s")
        if is_command and "data" in sender.fields and kind.startswith("Float"):
            yield 0, "velocity_command", _entry(topic, "data", optional="true")
        for path in ("twist.linear.z", "linear.z"):
            if path in sender.fields and is_command:
                yield 1, "velocity_command", _entry(topic, path, scale="-1", optional="true")


def _entry(topic: str, field_: str, **more: str) -> str:
    """Return an entry in YAML's flow style."""
    parts = [f"topic: {topic}", f"field: {quoted(field_)}"]
    parts += [f"{key}: {quoted(value)}" for key, value in more.items()]
    return "{" + ", ".join(parts) + "}"


def quoted(text: str) -> str:
    """Return a text as YAML needs it."""
    plain = all(c.isalnum() or c in "/_.- " for c in text) and text.isascii()
    if (plain and not text.startswith(("-", " "))) or text == "-1":
        return text
    if not text.isprintable():  # control codes must not reach a terminal or a file
        return json.dumps(text)
    return "'" + text.replace("'", "''") + "'"
