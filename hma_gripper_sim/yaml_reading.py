"""Reading YAML files, and where those are that come with the package.

A text of a few lines can be nested deeper than a parser can follow, and its aliases can stand for
more than a memory holds: both are bounded.
"""

from __future__ import annotations

import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from hma_gripper_sim.errors import InputError, first_line

LARGEST_TEXT = 2**24
"""Bytes of a text file: a larger one is something else, such as a log."""

LONGEST_YAML = 2**21
"""Characters of a YAML text."""

DEEPEST = 50
"""Levels of nesting."""

MOST = 2**22
"""Characters and nodes with every alias written out."""


def refuse_unknown(
    mapping: Mapping[str, object], known: tuple[str, ...], *, source: str | None = None
) -> None:
    """Raise `InputError` naming the first key of `mapping` that is not `known`."""
    for key in mapping:
        if key not in known:
            raise InputError(
                f"unknown field (known: {', '.join(known)})", field=str(key), source=source
            )


def read_text(path: str | Path) -> str:
    """Read a UTF-8 text file; raise `InputError` if that is not possible."""
    try:
        status = Path(path).stat()
        if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
            raise InputError("cannot be read: it is no regular file", source=str(path))
        if status.st_size > LARGEST_TEXT:
            reason = f"cannot be read: {status.st_size} bytes are more than a text has"
            raise InputError(reason, source=str(path))
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise InputError(f"cannot be read: {reason}", source=str(path)) from None


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read a YAML file whose top level is a mapping.

    Raises
    ------
    InputError
        The file cannot be read, is not YAML, or holds something else.
    """
    source, text = str(path), read_text(path)
    try:
        content = load_yaml(text)
    except InputError as error:
        raise error.within(source=source) from None
    if not isinstance(content, dict):
        raise InputError("expected a mapping of fields at the top level", source=source)
    return content


def load_yaml(text: str) -> Any:
    """Return the content of a YAML text.

    Raises
    ------
    InputError
        It is not valid, or beyond the bounds.
    """
    if len(text) > LONGEST_YAML:
        raise InputError(f"has {len(text)} characters: at most {LONGEST_YAML} are read as YAML")
    loader = None
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _measure(node, {})
        return loader.construct_document(node)
    except InputError:
        raise
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = f" at line {mark.line + 1}" if mark is not None else ""
        raise InputError(f"not valid YAML{line}: {error.problem or 'unreadable'}") from None
    except Exception as error:  # such as a date that does not exist
        raise InputError(f"not valid YAML: {first_line(error)}") from None
    finally:
        if loader is not None:
            loader.dispose()


class _Loader(yaml.SafeLoader):
    """Composes no deeper than `DEEPEST`."""

    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        self._depth += 1
        if self._depth > DEEPEST:
            raise InputError(f"not valid YAML: nested more than {DEEPEST} levels deep")
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def _measure(node: yaml.Node, known: dict[int, int]) -> int:
    """Return the size of a node with its aliases written out."""
    size = known.get(id(node))
    if size is not None:
        if not size:
            raise InputError("not valid YAML: an alias refers to what it is a part of")
        return size
    known[id(node)] = 0
    size = 1
    if isinstance(node, yaml.ScalarNode):
        size += len(node.value)
    elif isinstance(node, yaml.MappingNode):
        size += sum(_measure(part, known) for pair in node.value for part in pair)
    elif isinstance(node, yaml.SequenceNode):
        size += sum(_measure(part, known) for part in node.value)
    if size > MOST:
        raise InputError(f"not valid YAML: its aliases stand for more than {MOST} characters")
    known[id(node)] = size
    return size


def config_directory() -> Path:
    """The shipped ``config`` directory: of a checkout, a wheel or a colcon workspace.

    Raises
    ------
    FileNotFoundError
        The package was installed without its data files.
    """
    package = Path(__file__).resolve().parent
    if (package.parent / "package.xml").is_file():
        return package.parent / "config"
    for parent in package.parents:
        candidate = parent / "share" / package.name / "config"
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"no share/{package.name}/config above {package}: reinstall it")
