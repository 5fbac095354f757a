"""The settings as ROS parameters: declared with description, range and read-only flag."""

from __future__ import annotations

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from hma_gripper_sim.device.setting_definitions import Field, field_of
from hma_gripper_sim.device.settings import Settings
from hma_gripper_sim.errors import InputError

ROS_OWN = ("use_sim_time", "start_type_description_service", "qos_overrides")
"""Parameters, and prefixes of parameters, that every node has."""


def declare_parameters(node: Node) -> Settings:
    """Validate what the node was started with, then declare every parameter.

    The node must have been made with ``automatically_declare_parameters_from_overrides``: only
    so it knows which names were given, among them those of the objects.

    Raises
    ------
    InputError
        Naming the parameter that cannot be used. Nothing has been declared then.
    """
    given = {
        name: parameter.value
        for name, parameter in node.get_parameters_by_prefix("").items()
        if name.split(".")[0] not in ROS_OWN
    }
    settings = Settings.parse(given)
    refuse_two_clocks(settings, use_sim_time=node.get_parameter("use_sim_time").value)
    for name in given:
        node.undeclare_parameter(name)  # it had neither descriptor nor unit
    for name, value in settings.values.items():
        node.declare_parameter(name, value, _descriptor(field_of(name)), ignore_override=True)
    return settings


def whole_numbers_as_declared(parameters: list[Parameter]) -> list[Parameter]:
    """Return parameters with whole numbers as floats where floats are declared.

    ``ros2 param set NODE friction 1`` sends an integer, which rclpy would refuse.
    """
    return [_as_declared(parameter) for parameter in parameters]


def refuse_two_clocks(settings: Settings, *, use_sim_time: bool) -> None:
    """Raise `InputError` if the node was to follow the clock that it publishes itself."""
    if use_sim_time and settings.publish_clock:
        raise InputError(
            "cannot be true with publish_clock: the node would wait for its own clock",
            field="use_sim_time",
        )


def _as_declared(parameter: Parameter) -> Parameter:
    try:
        default = field_of(parameter.name).default
    except InputError:
        return parameter  # of every node, or unknown: not for us to judge
    if isinstance(default, float) and parameter.type_ == Parameter.Type.INTEGER:
        return Parameter(parameter.name, value=float(parameter.value))
    if isinstance(default, list) and parameter.type_ == Parameter.Type.INTEGER_ARRAY:
        return Parameter(parameter.name, value=[float(number) for number in parameter.value])
    return parameter


def _descriptor(field: Field) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(description=field.description, read_only=field.read_only)
    if isinstance(field.default, bool):
        return descriptor
    if isinstance(field.default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=field.minimum, to_value=field.maximum)
        ]
    elif isinstance(field.default, int):
        descriptor.integer_range = [
            IntegerRange(from_value=int(field.minimum), to_value=int(field.maximum))
        ]
    if field.exclusive:
        descriptor.additional_constraints = f"greater than {field.minimum:g}"
    elif field.options:
        descriptor.additional_constraints = f"one of {', '.join(field.options)}"
    return descriptor
