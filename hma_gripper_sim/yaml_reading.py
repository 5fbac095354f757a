"""Reading YAML files, and where those are that come with the package."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from hma_gripper_sim.errors import InputError


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
        content = yaml.safe_load(text)
    except ValueError as error:  # such as a date that does not exist
        raise InputError(f"not valid YAML: {error}", source=source) from None
    except yaml.YAMLError as error:
        where = getattr(error, "problem_mark", None)
        line = f" at line {where.line + 1}" if where is not None else ""
        problem = getattr(error, "problem", None) or "unreadable"
        raise InputError(f"not valid YAML{line}: {problem}", source=source) from None
    if not isinstance(content, dict):
        raise InputError("expected a mapping of fields at the top level", source=source)
    return content


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
