"""GripperClient against the running node: alone, and in a program with a node of its own."""

from __future__ import annotations

import math
import time
from contextlib import suppress
from threading import Event, Thread

import pytest
from patience import patience

pytest.importorskip("rclpy", reason="ROS 2 is not installed")

from typing import Any

import rclpy

from hma_gripper_sim import InputError
from hma_gripper_sim.ros import (
    GripperClient,
    GripperError,
    GripperRefusedError,
    GripperTimeoutError,
)

PATIENCE = patience(20.0)  # s


def test_a_pick(start_node):
    process = start_node(real_time_factor=3.0)
    process.wait_until_ready()
    speeds = []
    with GripperClient() as gripper:
        gripper.select("cylinder")
        gripper.drive(0.01)
        pressed = gripper.wait_for_force(at_least=0.3)
        gripper.hold()
        stopped = gripper.state
        gripper.hold(0.5)
        held = gripper.state
        gripper.move_to(0.0, speed=0.02)
        up = gripper.state
        # A move that is seen all the way keeps its speed.
        gripper.move(0.004, speed=0.0125, wait=False)

        def moved(state: Any) -> bool:
            speeds.append(state.velocity)
            return state.travel > 0.004 - 1e-9

        gripper.wait_for(moved)
    assert pressed.contour == "cylinder"
    assert pressed.force >= 0.3
    assert stopped.velocity == held.velocity == 0.0
    assert held.stamp - stopped.stamp >= 500_000_000
    assert 0.005 < pressed.travel <= held.travel < 0.028  # stopped on the way
    assert held.force > 0.1  # still in touch
    assert math.degrees(held.phi_left) > 100.0
    assert held.phi_left == pytest.approx(held.phi_right, abs=1e-9)
    assert up.velocity == 0.0
    assert up.travel == pytest.approx(0.0, abs=1e-9)
    assert max(speeds) == pytest.approx(0.0125, rel=1e-9)


def test_what_goes_wrong_has_a_name_and_a_reason(start_node):
    process = start_node(real_time_factor=5.0, travel_max=0.006)
    process.wait_until_ready()
    with GripperClient() as gripper:
        with pytest.raises(GripperRefusedError, match=r"unknown contour 'mug' \(known: box, cyl"):
            gripper.select("mug")
        with pytest.raises(GripperError, match="stopped at 6 mm on the way to 50 mm"):
            gripper.move(0.05, speed=0.05)
        with pytest.raises(GripperTimeoutError, match=r"waited 0.2 s for the force in vain"):
            gripper.wait_for_force(at_least=9.0, timeout=0.2)
        for wrong in (
            lambda: gripper.move(math.nan, speed=0.01),
            lambda: gripper.move(-0.001, speed=0.0),
            lambda: gripper.move_to(math.inf, speed=0.01),
            lambda: gripper.hold(-1.0),
            lambda: gripper.wait_for_travel(),
            lambda: gripper.wait_for_force(at_least="heavy"),  # type: ignore[arg-type]
            lambda: GripperClient(name="gripper"),
        ):
            with pytest.raises(InputError):
                wrong()
        assert gripper.state.travel == pytest.approx(0.006, abs=1e-9)  # nothing was sent
        gripper.reset()
        assert gripper.state.travel == 0.0


def test_a_velocity_is_kept_up_until_something_else_is_asked_for(start_node):
    process = start_node(real_time_factor=2.0, command_timeout=0.2)
    process.wait_until_ready()
    with GripperClient() as gripper:
        gripper.drive(0.004)
        gripper.wait_for_travel(at_least=0.003)  # 0.75 s: without renewal it stops at 0.8 mm
        gripper.drive(-0.004)
        gripper.wait_for_travel(at_most=0.002)
        gripper.move_to(0.001, speed=0.004)
        first = gripper.state
        gripper.hold(0.3)
        assert first.velocity == gripper.state.velocity == 0.0
        assert first.travel == gripper.state.travel == pytest.approx(0.001, abs=1e-9)
        with pytest.raises(InputError):
            gripper.drive(math.nan)


def test_without_a_node_it_says_so(domain):
    with (
        GripperClient(patience=0.3) as gripper,
        pytest.raises(GripperTimeoutError, match=r"/hma_gripper_sim gave no state in 0.3 s$"),
    ):
        gripper.move(0.01, speed=0.01)


def test_a_pause_ends_a_wait_and_so_does_what_the_program_checks(start_node, connect):
    client = connect(start_node())
    stop: list[Exception] = []

    def check():
        for error in stop:
            raise error

    with GripperClient(patience=0.3, check=check) as gripper:
        gripper.wait_for_node(PATIENCE)
        assert client.call("pause", True).success
        with pytest.raises(GripperTimeoutError, match="is it paused"):
            gripper.wait_for_travel(at_least=0.01)
        stop.append(OSError("emergency stop"))
        with pytest.raises(OSError, match="emergency stop"):
            gripper.wait_for_travel(at_least=0.01)


def test_an_exception_in_the_block_stops_the_gripper(start_node, connect):
    client = connect(start_node(real_time_factor=2.0))

    def press():
        with GripperClient() as gripper:
            gripper.move(0.03, speed=0.004, wait=False)
            gripper.wait_for_travel(at_least=0.001)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        press()
    client.wait(lambda: client.joints[-1].position[0] >= 0.001)
    client.wait(lambda: client.joints[-1].velocity[0] == 0.0)
    assert client.joints[-1].position[0] < 0.02


