"""Signal maps: where in a log each signal is found, and how its numbers become SI units.

A file in ``config/signal_maps`` holds one entry for each signal:

==============  ==========================================================================
topic           its name
field           dotted path of a number in the message, such as ``wrench.force.z``
joint           the field is an array: the entry of the joint with this name
frame           the messages are transforms (TF): the one of ``child`` in ``parent``
urdf            the joint states of a robot put its link ``child`` into ``parent``; its ``file``
direction       the field is a vector, of which the component along this one, such as
                ``[0, 0.087, 0.996]``, is meant
largest_but     instead of `joint`: the largest magnitude of all joints but this one
largest_of      instead of `joint`: the largest magnitude of the joints in this list
unit            that the log is in; SI if left out
scale           factor, such as -1 where the log counts the other way (default 1)
tare            the mean over this first time is taken as zero, and subtracted
offset          is added at last
delay           how late the signal is in the log: is taken from its stamps (default 0)
time            ``header``: the stamp in the message, if it has one (default); ``log``: when it
                was logged
publisher       which publisher of the topic, if there are several; ``any``: all of them
optional        true: a log need not have it
==============  ==========================================================================

Where a signal has a list of such entries, the first that the log holds counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from hma_gripper_sim.bags.message_batches import absolute
from hma_gripper_sim.errors import InputError
from hma_gripper_sim.recordings.signal_sources import (
    POSE_FIELDS,
    Along,
    Field,
    Frame,
    LargestMagnitude,
    Robot,
    Source,
)
from hma_gripper_sim.units import choice, quantity
from hma_gripper_sim.yaml_reading import config_directory, read_yaml, refuse_unknown

SIGNAL_UNITS: Mapping[str, str] = {
    "travel": "m",
    "velocity_command": "m/s",
    "actuator_force": "N",
    "phi_left": "rad",
    "phi_right": "rad",
    "bending_moment": "N*m",
}
"""What a map may name, and the SI unit it is read in."""

ANY_PUBLISHER = "any"

MAX_DELAY = 3600.0
"""Beyond it [s] two clocks have nothing to do with each other."""

_CLOCKS = ("header", "log")

_KEYS = (
    *("topic", "field", "joint", "frame", "urdf", "direction", "largest_but", "largest_of"),
    *("unit", "scale", "offset", "tare", "delay", "time", "publisher", "optional"),
)


@dataclass(frozen=True)
class Signal:
    """One entry of a signal map.

    Parameters
    ----------
    name
        Such as ``travel``.
    topic
        Where its messages are.
    source
        What in them it is.
    scale
        SI units per unit in the log, with the sign.
    tare
        How long [s] the signal is taken to be zero at first; 0: not at all.
    offset
        Is added after that [SI].
    delay
        Is subtracted from the stamps [s].
    clock
        ``header`` or ``log``.
    publisher
        Which one is meant, ``any`` for all; None: there must be only one.
    optional
        Whether a log may lack it.
    """

    name: str
    topic: str
    source: Source
    scale: float = 1.0
    tare: float = 0.0
    offset: float = 0.0
    delay: float = 0.0
    clock: str = "header"
    publisher: str | None = None
    optional: bool = False


@dataclass(frozen=True)
class SignalMap:
    """Where the signals of a log are.

    Parameters
    ----------
    signals
        Entries; of several of the same name the first counts that a log holds.
    """

    signals: tuple[Signal, ...]

    @classmethod
    def from_yaml(cls, path: str | Path) -> SignalMap:
        """Read a file; raise `InputError` naming it, the field and what is wrong with that."""
        try:
            return cls.from_mapping(read_yaml(path), folder=Path(path).parent)
        except InputError as error:
            raise error.within(source=str(path)) from None

    @classmethod
    def from_mapping(
        cls, entries: Mapping[str, Any], *, field: str | None = None, folder: Path = Path()
    ) -> SignalMap:
        """Take the entries of a file that has been read.

        Parameters
        ----------
        field
            What the file calls them.
        folder
            That paths in them are relative to.
        """
        try:
            refuse_unknown(entries, tuple(SIGNAL_UNITS))
            if not entries:
                raise InputError("names no signal")
            alternatives = (
                (name, each)
                for name, entry in entries.items()
                for each in (entry if isinstance(entry, list) and entry else [entry])
            )
            return cls(tuple(_signal(name, entry, folder) for name, entry in alternatives))
        except InputError as error:
            raise error.within(field_prefix=field) from None

    @classmethod
    def sim_node(cls) -> SignalMap:
        """Return the shipped map of logs of this project's own node."""
        return _sim_node()

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics that hold the signals."""
        return tuple(dict.fromkeys(signal.topic for signal in self.signals))


@cache
def _sim_node() -> SignalMap:
    return SignalMap.from_yaml(config_directory() / "signal_maps" / "sim_node.yaml")


def _signal(name: str, entry: object, folder: Path) -> Signal:
    if not isinstance(entry, dict):
        raise InputError(f"expected a mapping of fields, got {entry!r}", field=name)
    try:
        refuse_unknown(entry, _KEYS)
        unit = SIGNAL_UNITS[name]
        optional = entry.get("optional", False)
        if not isinstance(optional, bool):
            raise InputError(f"must be true or false, got {optional!r}", field="optional")
        publisher = entry.get("publisher")
        return Signal(
            name=name,
            topic=absolute(_filled_in(entry, "topic")),
            source=_source(entry, folder),
            scale=_si_per_unit(entry, unit) * quantity(entry.get("scale", 1.0), "", field="scale"),
            tare=quantity(entry.get("tare", 0.0), "s", field="tare", minimum=0.0),
            offset=quantity(entry.get("offset", 0.0), unit, field="offset"),
            delay=quantity(
                entry.get("delay", 0.0), "s", field="delay", minimum=-MAX_DELAY, maximum=MAX_DELAY
            ),
            clock=choice(entry.get("time", "header"), _CLOCKS, field="time"),
            publisher=None if publisher is None else str(publisher),
            optional=optional,
        )
    except InputError as error:
        raise error.within(field_prefix=name) from None


def _source(entry: dict[str, Any], folder: Path) -> Source:
    field = _filled_in(entry, "field")
    selectors = [
        key for key in ("joint", "frame", "urdf", "largest_but", "largest_of") if key in entry
    ]
    if len(selectors) > 1:
        raise InputError(f"cannot stand beside {selectors[0]!r}", field=selectors[1])
    if "largest_but" in entry:
        return LargestMagnitude(field, without=_filled_in(entry, "largest_but"))
    if "largest_of" in entry:
        return LargestMagnitude(field, among=_names(entry["largest_of"]))
    frame = _frame(entry, "frame", ()) if "frame" in entry else None
    if "direction" in entry:
        if selectors not in ([], ["frame"]):
            raise InputError(f"cannot stand beside {selectors[0]!r}", field="direction")
        return Along(field, _direction(entry["direction"]), frame)
    if "joint" in entry:
        return Field(field, joint=_filled_in(entry, "joint"))
    if "urdf" in entry:
        links = _frame(entry, "urdf", ("file",))
        if field not in POSE_FIELDS:
            raise InputError(f"must be one of {', '.join(POSE_FIELDS)}", field="field")
        file = folder / _filled_in(entry["urdf"], "file")
        return Robot(field, str(file), links.parent, links.child)
    return Field(field, frame=frame)


def _frame(entry: dict[str, Any], key: str, more: tuple[str, ...]) -> Frame:
    fields = entry[key]
    names = ("parent", "child", *more)
    if not isinstance(fields, dict):
        listed = " and ".join(map(repr, names))
        raise InputError(f"expected {listed}, got {fields!r}", field=key)
    try:
        refuse_unknown(fields, names)
        return Frame(_filled_in(fields, "parent"), _filled_in(fields, "child"))
    except InputError as error:
        raise error.within(field_prefix=key) from None


def _names(given: object) -> tuple[str, ...]:
    """Return the joints of a list."""
    if not isinstance(given, list) or not given or not all(isinstance(n, str) for n in given):
        raise InputError(f"expected a list of joints, got {given!r}", field="largest_of")
    return tuple(given)


def _direction(given: object) -> tuple[float, float, float]:
    """Return a direction as a unit vector."""
    if not isinstance(given, list) or len(given) != 3:
        raise InputError(f"expected three numbers, got {given!r}", field="direction")
    x, y, z = (quantity(number, "", field="direction") for number in given)
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        raise InputError("has no direction: its length is not finite or 0", field="direction")
    return x / length, y / length, z / length


def _si_per_unit(entry: dict[str, Any], unit: str) -> float:
    if "unit" not in entry:
        return 1.0
    return quantity(f"1 {_filled_in(entry, 'unit')}", unit, field="unit")


def _filled_in(entry: dict[str, Any], key: str) -> str:
    value = entry.get(key)
    if value is None:
        raise InputError("is missing", field=key)
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"expected a text, got {value!r}", field=key)
    return value
