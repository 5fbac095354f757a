"""Snippets of the documentation that talk to a running node."""

from __future__ import annotations

import numpy as np
import pytest
from documentation import SNIPPETS

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

import rclpy

CLIENTS = [s for s in SNIPPETS if "GripperClient()" in s.code]
(ARM,) = (s for s in SNIPPETS if s.uses_ros and s not in CLIENTS)


@pytest.mark.parametrize("code", [pytest.param(s.code, id=s.name) for s in CLIENTS])
def test_clients_press_and_come_back(code, start_node, connect, capsys):
    client = connect(start_node(real_time_factor=4.0))
    exec(code, {})
    assert "force" in capsys.readouterr().out
    client.wait(lambda: abs(client.joints[-1].position[0]) < 1e-6)
    client.wait(lambda: max(message.wrench.force.z for message in client.wrenches) > 0.3)


def test_an_arms_velocity_along_its_tool_moves_the_gripper(start_node, connect):
    client = connect(start_node(command_timeout=0.0, real_time_factor=4.0))
    names: dict = {}
    exec(ARM.code, names)
    rclpy.init()
    try:
        arm = names["Arm"]()
        client.wait(arm.gripper.get_subscription_count)
        axis = np.array([0.0, 0.6, -0.8])
        arm.on_tool_velocity(0.005 * axis, axis)
        client.wait(lambda: client.joints[-1].position[0] > 0.006)
        rclpy.spin_once(arm, timeout_sec=5.0)
        assert arm.force > 0.0  # 2 mm into the box
        arm.destroy_node()
    finally:
        rclpy.try_shutdown()
