"""The ROS 2 side: the node and what it is made of. Nothing else in the package imports rclpy.

==============  ==================================================================
sim_node        the executable; light, so that it is ready for signals at once
program         ROS, threads and signals around the node
node            the node: requests to the drive, and the ticks
inputs          the topics that command the drive, and what their messages say
listener        hears reliable publishers and best-effort ones
node_clock      the node's clock, and whether it stands still
company         who else on the graph does what only one should
publishers      everything that the node publishes
message_bytes   what serialised messages say, without deserialising them
markers         pictures as messages
diagnostics     the node's reports about itself
parameters      the settings as ROS parameters
arguments       ROS arguments on the command line
node_process    the node as a child process, started without ROS
client          programs that talk to the node
recording       logs what a running node says
interface_docs  writes down what the node offers: docs/ros_interface.md, SROS2 policy
==============  ==================================================================

The client's names are imported when they are first used: `sim_node` is not to wait for them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hma_gripper_sim.ros.client.gripper_client import (
        GripperClient,
        GripperError,
        GripperRefusedError,
        GripperTimeoutError,
    )
    from hma_gripper_sim.ros.client.state_listener import GripperState

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
    from hma_gripper_sim.ros.client import gripper_client

    return getattr(gripper_client, name)
