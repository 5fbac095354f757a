"""A two-link arm that carries the gripper: presses on the object with a given force, and lifts.

Start the node (``ros2 run hma_gripper_sim sim_node``), then this program::

    python examples/planar_arm.py
    python examples/planar_arm.py --ros-args -p force:=0.2 -p speed:=0.02

It stands for an arm controller of your own. The arm moves in the plane of the gripper, and a
parallel linkage keeps the tool upright, so the tool's velocity is all that the gripper notices of
the arm. Where a real arm carries a real gripper, here the tool's velocity goes to the simulated
one, and the force comes back.
"""

from __future__ import annotations

import sys
from enum import Enum

import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.clock import Clock
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

GRIPPER = "/hma_gripper_sim"
LINKS = np.array([0.30, 0.25])  # m
PERIOD = 0.01  # s
START = np.radians([70.0, -110.0])  # shoulder from the horizontal, elbow
PATIENCE = 5.0  # s, until it says that it waits
COMPLIANCE = 0.02  # m/s per N that the force is off; more hunts, as friction turns with the motion
CORRECTION = 5.0  # m/s per m that the gripper is behind the tool
HOLD = 1.0  # s
ARRIVED = 1e-4  # m


class Phase(Enum):
    """What the arm is at."""

    WAIT = "waiting for the gripper"
    APPROACH = "approaching"
    PRESS = "pressing"
    LIFT = "lifting"
    DONE = "done"


class PlanarArm(Node):
    """Controller of the arm, and the arm itself: its joints follow their commanded rates."""

    def __init__(self) -> None:
        super().__init__("planar_arm")
        self.force = float(self.declare_parameter("force", 0.3).value)  # N
        self.speed = float(self.declare_parameter("speed", 0.01).value)  # m/s
        self.phase = Phase.WAIT
        self.joints = START.copy()
        self.top = self.tool()[1]
        self.pressed = 0.0  # s
        self.wrench: float | None = None
        self.slide: float | None = None
        self.command = self.create_publisher(Float64, f"{GRIPPER}/cmd_velocity", 1)
        self.states = self.create_publisher(JointState, "/joint_states", 10)
        self.create_subscription(WrenchStamped, f"{GRIPPER}/actuator_wrench", self.on_wrench, 10)
        self.create_subscription(JointState, "/joint_states", self.on_joint_states, 10)
        self.create_timer(PERIOD, self.tick)
        self.waiting = self.create_timer(PATIENCE, self.complain, clock=Clock())

    def on_wrench(self, message: WrenchStamped) -> None:
        """Take the force with which the gripper pushes towards the object."""
        self.wrench = message.wrench.force.z

    def on_joint_states(self, message: JointState) -> None:
        """Take the gripper's travel; the arm's own joints come on the same topic."""
        if "slide" in message.name:
            self.slide = message.position[message.name.index("slide")]

    def tool(self) -> np.ndarray:
        """Place of the tool, x and z [m]."""
        angles = np.cumsum(self.joints)
        return np.array([LINKS @ np.cos(angles), LINKS @ np.sin(angles)])

    def jacobian(self) -> np.ndarray:
        """How the tool's place changes with the joints."""
        angles = np.cumsum(self.joints)
        columns = [
            [-(LINKS[i:] @ np.sin(angles[i:])), LINKS[i:] @ np.cos(angles[i:])] for i in range(2)
        ]
        return np.array(columns).T

    def complain(self) -> None:
        """Say that there is no gripper; otherwise be quiet from now on."""
        if self.phase is Phase.WAIT:
            self.get_logger().warning(
                f"waiting for {GRIPPER}: is sim_node running, with the same ROS_DOMAIN_ID?"
            )
        else:
            self.waiting.cancel()

    def tick(self) -> None:
        """Control the tool, move the arm, and hand its velocity on to the gripper."""
        if self.wrench is None or self.slide is None or not self.command.get_subscription_count():
            return
        jacobian = self.jacobian()
        rates = np.linalg.solve(jacobian, [0.0, -self.velocity_down()])
        self.joints += PERIOD * rates
        travel, velocity = self.top - self.tool()[1], -(jacobian @ rates)[1]
        # The velocity alone would let tool and gripper drift apart with every late message.
        velocity += CORRECTION * (travel - self.slide)
        self.command.publish(Float64(data=float(velocity)))
        state = JointState(name=["shoulder", "elbow"], position=self.joints.tolist())
        state.velocity = rates.tolist()
        state.header.stamp = self.get_clock().now().to_msg()
        self.states.publish(state)

    def velocity_down(self) -> float:
        """Velocity that the tool is to have, towards the object [m/s]."""
        travel = self.top - self.tool()[1]
        if self.phase is Phase.WAIT:
            self.enter(Phase.APPROACH)
        elif self.phase is Phase.APPROACH and self.wrench >= self.force:
            self.enter(Phase.PRESS)
        elif self.phase is Phase.PRESS:
            self.pressed += PERIOD
            if self.pressed >= HOLD:
                self.enter(Phase.LIFT)
        elif self.phase is Phase.LIFT and max(travel, self.slide) < ARRIVED:
            self.enter(Phase.DONE)
        if self.phase is Phase.APPROACH:
            return self.speed
        if self.phase is Phase.PRESS:
            return COMPLIANCE * (self.force - self.wrench)
        if self.phase is Phase.LIFT:
            return -min(2.0 * self.speed, CORRECTION * travel)
        return 0.0

    def enter(self, phase: Phase) -> None:
        """Go on to another phase, and say so."""
        self.phase = phase
        self.get_logger().info(
            f"{phase.value}: travel {1e3 * self.slide:.2f} mm, force {self.wrench:.3f} N"
        )


def main() -> int:
    """Run until the gripper is back at the top; 1 if that did not happen."""
    rclpy.init()
    arm = PlanarArm()
    try:
        while arm.phase is not Phase.DONE:
            rclpy.spin_once(arm)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    finally:
        arm.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
