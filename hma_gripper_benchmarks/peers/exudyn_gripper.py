"""The gripper in Exudyn: rigid bodies in the plane, joints by multipliers, sparse matrices.

A kinematic tree of its own kind would be dense.  The base rests and the cylinder comes up to
it: at a constant velocity that is the same motion, and the reaction of the first joints is the
load on the base.  Contact points are spheres of no size against one of the cylinder's radius,
which in the plane is the same; it is the only contact of points with Coulomb friction that
Exudyn offers, so other objects are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import exudyn
import numpy as np
from exudyn import itemInterface
from numpy.typing import NDArray

from hma_gripper_benchmarks.measuring import Candidate
from hma_gripper_benchmarks.scenes import SAMPLE_PERIOD, Task
from hma_gripper_benchmarks.series import Series, from_joints
from hma_gripper_sim.kernels.chain import Chain
from hma_gripper_sim.mechanics.scene import Scene
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.simulation.simulation import Simulation

Array = NDArray[np.float64]

OBJECT_MASS = 1e8  # kg, kg m^2; keeps its velocity whatever presses on it
POINT = 1e-9  # m; radius of a sampled point
STEPS, FULL_STEPS = (5e-3,), (5e-3, 2.5e-3, 1e-3)  # s
REST_STEP = 0.05  # s; of a run to rest
OUTPUT = exudyn.OutputVariableType


class _Chain:
    """Bodies and joints of a chain in a system; the plane is x-y, gravity along -y."""

    def __init__(self, system: Any, chain: Chain, side: float, gravity: float, rest: Array) -> None:
        self.nodes: list[Any] = []
        self.bodies: list[Any] = []
        self.joints: list[Any] = []
        self.centres = chain.centre * (side, 1.0)
        links = chain.link * (side, 1.0)
        angles = side * np.cumsum(rest + chain.rest)
        stress_free = side * np.cumsum(chain.rest)
        ground = system.AddObject(itemInterface.ObjectGround())
        place = chain.root * (side, 1.0)
        before = system.AddMarker(
            itemInterface.MarkerBodyRigid(bodyNumber=ground, localPosition=[*place, 0.0])
        )
        for i, angle in enumerate(angles):
            cos, sin = np.cos(angle), np.sin(angle)
            turn = np.array([[cos, -sin], [sin, cos]])
            node = system.AddNode(
                itemInterface.NodeRigidBody2D(
                    referenceCoordinates=[*(place + turn @ self.centres[i]), angle]
                )
            )
            body = system.AddObject(
                itemInterface.ObjectRigidBody2D(
                    mass=chain.mass[i], inertia=chain.inertia[i], nodeNumber=node
                )
            )
            weight = system.AddMarker(itemInterface.MarkerBodyMass(bodyNumber=body))
            system.AddLoad(
                itemInterface.LoadMassProportional(
                    markerNumber=weight, loadVector=[0.0, -gravity, 0.0]
                )
            )
            here = self.mark(system, body, -self.centres[i])
            self.joints.append(
                system.AddObject(itemInterface.ObjectJointRevolute2D(markerNumbers=[before, here]))
            )
            self._add_spring(system, chain, i, node, stress_free, angles)
            before = self.mark(system, body, links[i] - self.centres[i])
            self.nodes.append(node)
            self.bodies.append(body)
            place = place + turn @ links[i]

    @staticmethod
    def mark(system: Any, body: Any, position: Array) -> Any:
        """Marker at a position relative to the body's centre of gravity."""
        return system.AddMarker(
            itemInterface.MarkerBodyRigid(bodyNumber=body, localPosition=[*position, 0.0])
        )

    def _add_spring(
        self, system: Any, chain: Chain, i: int, node: Any, stress_free: Array, angles: Array
    ) -> None:
        """Torsional spring and damper, on the coordinates, which count from their reference."""
        own = system.AddMarker(itemInterface.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))
        if i > 0:
            other = system.AddMarker(
                itemInterface.MarkerNodeCoordinate(nodeNumber=self.nodes[-1], coordinate=2)
            )
            offset = stress_free[i] - stress_free[i - 1] - (angles[i] - angles[i - 1])
        else:
            ground = system.AddNode(itemInterface.NodePointGround())
            other = system.AddMarker(
                itemInterface.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0)
            )
            offset = stress_free[0] - angles[0]
        system.AddObject(
            itemInterface.ObjectConnectorCoordinateSpringDamper(
                markerNumbers=[other, own],
                stiffness=chain.stiffness[i],
                damping=chain.damping[i],
                offset=offset,
            )
        )


def candidates(task: Task, full: bool) -> list[Candidate]:
    """Both halves with the generalised-alpha method; constant velocity on a cylinder only."""
    scene = task.scene
    expressible = (
        isinstance(scene.contour, Circle)
        and scene.contact == "sampled"
        and scene.slip_velocity > 0.0
        and len(task.parts) == 1
    )
    if not expressible:
        return []
    return [_candidate(task, step) for step in (FULL_STEPS if full else STEPS)]


