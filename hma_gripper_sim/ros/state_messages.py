"""Simulation states as ROS messages.

A tick's messages are serialised once; then only the numbers in their bytes change. Publishing
them costs a fifth of what it takes rclpy to convert a message of 63 names every time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from hma_gripper_sim.bags.message_template import MessageTemplate, placeholders
from hma_gripper_sim.device.topics import ACTUATOR_WRENCH, JOINT_STATES, PHI
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.results.bending_moments import joints_at_sections
from hma_gripper_sim.results.robot_description import MOUNT
from hma_gripper_sim.simulation.simulation import SimulationState

Array = NDArray[np.float64]


def template(message: JointState | WrenchStamped | Clock, rows: Array) -> MessageTemplate:
    """Return the template of a message that is complete but for the `placeholders` in it."""
    serialised = serialize_message(message)
    if isinstance(message, JointState) and not message.effort:
        # Its serialisation aligns the end as if numbers followed; strict readers refuse that.
        end = serialised.rfind(message.velocity.tobytes()) + 8 * len(message.velocity)
        serialised = serialised[: end + 4]
    return MessageTemplate(serialised, rows)


class StateMessages:
    """The messages of one tick, all with one stamp.

    Parameters
    ----------
    scene
        What is simulated.
    prefix
        Of names of joints and frames.

    Attributes
    ----------
    by_topic
        Those of `STAMPED_TOPICS`.
    """

    def __init__(self, scene: Scene, prefix: str) -> None:
        self.by_topic = {
            JOINT_STATES: _joint_states(scene.joint_names, prefix),
            ACTUATOR_WRENCH: _actuator_wrench(prefix),
            PHI: _phi(has_moments=not joints_at_sections(scene)),
        }

    def fill(self, state: SimulationState, stamp: int) -> None:
        """Write a state, stamped with a time in nanoseconds, into all messages."""
        for message in self.by_topic.values():
            message.stamp(*divmod(stamp, 1_000_000_000))
        position, velocity, effort = self.by_topic[JOINT_STATES].numbers
        position[:] = state.joint_position
        velocity[:] = state.joint_velocity
        effort[:] = state.joint_effort
        (force,) = self.by_topic[ACTUATOR_WRENCH].numbers
        force[0] = state.actuator_force
        angle, rate, *moments = self.by_topic[PHI].numbers
        angle[:] = state.phi_left, state.phi_right
        rate[:] = state.phi_left_rate, state.phi_right_rate
        for moment in moments:
            moment[:] = state.moment_left, state.moment_right


def _joint_states(joint_names: Sequence[str], prefix: str) -> MessageTemplate:
    rows = placeholders(3, len(joint_names))
    position, velocity, effort = rows.tolist()
    names = [prefix + name for name in joint_names]
    message = JointState(name=names, position=position, velocity=velocity, effort=effort)
    return template(message, rows)


def _actuator_wrench(prefix: str) -> MessageTemplate:
    rows = placeholders(1, 1)
    message = WrenchStamped()
    message.header.frame_id = prefix + MOUNT
    message.wrench.force.z = float(rows[0, 0])
    return template(message, rows)


def _phi(*, has_moments: bool) -> MessageTemplate:
    rows = placeholders(3 if has_moments else 2, 2)
    names = ["phi_left", "phi_right"]
    message = JointState(name=names, position=rows[0].tolist(), velocity=rows[1].tolist())
    if has_moments:
        message.effort = rows[2].tolist()
    return template(message, rows)
