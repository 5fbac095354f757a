"""The executable ``sim_node``: ready for signals before anything slow is loaded."""

from __future__ import annotations

import os
import signal
import sys

HELP = """\
usage: sim_node [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]

Simulates the gripper as a ROS 2 node. It takes velocities, positions and trajectories of the
prismatic joint, and publishes the state of all joints, the actuator's force and the angles phi.

  sim_node --ros-args -p contour:=cylinder -p friction:=0.8
  sim_node --ros-args --params-file my_sim_node.yaml
  sim_node --ros-args -p use_sim_time:=true -r __ns:=/left -p prefix:=left_

A file to copy is config/sim_node.yaml in $(ros2 pkg prefix --share hma_gripper_sim). It explains
every parameter, and so does `ros2 param describe`; docs/ros_interface.md has all the rest.
The first start compiles the solver, which takes up to two minutes, once.

Exit code: 0  after SIGINT or SIGTERM
           2  an argument or parameter cannot be used: one line says which and why"""


def main(arguments: list[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM.

    Returns
    -------
    The exit code: 0, also after a signal at any moment; 2 when an argument or parameter cannot
    be used.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: os._exit(0))  # nothing has been begun yet
    given = sys.argv if arguments is None else arguments
    if {"-h", "--help"} & set(given):
        print(HELP)
        return 0
    from hma_gripper_sim.ros.program import run_node

    try:
        return run_node(given)
    finally:
        # All is done: one more signal while Python ends must not change the exit code.
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)


if __name__ == "__main__":
    sys.exit(main())