@pytest.fixture
def beside(domain):
    """Someone else's node, that publishes from a thread what it is given to publish."""
    context = rclpy.Context()
    context.init()
    node = rclpy.create_node("beside", context=context)
    ended = Event()
    threads = []

    def start(kind, topic, message):
        publisher = node.create_publisher(kind, topic, 10)

        def publish():
            while not ended.wait(0.002):
                publisher.publish(message())

        threads.append(Thread(target=publish))
        threads[-1].start()
        return publisher

    yield start
    ended.set()
    for thread in threads:
        thread.join()
    node.destroy_node()
    context.try_shutdown()


@pytest.mark.parametrize("numbers", [{}, {"velocity": [0.0], "effort": [0.0]}])
def test_others_that_publish_the_joint_are_not_taken_for_the_node(start_node, beside, numbers):
    """A joint_state_publisher stands beside the node, with the gripper at 0 for ever."""
    from sensor_msgs.msg import JointState

    process = start_node()
    process.wait_until_ready()
    publisher = beside(
        JointState,
        "/joint_states",
        lambda: JointState(name=["slide"], position=[0.0], **numbers),
    )
    with GripperClient() as gripper:
        end = time.monotonic() + PATIENCE
        while not publisher.get_subscription_count():
            assert time.monotonic() < end, "they have not found each other"
            time.sleep(0.01)
        gripper.move_to(0.01, speed=0.05)
        seen = []

        def enough(state: Any) -> bool:
            seen.append(state)
            return len(seen) > 50

        gripper.wait_for(enough)
        assert {state.travel for state in seen} == {gripper.state.travel}
        for _ in range(4):
            gripper.move(0.002, speed=0.05)
        gripper.hold(0.1)
        assert gripper.state.travel == pytest.approx(0.018, abs=1e-9)
        assert gripper.state.force != 0.0


def test_of_two_nodes_of_one_name_it_follows_neither(start_node):
    first, second = start_node(), start_node()
    first.wait_until_ready()
    second.wait_until_ready()
    several = "several nodes are called /hma_gripper_sim"
    with GripperClient(patience=1.0) as gripper:

        def noticed():
            try:
                gripper.wait_for_node(PATIENCE)
                gripper.hold(1.0)
            except GripperError as error:
                return several in str(error)
            return False

        end = time.monotonic() + PATIENCE
        while not noticed():
            assert time.monotonic() < end, "the second node has not been noticed"


@pytest.mark.parametrize(
    "wait",
    [
        lambda gripper: gripper.hold(1.5),
        lambda gripper: gripper.wait_for_force(at_least=5.0, timeout=2.0),
        lambda gripper: gripper.move(0.01, speed=0.01),
    ],
)
def test_a_clock_that_is_set_back_ends_a_wait(start_node, beside, wait):
    from rclpy.time import Time
    from rosgraph_msgs.msg import Clock

    process = start_node(use_sim_time=True)
    process.wait_until_ready()
    clock = [100.0]

    def tick():
        clock[0] += 0.005
        return Clock(clock=Time(nanoseconds=round(1e9 * clock[0])).to_msg())

    beside(Clock, "/clock", tick)
    waited_from: list[float] = []

    def set_back():
        if waited_from and clock[0] > waited_from[0] + 0.5:
            clock[0] = waited_from.pop() - 99.0

    with GripperClient(check=set_back) as gripper:
        gripper.wait_for_node(PATIENCE)
        waited_from.append(clock[0])
        with pytest.raises(GripperError, match="time ran back from 1"):
            wait(gripper)
        gripper.hold(0.2)  # and goes on from there


def test_with_a_prefix_it_finds_the_joint_on_its_own(start_node):
    process = start_node(prefix="left_", real_time_factor=2.0)
    process.wait_until_ready()
    with GripperClient() as gripper:
        gripper.move_to(0.003, speed=0.02)
        assert gripper.state.travel == pytest.approx(0.003, abs=1e-9)


@pytest.fixture
def program(domain):
    """A program with a node of its own, and an executor that spins it in a thread."""
    from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor

    context = rclpy.Context()
    context.init()
    node = rclpy.create_node("arm", context=context)
    executor = MultiThreadedExecutor(2, context=context)
    executor.add_node(node)

    def spin():
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = Thread(target=spin)
    thread.start()
    yield node
    context.try_shutdown()
    thread.join()
    executor.shutdown()
    node.destroy_node()


def test_in_a_program_it_works_from_a_callback_beside_the_arms_own_joints(start_node, program):
    from rclpy.callback_groups import ReentrantCallbackGroup
    from sensor_msgs.msg import JointState

    process = start_node(real_time_factor=2.0)
    process.wait_until_ready()
    arm = program.create_publisher(JointState, "/joint_states", 10)
    program.create_timer(
        0.001,
        lambda: arm.publish(JointState(name=["shoulder", "elbow"], position=[1.0, 2.0])),
        callback_group=ReentrantCallbackGroup(),
    )
    reached: list[Any] = []

    def once():
        timer.cancel()
        with GripperClient(program) as gripper:
            gripper.move(0.003, speed=0.01)
            reached.append(gripper.state)

    timer = program.create_timer(0.0, once)
    end = time.monotonic() + PATIENCE
    while not reached:
        process.check()
        assert time.monotonic() < end, "the callback has not come to its end"
        time.sleep(0.01)
    assert reached[0].travel == pytest.approx(0.003, abs=1e-9)
    # What was created on the program's node is gone again.
    assert [client.srv_name for client in program.clients] == []
