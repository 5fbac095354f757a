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

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Six times as fast where PyYAML was built with libyaml."""

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
    try:
        _refuse_unbounded(text)
        return yaml.load(text, Loader=_LOADER)
    except InputError:
        raise
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = f" at line {mark.line + 1}" if mark is not None else ""
        raise InputError(f"not valid YAML{line}: {error.problem or 'unreadable'}") from None
    except Exception as error:  # such as a date that does not exist
        raise InputError(f"not valid YAML: {first_line(error)}") from None


def _refuse_unbounded(text: str) -> None:
    """Raise `InputError` if a YAML text is nested too deep or stands for too much."""
    sizes: dict[str, int] = {}
    open_: list[tuple[str | None, int]] = []
    total = 0
    for event in yaml.parse(text, Loader=_LOADER):
        anchor = getattr(event, "anchor", None)
        if isinstance(event, yaml.AliasEvent):
            if any(anchor == other for other, _ in open_):
                raise InputError("not valid YAML: an alias refers to what it is a part of")
            total += sizes.get(str(anchor), 0)
        elif isinstance(event, yaml.ScalarEvent):
            total += 1 + len(event.value)
            if anchor:
                sizes[anchor] = 1 + len(event.value)
        elif isinstance(event, yaml.CollectionStartEvent):
            open_.append((anchor, total))
            if len(open_) > DEEPEST:
                raise InputError(f"not valid YAML: nested more than {DEEPEST} levels deep")
            total += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_.pop()
            if anchor:
                sizes[anchor] = total - before
        if total > MOST:
            raise InputError(f"not valid YAML: its aliases stand for more than {MOST} characters")


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
