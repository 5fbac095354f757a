"""The one place that decides how kernels run: compiled by numba, or as plain Python."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

try:
    import numba
except ImportError:
    COMPILED = False
    warnings.warn(
        "numba is not installed: the simulation runs as plain Python, about 200 times slower; "
        "`pip install numba` compiles it",
        RuntimeWarning,
        stacklevel=2,
    )
else:
    COMPILED = not numba.config.DISABLE_JIT


def _drop_stale_machine_code() -> None:
    """Delete cached machine code older than any kernel.

    numba compares a cached function with its own source file only, not with the kernels that
    it calls.
    """
    folder = Path(__file__).parent
    newest = max(source.stat().st_mtime for source in folder.glob("*.py"))
    for index in folder.glob("__pycache__/*.nbi"):
        if index.stat().st_mtime < newest:
            index.unlink(missing_ok=True)


_drop_stale_machine_code()


def kernel(function: Kernel) -> Kernel:
    """Compile `function` on its first call and keep the machine code on disk.

    A kernel must not allocate: reference counting is off.  Kernels are inlined into their
    callers.  Both because a call would otherwise cost more than most kernels do: it counts and
    copies every array of the named tuples that are passed.
    """
    if not COMPILED:
        return function
    compiled = numba.njit(cache=True, error_model="numpy", fastmath={"contract"}, _nrt=False, forceinline=True)
    return cast(Kernel, compiled(function))
