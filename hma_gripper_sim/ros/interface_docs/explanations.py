"""What the page says beyond what can be read from the node."""

from __future__ import annotations

from hma_gripper_sim.device.topics import TOPICS

INTRODUCTION = """
# The ROS 2 interface of sim_node

`make docs` writes this page from the node's own declarations; the tests compare it with a running
node.

`~` is the node's name, `/hma_gripper_sim`, in its namespace; a name without `~` or `/` is relative
to the namespace. SI units: m, rad, s, N, N m. Travel, velocity and force are positive towards the
object, angles counter-clockwise in the drawing plane (x to the right, z up).
"""

MEANINGS = {
    **{topic.relative: topic.meaning for topic in TOPICS},
    "~/select_contour/NAME": "Put that object in place; refused, with the reason, while it would "
    "overlap the gripper.",
    "~/reset": "Back to the start pose, at rest and without a command; ends a solver failure.",
    "~/pause": "`true` stops time, `false` lets it go on.",
    "~/step": "While paused: make `step_ticks` ticks, publish each, and answer with the last "
    "stamp and the travel. For lockstep with a controller.",
}
"""By name, in the order of the page."""

EVERY_NODES = (
    "/rosout",
    "/parameter_events",
    "~/describe_parameters",
    "~/get_parameter_types",
    "~/get_parameters",
    "~/list_parameters",
    "~/set_parameters",
    "~/set_parameters_atomically",
    "~/get_type_description",
)
"""What ROS gives every node, and needs no explanation."""

COMMANDS = """
All sources pass the same checks, ramp, limits and timeout; the one that sent last is in charge,
and /diagnostics names it. Of waiting messages on a topic the newest counts. Best-effort publishers
are heard too: a best-effort subscription joins the reliable one as soon as there is any. Senders
that command in turn are named in the log and in /diagnostics.

- A command that is not finite, has the wrong size or lacks `slide` is dropped, counted and warned
  about once a second; it changes nothing.
- A velocity holds for `command_timeout`; then the drive ramps to rest. A trajectory ends by itself,
  at rest unless `allow_nonzero_velocity_at_trajectory_end`; a position is held.
- Velocities beyond `max_velocity` are clamped; changes follow `max_acceleration`; the drive brakes
  for the ends of its travel.
- Stamps count if they are not 0. A velocity or position is out of date when its stamp is older than
  `command_timeout`, earlier than one already taken from that source, or over 0.5 s ahead. A
  trajectory starts at its stamp, with 0 at once. It is out of date when it would have ended by now,
  or would start more than 60 s from now: then its sender has another clock.
- With `prefix`, `slide` stands for the name with the prefix.
"""

STATES = """
All messages of a tick carry one stamp. Publishers are reliable, so reliable and best-effort
subscriptions both get their messages. While paused, the last state is repeated with its stamp.
"""

SELECT_CONTOUR = """
There is one `select_contour` service per object of the catalogue, and one for `outline`. Setting
the parameter `contour` is the same.
"""

PARAMETERS = """
`ros2 param describe` shows the same. "At start" parameters are read-only; the others take effect
between two ticks. What cannot be used is refused with the reason: at start by one line and exit
code 2, at run time in the answer, and then nothing changes. In YAML, numbers may carry units
(`28 mm`). [config/sim_node.yaml](../config/sim_node.yaml) holds the defaults, with comments.
"""

OBJECTS = """
Any number of objects, added at start only. `type` and the dimensions of that type are required;
`corner_radius`, `rounding` and `offset` are 0 and `clearance` is 0.005 m unless given. Dimensions
and places can be set at any time. Without any `contours.*` there are the three of
[config/sim_node.yaml](../config/sim_node.yaml); giving any replaces all of them.
"""

DIAGNOSTICS = """
## Diagnostics

Levels as in REP-107. Counts are totals; the other figures are of the time since the last report.
Reports come once a second of this machine, also while a simulated clock stands. Names begin with
the node's full name, such as `left/hma_gripper_sim`, which is the hardware id, too.

| status | not OK when | values |
| --- | --- | --- |
| `hma_gripper_sim: drive` | Stale: no command within `command_timeout`. Warn: held back by a \
travel limit; command beyond `max_velocity`; commands refused | `in charge`, `trajectory`, \
`contour`, `paused`, `stale`, `clamped`, `at travel limit`, `commands clamped`, \
`commands expired`; of each source `SOURCE: accepted`, `SOURCE: rejected`, \
`SOURCE: out of date` |
| `hma_gripper_sim: timing` | Warn: a lag of over 0.1 s (10 s on a simulated clock) was given up \
(overrun); slower than 95 % of `real_time_factor` on the node's clock; with `use_sim_time`, no \
`/clock`, or one that has stood for 3 s | `real-time factor`, `overruns`, `ticks per second`, \
`mean duration of a tick [ms]`, `longest duration of a tick [ms]` |
| `hma_gripper_sim: solver` | Error: no solution; the last good state stands until `~/reset` | \
`ticks`, `steps since reset`, `rejected steps since reset`, `Newton iterations since reset` |
| `hma_gripper_sim: stress` | Warn: beyond the material's linear range | `largest stress [Pa]`, \
`linear limit [Pa]` |
| `hma_gripper_sim: validity` | Warn: at this moment a part touches that the contact model leaves \
out, or a tip sinks in by more than a tenth of its radius; the object can pass between sampled \
points | `unmodelled contact`, `penetration`, `sampled contour`, \
`discretisation` |
| `hma_gripper_sim: graph` | Warn: another node has this name; someone else publishes `slide` on \
`joint_states`; several publish `/clock`; several senders command in turn | `in the way` |
"""

