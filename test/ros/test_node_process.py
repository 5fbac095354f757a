"""The private ROS domain of the demo."""

from __future__ import annotations

import os
import random
from collections.abc import Sequence

import pytest

from hma_gripper_sim.ros.node_process import NodeError, private_ros_domain


@pytest.fixture
def first_try(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The domains that are tried, in order."""
    order: list[int] = []

    def sample(population: Sequence[int], _: int) -> list[int]:
        return order or list(population)

    monkeypatch.setattr(random, "sample", sample)
    return order


def test_domain_with_a_node_on_it_is_not_taken(first_try: list[int]) -> None:
    import rclpy

    context = rclpy.Context()
    with private_ros_domain() as occupied:
        context.init(domain_id=occupied)
        node = rclpy.create_node("occupant", context=context)
    try:
        first_try[:] = [occupied, *range(1, 102)]
        with private_ros_domain() as domain:
            assert domain != occupied
        first_try[:] = [occupied]
        with pytest.raises(NodeError, match="in use"), private_ros_domain():
            pass
    finally:
        node.destroy_node()
        context.try_shutdown()


def test_environment_is_private_and_restored(monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot's settings in the shell neither reach the demo nor get lost."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "42")
    monkeypatch.setenv("ROS_STATIC_PEERS", "192.0.2.1")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE")
    with private_ros_domain() as domain:
        assert os.environ["ROS_DOMAIN_ID"] == str(domain)
        assert os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
        assert "ROS_STATIC_PEERS" not in os.environ
    assert os.environ["ROS_DOMAIN_ID"] == "42"
    assert os.environ["ROS_STATIC_PEERS"] == "192.0.2.1"
    assert "ROS_AUTOMATIC_DISCOVERY_RANGE" not in os.environ
