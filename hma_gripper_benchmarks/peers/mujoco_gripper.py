"""The gripper in MuJoCo: a tree of hinges on a driven slide, contacts through pairs.

What it takes to reach the same equations:

* The slide carries an armature of 1e8 kg and a velocity instead of an actuator.  The
  actuator force is what that armature's acceleration shows.  The solver's termination
  threshold is relative to the mean inertia, hence a tolerance of 1e-14.
* A contact row of impedance d behaves as a spring-damper (negative ``solref``) on a mass
  m_c = d / ((1 - d) A), where A is MuJoCo's approximate inverse inertia of the row.
  A small m_c adds next to no inertia; ``solref`` is scaled so that k m_c and b m_c are the
  stiffness and the damping wanted.  The integrator ``discrete`` takes A of its own metric,
  so it is measured at a first touch.
* Friction below the cone is viscous with slope ``impratio`` m_c b_t.  The slip also lifts
  the normal force by m_c b_t times the slip, which bounds b_t; a too small b_t sticks late.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from hma_gripper_benchmarks.measuring import Candidate
from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD, Task
from hma_gripper_benchmarks.series import Series, from_joints
from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.simulation.simulation import Simulation

Array = NDArray[np.float64]

ARMATURE = 1e8  # kg
CONTACT_MASS = 1e-5  # kg
TYPICAL_FORCE = 0.2  # N; normal force at which friction has the slope asked for, unless said
SPHERE = 1e-6  # m; radius of a sampled point
DEPTH = 0.02  # m; of the object out of the plane
CORNER_GAP = 1e-4  # m
UNSTABLE = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
]
# What it would write into a file of the present directory is found in its data.
mujoco.set_mju_user_warning(lambda text: None)


@dataclass(frozen=True)
class Setting:
    """How MuJoCo steps.

    Parameters
    ----------
    integrator
        MuJoCo's name.
    step
        [s]
    tangential_rate
        b_t above [1/s].
    """

    integrator: str
    step: float
    tangential_rate: float

    @property
    def text(self) -> str:
        """For people."""
        return f"{self.integrator} + PGS, {1e3 * self.step:g} ms"


ROBUST = Setting("discrete", 1e-3, 200.0)
ACCURATE = Setting("implicitfast", 2e-4, 1000.0)
QUICK_SETTINGS: tuple[Setting, ...] = (ROBUST, ACCURATE)
SETTINGS: tuple[Setting, ...] = (Setting("discrete", 2e-3, 80.0), *QUICK_SETTINGS)
# For set-valued friction the stick has to be stiffer; `discrete` does it by itself.
STICKING_RATE = 3000.0  # 1/s
STICKING_SLIP = 1e-6  # m/s


def candidates(task: Task, full: bool) -> list[Candidate]:
    """Both halves, at several steps; none for forces along the tip's normals."""
    scene = task.scene
    if scene.contact == "sampled" and scene.sampled_normal == "tip":
        return []
    settings = SETTINGS
    if not full:
        settings = QUICK_SETTINGS if task.key == "cylinder_sampled" else QUICK_SETTINGS[:1]
    return [candidate(task, setting) for setting in settings]


def candidate(task: Task, setting: Setting, typical_force: float = TYPICAL_FORCE) -> Candidate:
    """One setting; friction has its slope at a typical normal force [N]."""
    if task.scene.slip_velocity == 0.0 and setting.integrator == "implicitfast":
        setting = replace(setting, tangential_rate=max(setting.tangential_rate, STICKING_RATE))
    model = build(task.scene, setting, typical_force)
    rest = _rest(task.scene)
    n = rest.size // 2

    def series(raw: tuple[Array, Array, Array, Array]) -> Series:
        time, force, q, v = raw
        return from_joints(task.scene, time, force, q[:, 1 : n + 1], v[:, 1 : n + 1])

    return Candidate("MuJoCo", setting.text, lambda: _run(model, task, setting, rest), series)


def _run(
    model: Any, task: Task, setting: Setting, rest: Array
) -> tuple[Array, Array, Array, Array]:
    data = mujoco.MjData(model)
    data.qpos[1:] = rest
    steps = max(1, round(SAMPLE_PERIOD / setting.step))
    rows = round(task.duration / SAMPLE_PERIOD) + 1
    time, force = np.zeros(rows), np.zeros(rows)
    q, v = np.empty((rows, model.nq)), np.empty((rows, model.nv))
    # The acceleration of a step belongs to its end only where it is the step map.
    delay = 0.0 if setting.integrator == "discrete" else setting.step
    row = 0
    for duration, velocity in task.parts:
        data.qvel[0] = velocity
        for _ in range(round(duration / SAMPLE_PERIOD)):
            if row == 0:
                mujoco.mj_forward(model, data)
                force[0], q[0], v[0] = -ARMATURE * data.qacc[0], data.qpos, data.qvel
            row += 1
            mujoco.mj_step(model, data, nstep=steps)
            if data.warning.number[UNSTABLE].any():  # it has started anew
                raise RuntimeError(f"became unstable at t = {row * SAMPLE_PERIOD:g} s")
            time[row] = data.time - delay
            force[row] = -ARMATURE * data.qacc[0]
            q[row] = data.qpos
            v[row] = data.qvel
    return time, force, q, v