ROBOT_DESCRIPTION = """
## Frames and robot description

The node publishes no TF. `hma_gripper urdf` prints a URDF whose joints are those of
`joint_states`; `robot_state_publisher` makes TF of both.

```sh
ros2 run hma_gripper_sim hma_gripper urdf --params-file sim_node.yaml --output gripper.urdf
ros2 launch hma_gripper_sim sim.launch.py rviz:=true                  # hangs in the frame world
ros2 launch hma_gripper_sim sim.launch.py description:=true parent:=tool0   # on an arm's flange
```

| frame | where |
| --- | --- |
| `gripper_mount` | Middle of the top beam at travel 0; x to the right, z towards the object, as a \
tool's. Actuator wrench and markers are in it; an arm's flange carries it. |
| `<joint>_link` | At that joint, turning with it: on the unbent top beam parallel to \
`gripper_mount`, on a side beam turned by its slant. y points out of the plane, so joint angles go \
in as they are. |

- On an arm: `--arm arm.urdf --parent tool0` gives one description of both. `--parent tool0` alone
  makes that link the root, so that the frames join those of an arm with a `robot_state_publisher`
  of its own. To include it by xacro leave both away and attach `gripper_mount`, as
  [config/ros2_control/](../config/ros2_control) does.
- Tell the command what was told to the node: `--params-file`, and `--set KEY=VALUE` for each
  parameter beside it.
- Limits of the revolute joints are where the material's linear range ends. They are no stops.
- Two grippers, or an arm with a joint `slide` of its own: give each node, and its URDF, a `prefix`,
  and each node a namespace. `sim.launch.py prefix:=left_ namespace:=left` does both.
- What is seen of a link is its collision shape too. A planner's SRDF should allow contact between
  neighbouring links.
- [config/gripper.rviz](../config/gripper.rviz) shows gripper, object and forces,
  [config/foxglove_layout.json](../config/foxglove_layout.json) also F, φ, travel and diagnostics.

## ros2_control

[config/ros2_control/](../config/ros2_control) makes the joint `slide` a hardware of ros2_control by
`joint_state_topic_hardware_interface`, with JointGroupVelocityController and
JointTrajectoryController; [behind_your_arm.md](behind_your_arm.md#ros2_control) shows how.

- `trigger_joint_command_threshold` must be -1: by default the hardware holds back commands that the
  state already meets, so an axis that tracks perfectly would get none and be stopped by
  `command_timeout`.
- `slide` needs all three state interfaces, since `joint_states` fills all three, and an initial
  command of 0, since NaN is refused.
"""

SECURITY = """
## Security

[config/sros2/policy.xml](../config/sros2/policy.xml) grants the node its topics and services, those
of its parameters among them, and nothing else.

```sh
ros2 security create_keystore keystore
ros2 security create_enclave keystore /hma_gripper_sim
ros2 security create_permission keystore /hma_gripper_sim \\
  $(ros2 pkg prefix --share hma_gripper_sim)/config/sros2/policy.xml
export ROS_SECURITY_KEYSTORE=$PWD/keystore ROS_SECURITY_ENABLE=true ROS_SECURITY_STRATEGY=Enforce
ros2 run hma_gripper_sim sim_node --ros-args --enclave /hma_gripper_sim
```

The policy knows the objects of the shipped parameter file. For others add a service
`~/select_contour/NAME` each; in a namespace, change `ns`. Who commands the node needs a policy of
its own that allows publishing to the command topics. To find out whether others publish its joints
the node would listen to `joint_states`, which the policy does not grant either.

## What was checked, and what was not

Tests compare this page, the policy and every name in `config/` with the running node, expand the
xacro files, and check that every link of the URDF is where the simulation has it. By hand:
urdfdom's `check_urdf` reads the URDF; ros2 launch of Jazzy ran the launch file, with stand-ins for
robot_state_publisher and RViz (its test runs where launch_ros is installed);
`ros2 security create_permission` accepts the policy; the controllers' parameters are those of
ros2_controllers' Jazzy branch, and a stand-in with these gains followed a trajectory to 0.02 mm.
There are no wheels of robot_state_publisher, RViz, Foxglove and ros2_control, and those of Fast DDS
have no DDS Security: with these the files have not been run.
"""
