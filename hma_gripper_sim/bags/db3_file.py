"""Reading db3 files: the SQLite databases of rosbag2, of every version of their schema."""

from __future__ import annotations

import sqlite3
from collections.abc import Container, Iterator
from contextlib import closing
from pathlib import Path

from hma_gripper_sim.bags.message_batches import (
    CDR,
    Batch,
    Connection,
    Findings,
    absolute,
    count_profiles,
    full_type,
)
from hma_gripper_sim.errors import InputError

MAGIC = b"SQLite format 3\0"

_GROUP = 4 * 2**20
"""Bytes of messages that are put together."""

_EARLIER = {"serialization_format": "'cdr'", "offered_qos_profiles": "''"}
"""What columns that the first versions lack would hold."""


class Db3File:
    """One db3 file.

    Parameters
    ----------
    path
        Of the database, which needs no journal.
    name
        Of the file, as it is called in errors.
    findings
        Takes what is found out.
    topics
        Those whose messages are wanted.
    """

    def __init__(self, path: Path, name: str, findings: Findings, topics: Container[str]) -> None:
        self._path = path
        self._name = name
        self._findings = findings
        self._topics = topics

    def batches(self) -> Iterator[Batch]:
        """Yield the wanted messages in the order they were logged.

        Raises
        ------
        InputError
            The database lacks what rosbag2 writes.
        sqlite3.Error
            It is damaged.
        """
        address = f"{self._path.absolute().as_uri()}?immutable=1"
        with closing(sqlite3.connect(address, uri=True)) as database:
            database.text_factory = lambda text: text.decode(errors="replace")
            connections = dict(self._connections(database))
            others = [n for n, known in connections.items() if known.topic not in self._topics]
            group: list[tuple[Connection, int, bytes]] = []
            size = lost = 0
            marks = ", ".join("?" * len(others))
            for number, logged, data in database.execute(
                "SELECT topic_id, timestamp, data FROM messages "
                f"WHERE (topic_id IN ({marks})) IS NOT TRUE ORDER BY timestamp, id",  # nor if NULL
                others,
            ):
                if number not in connections:
                    lost += 1
                    continue
                if not isinstance(logged, int) or not isinstance(data, bytes):
                    raise InputError("a message is no bytes with a time: the file is damaged")
                group.append((connections[number], logged, data))
                size += len(data)
                if size > _GROUP:
                    yield Batch.of(group)
                    group, size = [], 0
            if group:
                yield Batch.of(group)
            if lost:
                self._findings.lose(
                    f"{self._name}: {lost} message{'s' if lost > 1 else ''} left out, of no topic "
                    "that it names: the file is damaged"
                )

    def _connections(self, database: sqlite3.Connection) -> Iterator[tuple[int, Connection]]:
        tables = {
            str(row[0])
            for row in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        }
        if not tables >= {"topics", "messages"}:
            raise InputError("it is a database without the tables that rosbag2 writes")
        definitions: dict[str, tuple[str, str]] = {}
        if "message_definitions" in tables:
            rows = database.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
            )
            definitions = {str(name): (str(kind), str(text)) for name, kind, text in rows}
        present = {str(row[1]) for row in database.execute("PRAGMA table_info(topics)")}
        columns = [name if name in present else _EARLIER[name] for name in _EARLIER]
        rows = database.execute(f"SELECT id, name, type, {', '.join(columns)} FROM topics")
        for number, topic, msgtype, encoding, qos in rows:
            kind, definition = definitions.get(str(msgtype), ("", ""))
            connection = Connection(
                file=self._name,
                topic=absolute(str(topic)),
                msgtype=full_type(str(msgtype)),
                publisher=str(number),
                publishers=count_profiles(str(qos)),
                encoding=str(encoding) or CDR,
                definition=definition,
                is_idl=kind == "ros2idl",
            )
            self._findings.add(connection)
            yield number, connection