def build(scene: Scene, setting: Setting, typical_force: float = TYPICAL_FORCE) -> Any:
    """Compile the model of a scene; friction has its slope at a typical normal force [N]."""
    model = mujoco.MjModel.from_xml_string(_mjcf(scene, setting))
    bodies = model.geom_bodyid[model.pair_geom2]
    inverse = model.body_invweight0[bodies, 0]
    _set_contacts(model, scene, setting, typical_force, inverse)
    if setting.integrator == "discrete":
        measured = _measured_inverse(model, scene, setting)
        _set_contacts(model, scene, setting, typical_force, np.full(len(bodies), measured))
    return model


def _set_contacts(
    model: Any, scene: Scene, setting: Setting, typical_force: float, inverse: Array
) -> None:
    impedance = CONTACT_MASS * inverse / (1.0 + CONTACT_MASS * inverse)
    for pair, d in enumerate(impedance):
        model.pair_solimp[pair] = (d, d, 1.0, 0.5, 1.0)
        # MuJoCo divides by the impedance again.
        model.pair_solref[pair] = (
            -scene.normal_stiffness / CONTACT_MASS * d,
            -scene.normal_damping / CONTACT_MASS * d,
        )
        model.pair_solreffriction[pair] = (0.0, -setting.tangential_rate * d)
    slip_velocity = scene.slip_velocity or STICKING_SLIP
    slope = max(scene.friction, 1e-3) * typical_force / slip_velocity
    model.opt.impratio = max(1.0, slope / (CONTACT_MASS * setting.tangential_rate))


def _measured_inverse(model: Any, scene: Scene, setting: Setting) -> float:
    """MuJoCo's approximate inverse inertia of a normal row, some time after the first touch."""
    data = mujoco.MjData(model)
    data.qpos[1:] = _rest(scene)
    data.qvel[0] = 0.004
    start = (scene.clearance + 0.001) / 0.004
    while data.time < start or data.nefc == 0:
        mujoco.mj_step(model, data)
        if data.time > 2.0 * start:
            return float(model.body_invweight0[-1, 0])
    stiffness, damping, impedance, _ = data.efc_KBIP[0]
    h = setting.step
    row = data.efc_R[0] * (1.0 + h * damping + h * h * stiffness * impedance)
    return float(row * impedance / (1.0 - impedance))


def _rest(scene: Scene) -> Array:
    """Joint angles in static equilibrium, right half then left half, each in its own frame."""
    state = Simulation(scene).state()
    names = scene.joint_names
    angles = dict(zip(names, state.joint_position, strict=True))
    rows = []
    for side, sign in (("right", 1.0), ("left", -1.0)):
        for part, number in scene.half.joints:
            name = f"tip_{side}" if part == "tip" else f"{part}_{side}_{number}"
            rows.append(sign * angles[name])
    return np.array(rows)


def _mjcf(scene: Scene, setting: Setting) -> str:
    objects = _object(scene)
    tips: list[str] = []
    halves = "".join(_half(scene, side, tips) for side in (1.0, -1.0))
    friction = f"{scene.friction:.17g} {scene.friction:.17g} 1e-4 1e-4 1e-4"
    pairs = "".join(
        f'<pair geom1="object{i}" geom2="{tip}" condim="3" friction="{friction}"/>'
        for tip in tips
        for i in range(len(objects))
    )
    return f"""
<mujoco>
  <compiler angle="radian" autolimits="false" inertiafromgeom="false"
            boundmass="0" boundinertia="0"/>
  <option timestep="{setting.step}" integrator="{setting.integrator}" solver="PGS"
          cone="elliptic" tolerance="1e-14" gravity="0 0 {-scene.gravity:.17g}">
    <flag refsafe="disable" island="disable"/>
  </option>
  <worldbody>
    {"".join(objects)}
    <body>
      <joint type="slide" axis="0 0 -1" armature="{ARMATURE:g}"/>
      <inertial pos="0 0 0" mass="{scene.half.middle_mass:.17g}" diaginertia="1e-9 1e-9 1e-9"/>
      {halves}
    </body>
  </worldbody>
  <contact>{pairs}</contact>
</mujoco>"""


