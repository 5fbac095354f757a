"""The one place that decides how kernels run: compiled by numba, or as plain Python."""

from __future__ import annotations

import warnings
from collections.abc import Callable
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
    from hma_gripper_sim.kernels.machine_code import MachineCodeCache

    COMPILED = not numba.config.DISABLE_JIT


def kernel(function: Kernel) -> Kernel:
    """Compile `function` on its first call and keep the machine code on disk.

    A kernel must not allocate: reference counting is off.  Kernels are inlined into their
    callers.  Both because a call would otherwise cost more than most kernels do: it counts and
    copies every array of the named tuples that are passed.
    """
    if not COMPILED:
        return function
    compile_kernel = numba.njit(error_model="numpy", _nrt=False, forceinline=True)
    dispatcher = compile_kernel(function)
    dispatcher._cache = MachineCodeCache(function)
    return cast(Kernel, dispatcher)
