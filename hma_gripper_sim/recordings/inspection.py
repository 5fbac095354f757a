"""What is in a log: topics, publishers, joints, frames and fields."""

from __future__ import annotations

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

PUBLISHERS = (
    "publisher: what 'publisher' in a signal map chooses: the number of mcap's channel or of db3's "
    "topic, or the sender's name in ROS 1; 'N together': the recorder did not tell N senders apart"
)
"""Explains a column of the table."""


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