def _half(scene: Scene, side: float, tips: list[str]) -> str:
    fingertip = scene.models[0].fingertip
    opening = _bodies(scene.half.chain, side)
    common = 'mass="0" contype="0" conaffinity="0"'
    if fingertip.capsule:
        (ax, az), (bx, bz) = fingertip.points
        tips.append(f"tip{side:g}")
        opening += (
            f'<geom name="{tips[-1]}" type="capsule" size="{fingertip.radius:.17g}" {common} '
            f'fromto="{side * ax:.17g} 0 {az:.17g} {side * bx:.17g} 0 {bz:.17g}"/>'
        )
    else:
        for k, (px, pz) in enumerate(fingertip.points):
            tips.append(f"tip{side:g}point{k}")
            opening += (
                f'<geom name="{tips[-1]}" type="sphere" size="{SPHERE:g}" {common} '
                f'pos="{side * px:.17g} 0 {pz:.17g}"/>'
            )
    return opening + len(scene.half.joints) * "</body>"


def _bodies(chain: Chain, side: float) -> str:
    """Opening tags of the nested bodies of a chain; `side` is -1 for a mirror image."""
    opening = ""
    x, z = chain.root
    for i in range(len(chain.rest)):
        half_turn = -0.5 * side * chain.rest[i]
        cx, cz = chain.centre[i]
        inertia = f"{chain.inertia[i]:.17g}"
        opening += f"""
<body pos="{side * x:.17g} 0 {z:.17g}" quat="{np.cos(half_turn):.17g} 0 {np.sin(half_turn):.17g} 0">
  <joint type="hinge" axis="0 {-side:g} 0" stiffness="{chain.stiffness[i]:.17g}"
         damping="{chain.damping[i]:.17g}" armature="0"/>
  <inertial pos="{side * cx:.17g} 0 {cz:.17g}" mass="{chain.mass[i]:.17g}"
            diaginertia="{inertia} {inertia} {inertia}"/>"""
        x, z = chain.link[i]
    return opening


def _object(scene: Scene) -> list[str]:
    """Geoms of the object; a box is a ring of four capsules."""
    x, z = scene.object_position
    contour = scene.contour
    margin = 0.0 if scene.contact == "continuous" else SPHERE
    common = 'contype="0" conaffinity="0"'
    if isinstance(contour, Circle):
        return [
            f'<geom name="object0" type="cylinder" pos="{x:.17g} 0 {z:.17g}" {common} '
            f'zaxis="0 1 0" size="{contour.radius - margin:.17g} {DEPTH}"/>'
        ]
    # One capsule per face.  Those of the vertical faces end short of the corners, which
    # would otherwise be hit twice.
    radius = max(contour.core_radius, SPHERE) - margin
    inset = max(0.0, SPHERE - contour.core_radius)
    corners = contour.core * (1.0 - inset / np.abs(contour.core)) + (x, z)
    geoms = []
    for i, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        gap = np.sign(b[1] - a[1]) * CORNER_GAP
        geoms.append(
            f'<geom name="object{i}" type="capsule" size="{radius:.17g}" {common} '
            f'fromto="{a[0]:.17g} 0 {a[1] + gap:.17g} {b[0]:.17g} 0 {b[1] - gap:.17g}"/>'
        )
    return geoms


def cantilever_runs(
    chain: Chain, gravity: float, duration: float
) -> dict[str, Callable[[], float]]:
    """Runs of a clamped chain to rest; each returns the drop of the last link's end [m]."""
    return {
        f"MuJoCo discrete, {1e3 * step:g} ms": _cantilever_run(chain, gravity, duration, step)
        for step in (0.05, 0.01)
    }


def _cantilever_run(
    chain: Chain, gravity: float, duration: float, step: float
) -> Callable[[], float]:
    # Not from MJCF: its parser refuses hundreds of nested bodies.
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.compiler.autolimits = False
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.gravity = (0.0, 0.0, -gravity)
    body, place = spec.worldbody, chain.root
    for i in range(len(chain.rest)):
        body = body.add_body(
            pos=(place[0], 0.0, place[1]),
            ipos=(chain.centre[i, 0], 0.0, chain.centre[i, 1]),
            mass=chain.mass[i],
            inertia=np.full(3, chain.inertia[i]),
            explicitinertial=True,
        )
        joint = body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=(0.0, -1.0, 0.0))
        joint.stiffness[0] = chain.stiffness[i]
        joint.damping[0] = chain.damping[i]
        place = chain.link[i]
    model = spec.compile()

    def run() -> float:
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, nstep=round(duration / step))
        return -float(np.sin(np.cumsum(data.qpos)) @ chain.link[:, 0])

    return run
