"""Reads mutated logs in every way that logs are stored, and counts what comes of it.

Every log is damaged at random: bytes are changed, cut off, left out, doubled, zeroed, or replaced
by numbers that are hard to believe. Reading it must end within 5 s and 500 MB in an error of one
line, or in signals. A number other than in the whole log, without a word about it, is counted: it
must not come where the format carries a checksum.

    python tools/log_mutations.py [COUNT] [SEED]

Exits with 1 if anything of that does not hold.
"""

from __future__ import annotations

import random
import resource
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "fixtures"))

from made_up_logs import STORAGES, serialised, ticks

from hma_gripper_sim.bags.log_writer import LogWriter
from hma_gripper_sim.device.topics import LOGGED_TOPICS

LONGEST, LARGEST = 5.0, 500.0
"""Time [s] and memory [MB] of reading one log."""

CHECKED = {
    "ours",
    "mcap",
    "mcap, zstd chunks",
    "mcap, lz4 chunks",
    "mcap without chunks",
    "mcap_ros2",
}
"""Storages whose files carry a checksum of every message."""

EXTREMES = (
    bytes(4),
    b"\xff" * 4,
    b"\xff\xff\xff\x7f",
    b"\x00\x00\x00\x80",
    bytes(8),
    b"\xff" * 8,
    b"\xff" * 7 + b"\x7f",
    b"\x00\xca\x9a\x3b" + bytes(4),
)


def ours(folder: Path, entries: Any) -> Path:
    """A log of our own writer."""
    path = folder / "bag"
    with LogWriter(path, LOGGED_TOPICS, compressed=True) as log:
        for topic, stamp, message in entries:
            log.write(topic.name, stamp, serialised(message))
    return path


def mutate(data: bytes, chance: random.Random) -> bytes:
    """Damage the bytes of a file."""
    changed = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 2, 5))):
        if not changed:
            break
        at = chance.randrange(len(changed))
        end = min(len(changed), at + chance.choice((1, 4, 8, 64, 1000)))
        kind = chance.randrange(8)
        if kind == 0:
            changed[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            changed[at:end] = chance.randbytes(end - at)
        elif kind == 2:
            del changed[at:]
        elif kind == 3:
            del changed[at:end]
        elif kind == 4:
            changed[at:at] = changed[at:end]
        elif kind == 5:
            changed[at:end] = bytes(end - at)
        elif kind == 6:
            extreme = chance.choice(EXTREMES)
            changed[at : at + len(extreme)] = extreme
        else:
            other = chance.randrange(len(changed))
            size = min(64, len(changed) - max(at, other))
            changed[at : at + size], changed[other : other + size] = (
                changed[other : other + size],
                changed[at : at + size],
            )
    return bytes(changed)


def reader(link: Connection) -> None:
    """Read the logs whose paths come over a link; send back what came of each."""
    from hma_gripper_sim.errors import InputError
    from hma_gripper_sim.recordings.reading import read_recording

    while (path := link.recv()) is not None:  # None: no more
        began = time.monotonic()
        try:
            recording = read_recording(path)
            signals = {
                name: [
                    (recording.start + round(1e9 * at), value)
                    for at, value in zip(series.time.tolist(), series.value.tolist(), strict=True)
                ]
                for name, series in recording.signals.items()
            }
            answer: Any = ("read", signals, recording.notes)
        except InputError as error:
            answer = ("refused", str(error), ())
        except BaseException:
            answer = ("traceback", traceback.format_exc(), ())
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        link.send((*answer, time.monotonic() - began, used))


class Reader:
    """A process that reads logs, and is started anew when one was too much for it."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self._link, theirs = context.Pipe()
        self._process = context.Process(target=reader, args=(theirs,), daemon=True)
        self._process.start()

    def read(self, path: Path, patience: float = LONGEST) -> Any:
        """Return what came of it, as `reader` sends it; None if it took too long."""
        self._link.send(path)
        try:
            answer = self._link.recv() if self._link.poll(patience) else None
        except EOFError:
            answer = ("traceback", "the process died", (), 0.0, 0.0)
        if answer is None or answer[1] == "the process died":
            self._process.kill()
            self._process.join()
            self._start()
        return answer

    def end(self) -> None:
        """Let the process end."""
        self._link.send(None)
        self._process.join()


def main() -> int:
    """Mutate, read, count."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    chance = random.Random(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    storages = {**STORAGES, "ours": ours}
    outcomes: dict[str, Counter[str]] = {name: Counter() for name in storages}
    slowest, largest, bad = 0.0, 0.0, 0
    with tempfile.TemporaryDirectory() as scratch:
        whole = {}
        process = Reader()
        for number, (name, store) in enumerate(storages.items()):
            folder = Path(scratch, f"whole {number}")
            folder.mkdir()
            path = store(folder, ticks(30))
            answer = process.read(path, 300.0)
            whole[name] = path, answer[1] if answer[0] == "read" else None
            base = answer[4]
        for number in range(count):
            name = chance.choice([*storages])
            path, expected = whole[name]
            copy = Path(scratch, f"log {number}{path.suffix}")
            (shutil.copytree if path.is_dir() else shutil.copy)(path, copy)
            files = sorted(copy.iterdir()) if copy.is_dir() else [copy]
            files = [
                file for file in files if file.name != "metadata.yaml" or chance.random() < 0.3
            ]
            file = chance.choice(files)
            file.write_bytes(mutate(file.read_bytes(), chance))
            answer = process.read(copy)
            said = verdict(answer, expected)
            if answer is not None:
                slowest, largest = max(slowest, answer[3]), max(largest, answer[4] - base)
                if answer[4] - base > LARGEST:
                    said = "too large"
            outcomes[name][said] += 1
            failed = said in ("traceback", "hang", "too large") or (
                said == "another number" and name in CHECKED
            )
            if failed:
                bad += 1
                kept = Path(tempfile.mkdtemp(prefix="mutated "), copy.name)
                shutil.move(copy, kept)
                print(f"{said}: {name}: {file.name} of {kept}")
                print(answer[1] if answer and said == "traceback" else "")
            elif copy.is_dir():
                shutil.rmtree(copy)
            else:
                copy.unlink()
        process.end()
    kinds = sorted({kind for counts in outcomes.values() for kind in counts})
    print(f"{'storage':35}", *(f"{kind:>16}" for kind in kinds))
    for name, counts in outcomes.items():
        mark = "*" if name in CHECKED else " "
        print(f"{mark}{name:34}", *(f"{counts[kind]:16}" for kind in kinds))
    print("* carries a checksum of every message")
    print(f"slowest {slowest:.2f} s, largest {largest:.0f} MB above the whole logs")
    return min(bad, 1)


def verdict(answer: Any, expected: Any) -> str:
    """Return what came of a log in a word."""
    if answer is None:
        return "hang"
    outcome, signals, notes = answer[:3]
    if outcome != "read":
        return (
            str(outcome) if "\n" not in signals.strip() or outcome == "traceback" else "traceback"
        )
    if expected is None:
        return "read"
    for name, samples in signals.items():
        if not set(samples) <= set(expected.get(name, ())):
            return "changed, noted" if told(notes) else "another number"
    same = all(signals.get(name) == samples for name, samples in expected.items())
    if same:
        return "as before"
    return "less, noted" if told(notes) else "less, not noted"


def told(notes: Any) -> bool:
    """Return whether notes say that something is missing or out of order."""
    words = (
        "truncated",
        "damaged",
        "left out",
        "passed over",
        "skipped",
        "empty",
        "order",
        "front",
    )
    return any(word in note for note in notes for word in words)


if __name__ == "__main__":
    sys.exit(main())
