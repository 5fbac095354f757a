"""States as messages: what others read from the bytes."""

from __future__ import annotations

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene, Simulation

pytest.importorskip("rclpy", reason="ROS 2 is not installed")


@pytest.mark.parametrize("discretisation", ["thesis", "midpoint"])
def test_the_bytes_of_a_tick_say_what_the_state_is(discretisation):
    from geometry_msgs.msg import WrenchStamped
    from rclpy.serialization import deserialize_message
    from sensor_msgs.msg import JointState

    from hma_gripper_sim.device.tick_messages import TickMessages
    from hma_gripper_sim.device.topics import ACTUATOR_WRENCH, JOINT_STATES, PHI

    scene = Scene(
        GripperDesign.thesis_2013(),
        Circle(0.015),
        clearance=0.001,
        offset=0.001,
        discretisation=discretisation,
    )
    simulation = Simulation(scene)
    messages = TickMessages(scene, "left_")
    for stamp in (1, 1_700_000_000_123_456_789):  # filled again, nothing of before is left
        simulation.step(0.1, 0.02)
        state = simulation.state()
        content = messages.of_tick(state, stamp)
        joints = deserialize_message(content[JOINT_STATES], JointState)
        phi = deserialize_message(content[PHI], JointState)
        wrench = deserialize_message(content[ACTUATOR_WRENCH], WrenchStamped)
        for message in (joints, phi, wrench):
            time = message.header.stamp
            assert time.sec * 1_000_000_000 + time.nanosec == stamp
        assert list(joints.name) == [f"left_{name}" for name in scene.joint_names]
        assert np.array_equal(joints.position, state.joint_position)
        assert np.array_equal(joints.velocity, state.joint_velocity)
        assert np.array_equal(joints.effort, state.joint_effort)
        assert list(phi.name) == ["phi_left", "phi_right"]
        assert list(phi.position) == [state.phi_left, state.phi_right]
        assert list(phi.velocity) == [state.phi_left_rate, state.phi_right_rate]
        assert state.phi_left != state.phi_right
        moments = [state.moment_left, state.moment_right]
        assert list(phi.effort) == ([] if discretisation == "thesis" else moments)
        assert wrench.header.frame_id == "left_gripper_mount"
        force, torque = wrench.wrench.force, wrench.wrench.torque
        assert force.z == state.actuator_force
        assert [force.x, force.y, torque.x, torque.y, torque.z] == [0.0] * 5
