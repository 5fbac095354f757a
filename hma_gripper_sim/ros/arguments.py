"""ROS arguments on the command line: reading them, and saying in one line what is wrong."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

import rclpy
from rclpy.logging import LoggingSeverity, get_logger_level, set_logger_level
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from hma_gripper_sim.errors import InputError

_PARSE_ERROR = re.compile(
    r"'(?P<source>[^']*)'\. Error: (?P<reason>.*?)(, at \S+:\d+)*$", re.DOTALL
)


def initialise_ros(arguments: Sequence[str]) -> None:
    """Initialise ROS without its signal handlers.

    Raises
    ------
    InputError
        An argument or a parameter file cannot be read; rcl's own message, reduced to the file
        and the reason.
    """
    set_logger_level("rcl", LoggingSeverity.FATAL)  # it would print a line of its own
    try:
        refuse_stray(remove_ros_args(list(arguments))[1:])
        rclpy.init(args=list(arguments), signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        text = " ".join(str(error).split())
        match = _PARSE_ERROR.search(text)
        if match is None:
            raise InputError(text, source="ROS arguments") from None
        source = match["source"].removeprefix("--params-file ")
        raise InputError(match["reason"], source=source) from None
    if get_logger_level("rcl") == LoggingSeverity.FATAL:
        set_logger_level("rcl", LoggingSeverity.UNSET)


def refuse_stray(arguments: Sequence[str]) -> None:
    """Raise `InputError` about an argument that ROS does not read, and the node neither."""
    if arguments:
        parameter = ":=" in arguments[0] or arguments[0] in ("-p", "-r", "--params-file")
        hint = "it belongs behind --ros-args" if parameter else "sim_node --help lists all"
        raise InputError(f"unknown argument ({hint})", source=arguments[0])


def origin(parameter: str | None, arguments: Sequence[str]) -> str:
    """Return where a parameter came from, as far as the command line tells."""
    if parameter and any(text.startswith(f"{parameter}:=") for text in arguments):
        return "command line"
    files = [value for option, value in pairwise(arguments) if option == "--params-file"]
    return ", ".join(files) or "parameter"
