"""Asking a running node for its parameters."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from hma_gripper_sim.device.setting_definitions import FIELDS


def ask_parameters(context: Context, name: str, patience: float) -> dict[str, Any]:
    """Return what a simulation node simulates, by parameter name; empty if it does not answer.

    Parameters
    ----------
    name
        Full name of the node.
    patience
        How long it may take [s].
    """
    node = Node("hma_gripper_parameters", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def ask(kind: Any, service: str, request: Any) -> Any:
        client = node.create_client(kind, f"{name}/{service}")
        if not client.wait_for_service(timeout_sec=patience):
            return None
        future = client.call_async(request)
        executor.spin_until_future_complete(future, timeout_sec=patience)
        return future.result() if future.done() else None

    try:
        listed = ask(ListParameters, "list_parameters", ListParameters.Request())
        if listed is None:
            return {}
        names = [n for n in listed.result.names if n in FIELDS or n.startswith("contours.")]
        answer = ask(GetParameters, "get_parameters", GetParameters.Request(names=names))
        if answer is None or len(answer.values) != len(names):
            return {}
        values = map(parameter_value_to_python, answer.values)
        return {n: _plain(value) for n, value in zip(names, values, strict=True)}
    finally:
        executor.shutdown()
        node.destroy_node()


def _plain(value: Any) -> Any:
    return value if isinstance(value, (bool, int, float, str)) else list(value)
