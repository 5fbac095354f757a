"""The robot description and the running node: one gripper, at one place."""

from __future__ import annotations

import io

import numpy as np
import pytest
from click.testing import CliRunner

from hma_gripper_sim.cli.main import cli

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from visualization_msgs.msg import MarkerArray


def test_joint_states_move_the_links_to_where_the_node_draws_the_gripper(
    start_node, connect, tmp_path
):
    yourdfpy = pytest.importorskip("yourdfpy")
    parameters = tmp_path / "node.yaml"
    parameters.write_text(
        "/**: {ros__parameters: {discretisation: midpoint, elements_beam: 5, command_timeout: 0.0,"
        " contours: {mug: {type: circle, radius: 0.015, clearance: 0.001, offset: 0.002}},"
        " contour: mug, real_time_factor: 4.0, markers_rate: 100.0}}"
    )
    text = CliRunner().invoke(cli, ["urdf", "--params-file", str(parameters)]).output
    robot = yourdfpy.URDF.load(io.StringIO(text), load_meshes=False)

    client = connect(start_node("--params-file", str(parameters)))
    pictures = client.listen(MarkerArray, "/hma_gripper_sim/markers", latched=True)
    client.command(0.004)
    client.wait(lambda: client.joints[-1].position[0] > 0.006)
    client.call("pause", True)
    client.wait(lambda: client.joints[-1] == client.joints[-2])
    state, wrench = client.joints[-1], client.wrenches[-1]
    client.wait(lambda: pictures and pictures[-1].markers[0].header.stamp == state.header.stamp)
    gripper = next(marker for marker in pictures[-1].markers if marker.ns == "gripper")
    assert gripper.header.frame_id == wrench.header.frame_id == robot.base_link

    assert list(state.name) == [joint.name for joint in robot.robot.joints]
    robot.update_cfg(dict(zip(state.name, state.position, strict=True)))
    drawn = np.array([(point.x, point.y, point.z) for point in gripper.points])
    count = 0
    for link in robot.robot.links:
        for visual in link.visuals:
            if visual.geometry.box is not None:
                frame = robot.get_transform(link.name, robot.base_link) @ visual.origin
                x, _, z = 0.5 * np.asarray(visual.geometry.box.size)
                for a, b in ((x, z), (x, -z), (-x, z), (-x, -z)):
                    corner = (frame @ (a, 0.0, b, 1.0))[:3]
                    assert np.linalg.norm(drawn - corner, axis=1).min() < 1e-9
                    count += 1
    assert count == 4 * (1 + 2 * (2 + 1 + 5 + 2))  # middle; per side: bars, corner, tip
