"""The example: an arm in a process of its own, whose tool velocity drives the gripper."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from patience import patience

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

EXAMPLE = Path(__file__).parents[2] / "examples" / "planar_arm.py"
FORCE = 0.3  # N, its default
SPEED = 0.02  # m/s
PATIENCE = patience(30.0)  # s


@pytest.fixture
def arm(domain, tmp_path):
    """Start the arm; whatever happens it ends with the test."""
    log = (tmp_path / "arm.log").open("w")
    command = [sys.executable, str(EXAMPLE), "--ros-args", "-p", f"speed:={SPEED}"]
    started = []

    def start():
        started.append(subprocess.Popen(command, stderr=log, env=os.environ.copy()))
        return started[0]

    yield start
    for process in started:
        process.kill()
        process.wait()
    log.close()


def test_without_a_gripper_it_says_that_it_waits(arm, tmp_path):
    process, end = arm(), time.monotonic() + PATIENCE
    while "waiting for /hma_gripper_sim: is sim_node running" not in read(tmp_path):
        assert process.poll() is None
        assert time.monotonic() < end, "it has not said anything"
        time.sleep(0.05)


def read(folder):
    return (folder / "arm.log").read_text()


def test_an_arm_presses_with_a_force_and_lifts(start_node, connect, arm):
    client = connect(start_node())

    def travels():
        return [m.position[0] for m in client.joints if "slide" in m.name]

    for _ in range(3):  # an arm may be done before the client has found it
        process = arm()
        client.wait(lambda process=process: process.poll() is not None, patience=patience(30.0))
        assert process.returncode == 0
        client.wait(lambda: max(travels()) > 0.004 and abs(travels()[-1]) < 2e-4)  # on its way
        shoulder = [m for m in client.joints if "shoulder" in m.name]
        if shoulder:
            break
    force = np.array([m.wrench.force.z for m in client.wrenches])
    travel = np.array(travels())
    assert shoulder  # on the same topic
    assert force.max() >= FORCE
    assert travel.max() > 0.004  # the box's clearance
    assert abs(travel[-1]) < 2e-4  # back at the top, where the arm is
    assert force[-1] < 0.0  # and hanging free
    # It keeps the force from when it has settled until it lifts.
    lifts = np.flatnonzero(travel > 0.9 * travel.max())[-1]
    assert np.median(force[lifts - 50 : lifts - 20]) == pytest.approx(FORCE, rel=0.1)
