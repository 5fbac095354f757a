"""What the tests share."""

from __future__ import annotations

import os
import signal

import pytest

from hma_gripper_sim import Circle, GripperDesign, RoundedBox, Scene, Simulation

pytest_plugins = ["made_up_logs"]

os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"  # read when the message modules are imported
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell's job in the background ignores it, and what it starts would, too.
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the solver before processes of tests begin, each of which would do so itself."""
    config = session.config
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        simulation = Simulation(Scene(GripperDesign.thesis_2013(), Circle(radius=0.015)))
        simulation.step(0.002, 0.004)
        simulation.advance(0.01, 0.004)


@pytest.fixture(scope="session")
def design() -> GripperDesign:
    return GripperDesign.thesis_2013()


@pytest.fixture(scope="session")
def box() -> RoundedBox:
    return RoundedBox(width=0.028, height=0.028, corner_radius=0.002)


@pytest.fixture(scope="session")
def cylinder() -> Circle:
    return Circle(radius=0.015)