def _candidate(task: Task, step: float) -> Candidate:
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    scene = task.scene
    rest = _rest(scene)
    sensors = _build(system, task, rest)
    settings = _settings(task.duration, step)

    def run() -> list[Array]:
        system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.GeneralizedAlpha)
        return [np.asarray(system.GetSensorStoredData(sensor)) for sensor in sensors]

    def series(raw: list[Array]) -> Series:
        time = raw[0][:, 0]
        load = raw[0][:, 2] + raw[1][:, 2]
        n = len(rest)
        angles = np.column_stack([part[:, 3] for part in raw[2 : 2 + n]]) + np.cumsum(rest)
        rates = np.column_stack([part[:, 3] for part in raw[2 + n :]])
        q = np.diff(angles, axis=1, prepend=0.0)
        v = np.diff(rates, axis=1, prepend=0.0)
        force = load - scene.half.middle_mass * scene.gravity
        return from_joints(scene, time, force, q, v)

    # The container must live as long as its system.
    run.__dict__["container"] = container
    return Candidate("Exudyn", f"generalised-α ρ∞ = 0, {1e3 * step:g} ms", run, series)


def _build(system: Any, task: Task, rest: Array) -> list[Any]:
    """Sensors: reactions of both first joints, then coordinates and rates of the right half."""
    scene = task.scene
    halves = [_Chain(system, scene.half.chain, side, scene.gravity, rest) for side in (1.0, -1.0)]
    _add_contacts(system, task, halves)

    def sensor(item: Any) -> Any:
        return system.AddSensor(item)

    common = {"storeInternal": True, "writeToFile": False}
    sensors = [
        sensor(
            itemInterface.SensorObject(
                objectNumber=half.joints[0], outputVariableType=OUTPUT.Force, **common
            )
        )
        for half in halves
    ]
    for kind in (OUTPUT.Coordinates, OUTPUT.Coordinates_t):
        sensors += [
            sensor(itemInterface.SensorNode(nodeNumber=node, outputVariableType=kind, **common))
            for node in halves[0].nodes
        ]
    system.Assemble()
    return sensors


def _add_contacts(system: Any, task: Task, halves: list[_Chain]) -> None:
    scene = task.scene
    radius = scene.models[0].obstacle.radius
    node = system.AddNode(
        itemInterface.NodeRigidBody2D(
            referenceCoordinates=[*scene.object_position, 0.0],
            initialVelocities=[0.0, task.parts[0][1], 0.0],
        )
    )
    body = system.AddObject(
        itemInterface.ObjectRigidBody2D(mass=OBJECT_MASS, inertia=OBJECT_MASS, nodeNumber=node)
    )
    centre = _Chain.mark(system, body, np.zeros(2))
    for half, side in zip(halves, (1.0, -1.0), strict=True):
        for point in scene.models[0].fingertip.points:
            marker = _Chain.mark(system, half.bodies[-1], point * (side, 1.0) - half.centres[-1])
            data = system.AddNode(
                itemInterface.NodeGenericData(
                    initialCoordinates=[0.1, 0.0, 0.0, 0.0], numberOfDataCoordinates=4
                )
            )
            system.AddObject(
                itemInterface.ObjectContactSphereSphere(
                    markerNumbers=[marker, centre],
                    nodeNumber=data,
                    spheresRadii=[POINT, radius - POINT],
                    dynamicFriction=scene.friction,
                    frictionProportionalZone=scene.slip_velocity,
                    contactStiffness=scene.normal_stiffness,
                    contactDamping=scene.normal_damping,
                    impactModel=0,
                )
            )


def _settings(duration: float, step: float) -> Any:
    settings: Any = exudyn.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime = duration
    integration.numberOfSteps = round(duration / step)
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = 0.0
    integration.newton.useModifiedNewton = True
    settings.staticSolver.verboseMode = 0
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    solution = settings.solution
    solution.file.write = False
    solution.sensors.writePeriod = SAMPLE_PERIOD
    return settings


def _rest(scene: Scene) -> Array:
    """Joint angles of the right half in static equilibrium."""
    position = dict(zip(scene.joint_names, Simulation(scene).state().joint_position, strict=True))
    return np.array(
        [
            position["tip_right" if part == "tip" else f"{part}_right_{number}"]
            for part, number in scene.half.joints
        ]
    )


def cantilever_runs(
    chain: Chain, gravity: float, duration: float
) -> dict[str, Callable[[], float]]:
    """Runs of a clamped chain to rest; each returns the drop of the last link's end [m]."""
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    bodies = _Chain(system, chain, 1.0, gravity, np.zeros(len(chain.rest)))
    last = bodies.bodies[-1]
    end = [*(chain.link[-1] - chain.centre[-1]), 0.0]
    system.Assemble()
    settings = _settings(duration, REST_STEP)

    def drop() -> float:
        current = exudyn.ConfigurationType.Current
        place = system.GetObjectOutputBody(last, OUTPUT.Position, end, current)
        return -float(place[1])

    def dynamic() -> float:
        system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.GeneralizedAlpha)
        return drop()

    def static() -> float:
        system.SolveStatic(settings)
        return drop()

    dynamic.__dict__["container"] = static.__dict__["container"] = container
    return {f"Exudyn, {1e3 * REST_STEP:g} ms": dynamic, "Exudyn static": static}
