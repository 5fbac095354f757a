"""The executable ``sim_node``: ready for signals before anything slow is loaded."""

from __future__ import annotations

import os
import signal
import sys


def main(arguments: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM.

    Returns
    -------
    The exit code: 0, also after a signal at any moment; 2 when an argument or parameter cannot
    be used.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))  # nothing has been begun yet
    from hma_gripper_sim.ros.program import run_node

    try:
        return run_node(sys.argv if arguments is None else arguments)
    finally:
        # All is done: one more signal while Python ends must not change the exit code.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    sys.exit(main())
