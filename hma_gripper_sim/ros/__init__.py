"""The ROS 2 side: the node and what it is made of. Nothing else in the package imports rclpy.

=================  ==================================================================
sim_node           the executable; light, so that it is ready for signals at once
program            ROS, threads and signals around the node
node               the node: requests to the drive, and the ticks
commands           the topics that command the drive, and what their messages say
outputs            everything that the node publishes
messages           states as messages
markers            pictures as messages
diagnostics        the node's reports about itself
fields             what can be set, with ranges and descriptions
settings           what is set: the one place that validates it
parameters         the same as ROS parameters
mailbox            calls from ROS callbacks, carried out between two ticks
timeline           when each tick is due, and the time stamp it carries
arguments          ROS arguments on the command line
client             GripperClient, for programs that command the node
state_listener     what the client knows of the node
motion_sender      what it sends to it
own_node           ROS for programs that have no node
parameter_file     a parameter file, read without ROS
parameter_query    what is set on a running node
recorder           listens to the node, and logs what it says
recording_session  records until a signal, a duration or the node's end
interface          writes down what the node offers: docs/ros_interface.md, SROS2 policy
=================  ==================================================================

The client's names are imported when they are first used: `sim_node` is not to wait for them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hma_gripper_sim.ros.client import (
        GripperClient,
        GripperError,
        GripperRefusedError,
        GripperTimeoutError,
    )
    from hma_gripper_sim.ros.state_listener import GripperState

__all__ = [
    "GripperClient",
    "GripperError",
    "GripperRefusedError",
    "GripperState",
    "GripperTimeoutError",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from hma_gripper_sim.ros import client

    return getattr(client, name)
