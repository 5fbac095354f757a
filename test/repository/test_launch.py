"""The launch file, where ROS 2's launch is installed; no wheel brings it."""

from __future__ import annotations

import runpy

import pytest

from hma_gripper_sim import config_directory


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        ({}, (False, False)),
        ({"description": "true"}, (True, False)),
        ({"rviz": "true"}, (True, True)),
    ],
)
def test_the_launch_file_starts_what_is_asked_for(told, expected) -> None:
    actions = pytest.importorskip("launch_ros.actions", reason="ros2 launch is not installed")
    launch = pytest.importorskip("launch")
    file = runpy.run_path(str(config_directory().parent / "launch" / "sim.launch.py"))
    description = file["generate_launch_description"]()
    arguments = {item.name: item.default_value for item in description.get_launch_arguments()}
    context = launch.LaunchContext()
    defaults = {
        name: value[0].perform(context)
        for name, value in arguments.items()
        if name != "params_file"
    }
    context.launch_configurations.update(defaults | {"params_file": "sim_node.yaml"} | told)
    (node,) = file["sim_node"](context)
    (publisher,) = file["robot_state_publisher"](context)
    (rviz,) = (entity for entity in description.entities if isinstance(entity, actions.Node))
    assert node.condition is None
    assert (publisher.condition.evaluate(context), rviz.condition.evaluate(context)) == expected
