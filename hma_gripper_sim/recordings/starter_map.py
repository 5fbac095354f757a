"""Where the signals of a log may be, guessed from types and names: a signal map to edit."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence

import yaml

from hma_gripper_sim.recordings.inspection import Inspection, Sender

_GUESSED = 6
"""Places of a signal that a starter map names."""

_LINEAR = ("slide", "linear", "prismatic", "lift", "rail")
"""In names of joints that go along a line."""

_OF_ARM = ("shoulder", "elbow", "wrist", "arm")
"""In names of joints of an arm, which turn."""

_TOOLS = ("tool", "tcp", "flange", "effector", "gripper", "hand", "mount")
"""In names of frames at the end of an arm."""

_UPWARDS = {"scale": "-1", "tare": "0.5 s"}
"""What counts upwards from anywhere is the other way round here, and begins at 0."""


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
    candidates = [*_of_senders(inspection), *_of_frames(inspection.senders)]
    for _, name, entry in sorted(candidates):
        guesses[name].append(entry)
    return guesses


def _of_senders(inspection: Inspection) -> Iterator[tuple[int, str, str]]:
    """Yield how far-fetched an entry is, the signal, and the entry."""
    senders = Counter((s.connection.file, s.connection.topic) for s in inspection.senders)
    for sender in inspection.senders:
        topic = quoted(sender.connection.topic)
        if senders[sender.connection.file, sender.connection.topic] > 1:
            topic += f", publisher: {quoted(sender.connection.publisher)}"
        elif sender.connection.publishers > 1 and not sender.joints and not sender.transforms:
            topic += ", publisher: any"
        if any(word in sender.connection.topic for word in ("cmd", "command")):
            yield from _of_commands(sender, topic)
        else:
            yield from _of_angles(sender, topic)
            yield from _of_joints(sender, topic)
            yield from _of_forces(sender, topic)
            if "pose.position.z" in sender.fields:
                yield 1, "travel", _entry(topic, "pose.position.z", **_UPWARDS)


def _of_commands(sender: Sender, topic: str) -> Iterator[tuple[int, str, str]]:
    kind = sender.connection.msgtype.rpartition("/")[2]
    if "data" in sender.fields and kind.startswith("Float"):
        yield 0, "velocity_command", _entry(topic, "data", optional="true")
    for path in ("twist.linear.z", "linear.z"):
        if path in sender.fields:
            yield 1, "velocity_command", _entry(topic, path, scale="-1", optional="true")


def _of_angles(sender: Sender, topic: str) -> Iterator[tuple[int, str, str]]:
    for index, side in enumerate(("left", "right")):
        for joint in sender.joints:
            # What comes before may be the prefix of a left or right gripper.
            before, is_angle, after = joint.rpartition("phi")
            if is_angle and side in (after or before):
                yield 0, f"phi_{side}", _entry(topic, "position", joint=quoted(joint))
        if "phi" in sender.connection.topic and "data[]" in sender.fields:
            yield 1, f"phi_{side}", _entry(topic, f"data[{index}]", unit="deg")


def _of_joints(sender: Sender, topic: str) -> Iterator[tuple[int, str, str]]:
    if "position[]" not in sender.fields:
        return
    for joint in sender.joints:
        if "phi" in joint:
            continue
        is_linear = any(word in joint.lower() for word in _LINEAR)
        is_arm = any(word in joint.lower() for word in _OF_ARM)
        yield (
            0 if is_linear and not is_arm else 4,
            "travel",
            _entry(topic, "position", joint=quoted(joint)),
        )
    if any(word in joint.lower() for joint in sender.joints for word in _OF_ARM):
        links = "{file: ROBOT.urdf, parent: base_link, child: tool0}"
        yield 3, "travel", _entry(topic, "transform.translation.z", urdf=links, **_UPWARDS)


def _of_forces(sender: Sender, topic: str) -> Iterator[tuple[int, str, str]]:
    for path in ("wrench.force", "force"):
        if f"{path}.z" in sender.fields:
            ours = "actuator" in sender.connection.topic
            sign = {} if ours else _UPWARDS
            yield int(not ours), "actuator_force", _entry(topic, f"{path}.z", **sign)
            # A tilted sensor shows a part of the force along each of its axes.
            tilted = {"direction": "[0, 0, -1]", "tare": "0.5 s"}
            yield 3, "actuator_force", _entry(topic, path, **tilted)
    if "force" in sender.connection.topic and "data" in sender.fields:
        yield 2, "actuator_force", _entry(topic, "data", tare="0.5 s")


def _of_frames(senders: Sequence[Sender]) -> Iterator[tuple[int, str, str]]:
    """Yield the heights of tools in the frame that their chain of transforms begins with."""
    parents = {frame.child: frame.parent for sender in senders for frame in sender.transforms}
    for sender in senders:
        if sender.connection.topic.endswith("_static"):
            continue
        moving = {frame.child for frame in sender.transforms}
        for child in parents:
            chain = _upwards(child, parents)
            if moving.isdisjoint(chain[:-1]):
                continue  # nothing in it moves
            is_tool = any(word in child.lower() for word in _TOOLS)
            yield (
                1 if is_tool else 2,
                "travel",
                _entry(
                    quoted(sender.connection.topic),
                    "transform.translation.z",
                    frame=f"{{parent: {quoted(chain[-1])}, child: {quoted(child)}}}",
                    **_UPWARDS,
                ),
            )


def _upwards(child: str, parents: dict[str, str]) -> list[str]:
    """Return a frame, its parent, and so on; a log may hold a circle, which ends it."""
    chain = [child]
    while (parent := parents.get(chain[-1])) is not None and parent not in chain:
        chain.append(parent)
    return chain


def _entry(topic: str, field: str, **more: str) -> str:
    """Return an entry in YAML's flow style, of texts that are YAML already but for the field."""
    parts = [f"topic: {topic}", f"field: {quoted(field)}"]
    parts += [f"{key}: {value}" for key, value in more.items()]
    return "{" + ", ".join(parts) + "}"


def quoted(text: str) -> str:
    """Return a text as YAML needs it."""
    plain = text.isascii() and all(c.isalnum() or c in "/_.- " for c in text)
    if plain and not text.startswith("-") and yaml.safe_load(text) == text:
        return text
    if not text.isprintable():  # control codes must not reach a terminal or a file
        return json.dumps(text)
    return "'" + text.replace("'", "''") + "'"
