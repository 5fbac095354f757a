"""Machine code of kernels on disk, so that only the first start has to compile them.

numba's own cache compares a function with the file in which it stands, but kernels are inlined
into each other across files. Here the folder is named after everything that machine code depends
on, so that the code of other kernels is never even looked at. Each signature of a kernel has a
file of its own, which is complete or counts as missing: processes that start together, or are
killed while they write, cannot spoil it for each other.
"""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.caching import NullCache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps
from platformdirs import user_cache_path

KEPT_VERSIONS = 8
"""Versions of the kernels whose machine code stays on disk; of more, the oldest is deleted."""

_MANY = 10
"""From so many missing kernels on, nearly all are: whoever waits is told what is happening."""

_log = logging.getLogger("hma_gripper_sim")
_missing = count(1)


class MachineCodeCache(NullCache):  # type: ignore[misc]
    """The machine code of one kernel; numba's dispatcher asks for it and hands it in.

    Parameters
    ----------
    function
        The kernel.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._name = f"{function.__module__}.{function.__qualname__}"
        self._source = str(sys.modules[function.__module__].__file__)

    @property
    def cache_path(self) -> str | None:
        """The folder; None where there is none."""
        folder = _folder()
        return str(folder) if folder else None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature; None where it is to be compiled."""
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        try:
            content = _read(path) if path else None
        except OSError:
            content = None
        if content is None:
            if next(_missing) == _MANY:
                _log.warning(
                    "compiling the solver for this processor: once, which takes up to two minutes"
                )
            return None
        return CompileResult._rebuild(target_context, *pickle.loads(content))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write the machine code for a signature; where that fails, this process has it alone."""
        path = self._path(sig, data.codegen)
        if path is None:
            _say_not_kept("there is no folder for it")
            return
        try:
            _write(path, dumps(data._reduce()))
        except OSError as error:
            _say_not_kept(f"{error.strerror}: {path.parent}")

    def _path(self, sig: Any, codegen: Any) -> Path | None:
        folder = _folder()
        if folder is None:
            return None
        what = (_digest(self._source), str(sig), codegen.magic_tuple())
        return folder / f"{self._name}-{hashlib.sha256(repr(what).encode()).hexdigest()[:16]}"


@cache
def _folder() -> Path | None:
    """Where the machine code of these kernels is kept: of no others, and of no other compiler."""
    chosen = numba.config.CACHE_DIR
    try:
        folder = Path(chosen).absolute() if chosen else user_cache_path()
    except RuntimeError:  # the user has no home
        return None
    sources = sorted(Path(__file__).parent.glob("*.py"))
    if not folder.is_absolute() or not sources:  # no home, or nothing to tell versions apart by
        return None
    compilers = numba.__version__, llvmlite.__version__, np.__version__, sys.version
    contents = [(source.name, _digest(str(source))) for source in sources]
    key = hashlib.sha256(repr((compilers, contents)).encode()).hexdigest()[:16]
    return folder / "hma_gripper_sim" / key


@cache
def _digest(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _read(path: Path) -> bytes | None:
    """Return the content of a file; None if it is not as it was written."""
    content = path.read_bytes()
    checksum, content = content[:32], content[32:]
    return content if hashlib.sha256(content).digest() == checksum else None


def _write(path: Path, content: bytes) -> None:
    """Write a file as a whole or not at all."""
    if not path.parent.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        _delete_oldest(path.parent.parent)
    handle, temporary = tempfile.mkstemp(dir=path.parent)
    try:
        with open(handle, "wb") as file:
            file.write(hashlib.sha256(content).digest() + content)
        os.replace(temporary, path)
    except OSError:
        os.unlink(temporary)
        raise


def _delete_oldest(folder: Path) -> None:
    with suppress(OSError):  # another process may be doing the same
        versions = sorted(folder.iterdir(), key=lambda version: version.stat().st_mtime)
        for version in versions[:-KEPT_VERSIONS]:
            shutil.rmtree(version, ignore_errors=True)


@cache
def _say_not_kept(reason: str) -> None:
    _log.warning(
        "the compiled solver cannot be kept, so that every start compiles it anew (%s); "
        "NUMBA_CACHE_DIR names another folder",
        reason,
    )
