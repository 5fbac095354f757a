"""Energy balance of a run: what the actuator and gravity put in, and where it went."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.kernels.base_motion import Motion
from hma_gripper_sim.mechanics.body_motion import body_motion
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.mechanics.states import HalfRecord
from hma_gripper_sim.motion.prescribed_motion import evaluate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EnergyBalance:
    """Energies and works from the start to the end of a run [J].

    ``actuator + gravity = kinetic + elastic + joints + contact + friction`` up to `residual`.

    Parameters
    ----------
    actuator, gravity
        Work done on the gripper; the actuator's includes the impulse of every velocity jump
        after the start.
    kinetic, elastic
        Change of the gripper's kinetic energy and of the energy in its joint springs.
    joints
        Lost in the joint dampers.
    contact
        Given to the contacts along their normals: stored and lost there.
    friction
        Lost in friction.
    turnover
        The largest of these and of the works at any time of the run: where the gripper returns
        to where it began, they end at nothing.
    """

    actuator: float
    gravity: float
    kinetic: float
    elastic: float
    joints: float
    contact: float
    friction: float
    turnover: float

    @property
    def residual(self) -> float:
        """What the balance lacks [J]."""
        received = self.actuator + self.gravity
        return received - self.kinetic - self.elastic - self.joints - self.contact - self.friction

    @property
    def relative_residual(self) -> float:
        """The residual relative to the turnover."""
        return abs(self.residual) / self.turnover if self.turnover > 0.0 else 0.0


def energy_balance(
    scene: Scene, motion: Motion, records: tuple[HalfRecord, HalfRecord]
) -> EnergyBalance:
    """Balance a run of both halves (of which one may be the mirror image of the other)."""
    chain, middle = scene.half.chain, scene.half.middle_mass
    end = min(float(record.time[-1]) for record in records)
    travel, speed, _ = evaluate(motion, np.array([motion.time[0], end]), before=True)
    middle_kinetic = 0.5 * middle * float(speed[1] ** 2 - speed[0] ** 2)
    middle_gravity = middle * scene.gravity * float(travel[1] - travel[0])
    actuator = middle_kinetic - middle_gravity
    gravity, kinetic, elastic = middle_gravity, middle_kinetic, 0.0
    joints = contact = friction = peak = 0.0
    for record in records:
        ends = [0, -1]
        q, v = record.q[ends], record.v[ends]
        height, energy = _height_and_motion(scene, q, v, speed)
        weight = chain.mass * scene.gravity
        gravity -= float(weight @ (height[1] - height[0] - (travel[1] - travel[0])))
        kinetic += float(energy[1] - energy[0])
        elastic += 0.5 * float(chain.stiffness @ (q[1] ** 2 - q[0] ** 2))
        works = record.work - record.work[0]
        work = works[-1]
        peak = max(peak, float(np.abs(works).max()))
        actuator += float(work[0])
        joints += float(work[1])
        contact += float(work[2] - work[3])
        friction += float(work[3])
        actuator += _impulsive_work(scene, motion, record, end)
    terms = (actuator, gravity, kinetic, elastic, joints, contact, friction)
    return EnergyBalance(*terms, max(peak, *map(abs, terms)))


def _impulsive_work(scene: Scene, motion: Motion, record: HalfRecord, end: float) -> float:
    """Work of the actuator on one half in the velocity jumps inside a run [J].

    A jump changes every body's velocity by as much as the base's, and joint angles and rates not
    at all: the work is the change of kinetic energy.  A step ends at each jump.
    """
    time = motion.time[1:-1]
    time = time[motion.jump[1:] & (time < end)]
    _, before, _ = evaluate(motion, time, before=True)
    _, after, _ = evaluate(motion, time)
    rows = np.searchsorted(record.time, time)
    q, v = record.q[rows], record.v[rows]
    _, energy_before = _height_and_motion(scene, q, v, before)
    _, energy_after = _height_and_motion(scene, q, v, after)
    return float(np.sum(energy_after - energy_before))


def _height_and_motion(scene: Scene, q: Array, v: Array, speed: Array) -> tuple[Array, Array]:
    """Heights of the bodies over the base [m], (r, n), and their kinetic energy [J], (r,)."""
    chain = scene.half.chain
    motion = body_motion(chain, q, v, np.zeros_like(v))
    rate = motion.centre_velocity - 1j * speed[:, None]
    energy = 0.5 * (np.abs(rate) ** 2 @ chain.mass + motion.spin**2 @ chain.inertia)
    return np.asarray(motion.centre.imag), np.asarray(energy)
