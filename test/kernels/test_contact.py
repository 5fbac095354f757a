"""Contact kernels against independent geometry, finite differences and the law by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial import ConvexHull

from hma_gripper_sim import Circle, Contour, GripperDesign, Polygon, RoundedBox
from hma_gripper_sim.kernels.chain import TipResponse, tip_response
from hma_gripper_sim.kernels.contact import _evaluate, solve_contact
from hma_gripper_sim.kernels.contact_law import (
    CLOSED,
    GRAZING,
    SLIP_LEFT,
    SLIP_RIGHT,
    STICK,
    ContactLaw,
)
from hma_gripper_sim.kernels.contact_wrench import ContactWorkspace, contact_workspace
from hma_gripper_sim.kernels.proximity import Obstacle, point_distance, segment_distance
from hma_gripper_sim.kernels.touch import Fingertip
from hma_gripper_sim.model.contours.base import face_normals

DESIGN = GripperDesign.thesis_2013()


def obstacle(contour: Contour) -> Obstacle:
    """A contour in its own frame as the kernels want it."""
    core = np.ascontiguousarray(contour.core)
    return Obstacle(core, face_normals(core), core.mean(axis=0), contour.core_radius)


def capsule() -> Fingertip:
    """The thesis' tip as a capsule."""
    points = np.array([DESIGN.tip.capsule_start, DESIGN.tip.capsule_end])
    return Fingertip(points, np.zeros((2, 2)), DESIGN.tip.radius, True, False)


def samples(along_tip_normal: bool) -> Fingertip:
    """The thesis' tip as sampled points."""
    angles = np.array(DESIGN.tip.normal_angles)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    return Fingertip(np.array(DESIGN.tip.points), normals, 0.0, False, along_tip_normal)


def random_polygon(rng: np.random.Generator) -> np.ndarray:
    """Counter-clockwise corners of a convex polygon of some centimetres, shape (m, 2)."""
    cloud = rng.normal(size=(rng.integers(3, 12), 2)) * rng.uniform(0.002, 0.02, size=2)
    return cloud[ConvexHull(cloud).vertices] + rng.normal(size=2) * 0.01


def as_obstacle(corners: np.ndarray) -> Obstacle:
    corners = np.ascontiguousarray(corners)
    return Obstacle(corners, face_normals(corners), corners.mean(axis=0), 0.0)


def distance_to_edges(corners: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point to the outline of a polygon, by projection on every edge [m]."""
    edges = np.roll(corners, -1, axis=0) - corners
    share = np.einsum("ij,ij->i", point - corners, edges) / np.einsum("ij,ij->i", edges, edges)
    feet = corners + np.clip(share, 0.0, 1.0)[:, None] * edges
    return float(np.linalg.norm(point - feet, axis=1).min())


def is_inside(corners: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point lies to the left of every edge of a counter-clockwise polygon."""
    edges = np.roll(corners, -1, axis=0) - corners
    rays = point - corners
    return bool(np.all(edges[:, 0] * rays[:, 1] - edges[:, 1] * rays[:, 0] >= 0.0))


@pytest.mark.parametrize("seed", range(20))
def test_point_distance(seed: int) -> None:
    """Signed distance to random polygons against projection on every edge, inside and outside.

    For a convex polygon the depth inside is the distance to the nearest edge.  The direction
    is the gradient of the distance, and the curvature the derivative of the direction along
    itself turned (1/distance at a corner, 0 at a face).
    """
    rng = np.random.default_rng(seed)
    corners = random_polygon(rng)
    target = as_obstacle(corners)
    for _ in range(50):
        point = corners.mean(axis=0) + rng.normal(size=2) * 0.02
        distance, nx, nz, curvature = point_distance(target, *point)
        sign = -1.0 if is_inside(corners, point) else 1.0
        assert distance == pytest.approx(sign * distance_to_edges(corners, point), abs=1e-15)
        assert math.hypot(nx, nz) == pytest.approx(1.0, abs=1e-12)
        step = 1e-7
        ahead = point_distance(target, *(point + step * np.array([nx, nz])))[0]
        assert ahead - distance == pytest.approx(step, abs=1e-12)
        aside = point_distance(target, *(point + step * np.array([-nz, nx])))
        turned = math.atan2(nx * aside[2] - nz * aside[1], nx * aside[1] + nz * aside[2])
        if distance > 1e-4 and aside[3] * curvature > 0.0:
            assert turned / step == pytest.approx(curvature, rel=1e-2)
        assert curvature in (0.0, pytest.approx(1.0 / distance))


def test_point_distance_to_a_circle_and_on_its_centre() -> None:
    """The core of a circle is a point: distance from the centre, some direction on the centre."""
    target = obstacle(Circle(0.015))
    assert point_distance(target, 0.003, 0.004) == pytest.approx((0.005, 0.6, 0.8, 200.0))
    distance, nx, nz, _ = point_distance(target, 0.0, 0.0)
    assert distance == 0.0
    assert math.hypot(nx, nz) == 1.0


def separation(corners: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Signed distance of a segment and a polygon, from their Minkowski difference [m].

    They are as far apart as the origin is from the hull of all differences of their corners;
    inside that hull, as deep as the nearest of its faces.
    """
    differences = np.vstack([corners - start, corners - end])
    hull = differences[ConvexHull(differences).vertices]
    origin = np.zeros(2)
    sign = -1.0 if is_inside(hull, origin) else 1.0
    return sign * distance_to_edges(hull, origin)


@pytest.mark.parametrize("seed", range(30))
def test_segment_distance(seed: int) -> None:
    """Signed distance of random segments to random polygons against the Minkowski difference.

    Overlaps of the bare cores are only asked for up to a millimetre: the radii of tip and
    object keep the cores apart unless the gripper is pressed right through its object.
    """
    rng = np.random.default_rng(seed)
    corners = random_polygon(rng)
    target = as_obstacle(corners)
    compared = 0
    for _ in range(80):
        start = corners.mean(axis=0) + rng.normal(size=2) * 0.02
        end = start + rng.normal(size=2) * 0.01
        wanted = separation(corners, start, end)
        if wanted < -1e-3:
            continue
        compared += 1
        distance, nx, nz, along, *_ = segment_distance(target, *start, *end)
        assert distance == pytest.approx(wanted, abs=1e-14)
        assert 0.0 <= along <= 1.0
        # The direction parts them: moved by minus the distance, they touch.
        apart = -distance * np.array([nx, nz])
        assert separation(corners, start + apart, end + apart) == pytest.approx(0.0, abs=1e-10)
    assert compared > 20


@pytest.mark.parametrize("seed", range(10))
def test_closest_point_of_a_segment(seed: int) -> None:
    """The point on the segment that `along` names is the closest one, by minimisation.

    The distance to a convex set is convex along a segment: a bounded scalar minimisation
    finds its minimum.  The distance there must be the minimum itself (to 1e-9 m, what
    minimising to 1e-6 of the length leaves at a kink).
    """
    rng = np.random.default_rng(100 + seed)
    corners = random_polygon(rng)
    target = as_obstacle(corners)
    for _ in range(20):
        start = corners.mean(axis=0) + rng.normal(size=2) * 0.03
        end = start + rng.normal(size=2) * 0.01
        if separation(corners, start, end) < 1e-5:
            continue
        distance, nx, nz, along, *_ = segment_distance(target, *start, *end)
        point = start + along * (end - start)
        assert point_distance(target, *point)[0] == pytest.approx(distance, abs=1e-14)
        best = minimize_scalar(
            lambda s, a=start, b=end: point_distance(target, *(a + s * (b - a)))[0],
            bounds=(0.0, 1.0),
            method="bounded",
            options={"xatol": 1e-10},
        )
        assert distance <= best.fun + 1e-9
        # The foot of the normal lies on the object.
        foot = point - distance * np.array([nx, nz])
        assert abs(point_distance(target, *foot)[0]) < 1e-14


@pytest.mark.parametrize("seed", range(10))
def test_reversed_segment_and_mirrored_scene(seed: int) -> None:
    """Swapping the ends of the segment, or mirroring everything, changes nothing else."""
    rng = np.random.default_rng(200 + seed)
    corners = random_polygon(rng)
    target = as_obstacle(corners)
    mirrored = as_obstacle((corners * (-1.0, 1.0))[::-1])
    for _ in range(30):
        start = corners.mean(axis=0) + rng.normal(size=2) * 0.03
        end = start + rng.normal(size=2) * 0.01
        if separation(corners, start, end) < 1e-5:
            continue
        distance, nx, nz, along, curvature, *flat = segment_distance(target, *start, *end)
        back = segment_distance(target, *end, *start)
        assert back == pytest.approx(
            (distance, nx, nz, 1.0 - along, curvature, *flat[2:], *flat[:2]), abs=1e-10
        )
        image = segment_distance(mirrored, *(start * (-1, 1)), *(end * (-1, 1)))
        assert image == pytest.approx((distance, -nx, nz, along, curvature, *flat), abs=1e-10)


PARALLEL = -0.25 * math.pi  # rad; the capsule's side lies level

# Object, tip, position x of the tip's frame [m] and its angle [rad], and what meets there: the
# `end` of the capsule, its `side` at a corner, or a `flat` face at its side.
TANGENT_SCENES = {
    "circle below the side": (Circle(0.015), capsule(), 0.007, -1.2, "side"),
    "circle below the end": (Circle(0.015), capsule(), 0.016, -2.2, "end"),
    "rounded corner below the side": (
        RoundedBox(0.028, 0.028, 0.002),
        capsule(),
        0.014,
        -1.2,
        "side",
    ),
    "flat top below the end": (RoundedBox(0.06, 0.028, 0.002), capsule(), 0.0, -1.2, "end"),
    "sharp corner below the side": (RoundedBox(0.028, 0.028), capsule(), 0.014, -1.2, "side"),
    "corner of a rounded polygon below the side": (
        Polygon([(0.0, -0.012), (0.012, 0.0), (0.004, 0.014), (-0.012, 0.006)], 0.003),
        capsule(),
        0.0,
        -1.0,
        "side",
    ),
    "flat top below the side, in touch in part": (
        RoundedBox(0.06, 0.028, 0.002),
        capsule(),
        0.0,
        PARALLEL + 8e-4,
        "flat",
    ),
    "flat top below the side, in touch all along": (
        RoundedBox(0.06, 0.028, 0.002),
        capsule(),
        0.0,
        PARALLEL - 1e-4,
        "flat",
    ),
    "corner and flat top below the side, in touch in part": (
        RoundedBox(0.02, 0.028, 0.002),
        capsule(),
        0.004,
        PARALLEL - 8e-4,
        "flat",
    ),
    "corner and flat top below the side, in touch all along": (
        RoundedBox(0.02, 0.028, 0.002),
        capsule(),
        0.004,
        PARALLEL - 1e-4,
        "flat",
    ),
    "sampled, circle": (Circle(0.015), samples(False), 0.0, -1.2, "points"),
    "sampled, box, normal of the tip": (
        RoundedBox(0.028, 0.028, 0.002),
        samples(True),
        0.014,
        -1.2,
        "points",
    ),
    "sampled, box, its own normal": (
        RoundedBox(0.028, 0.028, 0.002),
        samples(False),
        0.0,
        -1.2,
        "points",
    ),
}


def axis(pose: np.ndarray, fingertip: Fingertip) -> np.ndarray:
    """The tip's points in world coordinates [m], shape (k, 2)."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(pose[:2] + fingertip.points @ np.array([[cos, sin], [-sin, cos]]))


def touching(pose: np.ndarray, fingertip: Fingertip, target: Obstacle) -> str:
    """What of the capsule meets the object."""
    if not fingertip.capsule:
        return "points"
    points = axis(pose, fingertip)
    distance, _, _, _, curvature, ahead, rise_ahead, behind, rise_behind = segment_distance(
        target, *points[0], *points[1]
    )
    depth = target.radius + fingertip.radius - distance
    faces = ((ahead, rise_ahead), (behind, rise_behind))
    if any(flat > 0.0 and rise * flat < 10.0 * depth for flat, rise in faces):
        return "flat"
    return "side" if curvature < 0.0 else "end"


def gap_at(pose: np.ndarray, fingertip: Fingertip, target: Obstacle) -> float:
    """Smallest gap of the tip to the object [m]."""
    points = axis(pose, fingertip)
    if fingertip.capsule:
        distance = segment_distance(target, *points[0], *points[1])[0]
    else:
        distance = min(point_distance(target, *point)[0] for point in points)
    return float(distance) - target.radius - fingertip.radius


def press(
    fingertip: Fingertip, target: Obstacle, x: float, angle: float, depth: float
) -> np.ndarray:
    """Pose at which the tip, let down along x, is pressed in by `depth`."""

    def gap(z: float) -> float:
        return gap_at(np.array([x, z, angle]), fingertip, target) + depth

    heights = np.linspace(0.1, -0.02, 1201)
    below = next(z for z in heights if gap(z) < 0.0)
    return np.array([x, brentq(gap, below, below + 1.5e-4, xtol=1e-15), angle])


def put(tip: TipResponse, pose: np.ndarray) -> None:
    """Put the tip's last joint and angle at (x, z, angle)."""
    tip.pose[:] = pose
    tip.turn[:] = math.cos(pose[2]), math.sin(pose[2])


def prepare(
    fingertip: Fingertip, target: Obstacle, pose: np.ndarray, friction: int, normal: int = CLOSED
) -> tuple[TipResponse, ContactWorkspace]:
    """A tip at rest in a pose, with fixed modes for every contact that is pressed in."""
    tip = tip_response()
    put(tip, pose)
    tip.compliance[:, :] = np.diag([0.1, 0.2, 300.0])
    workspace = contact_workspace(fingertip)
    if fingertip.capsule:
        closed = [0]
    else:
        closed = [
            i
            for i, p in enumerate(axis(pose, fingertip))
            if point_distance(target, *p)[0] < target.radius
        ]
    assert closed
    for i in closed:
        workspace.modes.normal[i] = normal
        workspace.modes.friction[i] = friction
    return tip, workspace


def check_tangent(
    fingertip: Fingertip,
    target: Obstacle,
    law: ContactLaw,
    pose: np.ndarray,
    friction: int,
    *,
    normal: int = CLOSED,
    accuracy: float = 1e-5,
) -> None:
    """Compare the tangent of the wrench with central differences at fixed modes."""
    s = 2e3
    tip, workspace = prepare(fingertip, target, pose, friction, normal)
    workspace.increment[:] = 0.0
    workspace.modes.stick_force[:] = 0.003
    _evaluate(fingertip, target, law, s, tip, True, workspace)
    tangent = workspace.tangent.copy()
    differences = np.empty((3, 3))
    for j, step in enumerate((1e-9, 1e-9, 1e-7)):
        wrenches = []
        for sign in (1.0, -1.0):
            workspace.increment[:] = 0.0
            workspace.increment[j] = sign * step
            _evaluate(fingertip, target, law, s, tip, True, workspace)
            wrenches.append(workspace.wrench.copy())
        differences[:, j] = (wrenches[0] - wrenches[1]) / (2.0 * step)
    size = np.array([1.0, 1.0, 0.01])  # m; compares moments with forces, angles with positions
    error = (tangent - differences) / np.outer(size, size)
    assert np.abs(error).max() < accuracy * np.abs(differences / np.outer(size, size)).max()


@pytest.mark.parametrize("friction", [STICK, SLIP_LEFT, SLIP_RIGHT], ids=["stick", "left", "right"])
@pytest.mark.parametrize("slip_velocity", [0.0, 1e-4], ids=["set-valued", "regularised"])
@pytest.mark.parametrize("name", TANGENT_SCENES)
def test_tangent_of_the_wrench(name: str, slip_velocity: float, friction: int) -> None:
    """d(wrench)/d(pose) against central differences of the evaluation, in every mode.

    At rest, where the tangent leaves nothing out.  Differences of 1 nm and 0.1 microradian are
    exact to about 1e-6; the modes are fixed, so the evaluation is smooth.
    """
    contour, fingertip, x, angle, kind = TANGENT_SCENES[name]
    target = obstacle(contour)
    pose = press(fingertip, target, x, angle, 2e-6)
    assert touching(pose, fingertip, target) == kind
    law = ContactLaw(1e4, 1.0, 0.6, slip_velocity, 1e-9)
    # Where a corner ends the flat part, gliding changes that part's length; the tangent leaves
    # that out: 1e-4 of the whole.
    rough = name == "corner and flat top below the side, in touch all along"
    check_tangent(fingertip, target, law, pose, friction, accuracy=2e-4 if rough else 1e-5)


@pytest.mark.parametrize("name", ["circle below the side", "sampled, circle"])
def test_tangent_while_damping_sets_in(name: str) -> None:
    """In the first nanometre of depth the damping force grows with depth: its tangent too.

    With an approach of 4 mm/s; differences over a hundredth of that nanometre.
    """
    contour, fingertip, x, angle, _ = TANGENT_SCENES[name]
    target = obstacle(contour)
    pose = press(fingertip, target, x, angle, 5e-10)
    tip, workspace = prepare(fingertip, target, pose, SLIP_LEFT, GRAZING)
    tip.twist[1] = -0.004
    law = ContactLaw(1e4, 1.0, 0.6, 0.0, 1e-9)
    # A step so short that the velocity does not change with the increment.
    _evaluate(fingertip, target, law, 1e-9, tip, True, workspace)
    tangent, wrench = workspace.tangent.copy(), workspace.wrench.copy()
    assert np.linalg.norm(wrench) > 1e-4
    for j in range(2):
        wrenches = []
        for sign in (1.0, -1.0):
            workspace.increment[:] = 0.0
            workspace.increment[j] = sign * 1e-11
            _evaluate(fingertip, target, law, 1e-9, tip, True, workspace)
            wrenches.append(workspace.wrench.copy())
        difference = (wrenches[0] - wrenches[1]) / 2e-11
        np.testing.assert_allclose(
            tangent[:, j], difference, rtol=1e-4, atol=1e-5 * np.abs(tangent).max()
        )


def test_law_by_hand() -> None:
    """F_N = -k n - b n', F_F = mu F_N against the slip (thesis 4.3), for a circle below the tip.

    One contact, pressed in by 2 micrometres while it approaches at 1 mm/s and slides to the
    right at 3 mm/s: normal force 0.02 + 0.001 N up, friction 0.6 of that to the left.
    """
    ball = Fingertip(np.array([[0.0, 0.0], [1e-3, 1e-3]]), np.zeros((2, 2)), 0.001, True, False)
    target = obstacle(Circle(0.015))
    pose = np.array([0.0, 0.016 - 2e-6, 0.0])
    for slip, mode in ((0.003, SLIP_LEFT), (-0.003, SLIP_RIGHT)):
        tip, workspace = prepare(ball, target, pose, mode)
        tip.twist[:] = slip, -0.001, 0.0
        _evaluate(ball, target, ContactLaw(1e4, 1.0, 0.6, 0.0, 1e-9), 1e-9, tip, True, workspace)
        friction = -0.6 * 0.021 * np.sign(slip)
        np.testing.assert_allclose(
            workspace.wrench, [friction, 0.021, -friction * -0.001], rtol=1e-9
        )


def test_regularised_law_by_hand() -> None:
    """F_F = -mu F_N v / c while |v| < c (thesis Eq. 4.6)."""
    ball = Fingertip(np.array([[0.0, 0.0], [1e-3, 1e-3]]), np.zeros((2, 2)), 0.001, True, False)
    target = obstacle(Circle(0.015))
    tip, workspace = prepare(ball, target, np.array([0.0, 0.016 - 2e-6, 0.0]), STICK)
    tip.twist[:] = 0.25e-4, 0.0, 0.0
    _evaluate(ball, target, ContactLaw(1e4, 1.0, 0.6, 1e-4, 1e-9), 1e-9, tip, True, workspace)
    np.testing.assert_allclose(workspace.wrench[:2], [-0.6 * 0.02 * 0.25, 0.02], rtol=1e-9)


@pytest.mark.parametrize(("angle", "share"), [(0.0, 0.5), (5e-4, None), (5e-3, None)])
def test_flat_overlap_presses_at_the_centre_of_a_bed_of_springs(
    angle: float, share: float | None
) -> None:
    """The capsule's side on a flat top: the force acts where evenly spread springs would.

    Reference: 200001 springs over the side, each as long as it is pressed in.  Level (angle 0)
    that is the middle; tilted, the force moves to the lower end.
    """
    target = obstacle(RoundedBox(0.06, 0.028, 0.002))
    fingertip = capsule()
    depth = 2e-6
    pose = press(fingertip, target, 0.0, PARALLEL + angle, depth)
    tip, workspace = prepare(fingertip, target, pose, STICK)
    _evaluate(fingertip, target, ContactLaw(1e4, 0.0, 0.0, 0.0, 1e-9), 0.0, tip, True, workspace)
    points = axis(pose, fingertip)
    spread = points[0] + np.linspace(0.0, 1.0, 200001)[:, None] * (points[1] - points[0])
    depths = np.maximum(0.0, target.radius + fingertip.radius - (spread[:, 1] - 0.012))
    centre = (depths @ spread[:, 0]) / depths.sum()
    assert workspace.place[0, 0] == pytest.approx(centre, abs=1e-7)
    if share is not None:
        assert centre == pytest.approx(points[:, 0].mean(), abs=1e-7)
    assert workspace.wrench[1] == pytest.approx(1e4 * depth, rel=1e-6)
    assert workspace.wrench[2] == pytest.approx((centre - pose[0]) * workspace.wrench[1], abs=2e-9)


@pytest.mark.parametrize("tilt", [-0.03, -0.01, -1e-6, 0.0, 1e-6, 0.01, 0.03])
def test_blunt_corner_presses_at_the_centre_of_a_bed_of_springs(tilt: float) -> None:
    """The capsule's side on a corner of a 40-gon: both of its faces press.

    Reference: springs along the side as deep as it is below the faces, which slope away on both
    sides by 4.5 degrees at tilt 0: the middle of the corner there, and no jump beside it.
    """
    angle = 0.5 * math.pi + 2.0 * math.pi * np.arange(40) / 40
    corners = 0.015 * np.column_stack([np.cos(angle), np.sin(angle)])
    target = obstacle(Polygon(corners))
    fingertip, depth = capsule(), 1e-5
    x = -0.5 * float(np.sum(fingertip.points @ np.array([1.0, 1.0]))) / math.sqrt(2.0)
    pose = press(fingertip, target, x, PARALLEL + tilt, depth)
    tip, workspace = prepare(fingertip, target, pose, STICK)
    _evaluate(fingertip, target, ContactLaw(1e4, 0.0, 0.0, 0.0, 1e-9), 0.0, tip, True, workspace)
    points = axis(pose, fingertip)
    length = float(np.linalg.norm(points[1] - points[0]))
    along = (points[1] - points[0]) / length
    down = np.array([along[1], -along[0]])
    spread = np.linspace(0.0, length, 200001)
    edge = points[0] + spread[:, None] * along + fingertip.radius * down
    # How deep the edge lies inside the polygon, along the side's normal.
    faces = face_normals(corners)
    room = (np.einsum("ij,ij->i", faces, corners) - edge @ faces.T) / np.maximum(
        1e-9, -(faces @ down)
    )
    depths = np.maximum(0.0, room[:, faces @ down < -1e-9].min(axis=1))
    centre = float(depths @ spread / depths.sum())
    pressed = float((workspace.place[0] - points[0]) @ along)
    assert pressed == pytest.approx(centre, abs=2e-6)


@pytest.mark.parametrize("slip_velocity", [0.0, 1e-4])
@pytest.mark.parametrize("friction", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("seed", range(12))
def test_contact_solution_obeys_law_and_chain(
    seed: int, friction: float, slip_velocity: float
) -> None:
    """What `solve_contact` returns is a solution of chain and contact law together.

    Chain: increment = free increment + compliance x change of the wrench (to 1e-12 m).
    Normal force: what the law gives for the gap and the approach, never negative.
    Friction: against the slip, mu F_N, or less with a slip of zero (regularised: less than c).
    Random compliances (positive definite) and random free increments into the circle.
    """
    rng = np.random.default_rng(seed)
    fingertip, s = capsule(), 2e3
    target = obstacle(Circle(0.015))
    law = ContactLaw(1e4, 1.0, friction, slip_velocity, 1e-9)
    tip = tip_response()
    put(tip, press(fingertip, target, rng.uniform(0.0, 0.01), -1.2, 1e-9))
    tip.twist[:] = rng.normal(size=3) * (0.004, 0.004, 0.1)
    root = rng.normal(size=(3, 3)) * np.array([[0.002], [0.002], [0.2]])
    tip.compliance[:, :] = root @ root.T
    tip.free[:] = rng.normal(size=3) * (1e-5, 1e-5, 1e-4) - (0.0, 1e-5, 0.0)
    workspace = contact_workspace(fingertip)
    assert solve_contact(fingertip, target, law, s, 1e-12, tip, workspace)

    expected = tip.free + tip.compliance @ workspace.wrench
    np.testing.assert_allclose(workspace.increment, expected, rtol=0.0, atol=1e-12)
    pose = tip.pose + workspace.increment
    points = axis(pose, fingertip)
    distance, nx, nz, along, *_ = segment_distance(target, *points[0], *points[1])
    lever = points[0] + along * (points[1] - points[0]) - pose[:2]
    rate = tip.twist + s * workspace.increment
    velocity = rate[:2] + rate[2] * np.array([-lever[1], lever[0]])
    gap, approach = distance - target.radius - fingertip.radius, nx * velocity[0] + nz * velocity[1]
    normal, along_tangent = float(workspace.normal_force[0]), float(workspace.friction_force[0])
    wanted = max(0.0, -law.stiffness * gap - law.damping * approach) if gap < 0.0 else 0.0
    if gap < -1e-9 or gap > 0.0:  # in between damping sets in
        assert normal == pytest.approx(wanted, abs=1e-7)
    assert normal >= 0.0
    slip = -nz * velocity[0] + nx * velocity[1] - rate[2] * fingertip.radius
    assert abs(along_tangent) <= friction * normal * (1.0 + 1e-6) + 1e-12
    if slip_velocity > 0.0:
        law_force = -friction * normal * float(np.clip(slip / slip_velocity, -1.0, 1.0))
        assert along_tangent == pytest.approx(law_force, abs=1e-6 * normal + 1e-12)
    if normal > 0.0 and friction > 0.0 and abs(slip) > max(1e-8, slip_velocity):
        assert along_tangent == pytest.approx(-friction * normal * np.sign(slip), rel=1e-6)


@pytest.mark.parametrize("along_tip_normal", [False, True])
@pytest.mark.parametrize("friction", [0.4, 1.2])
@pytest.mark.parametrize("seed", range(25))
def test_modes_of_shared_sticks_are_found_after_a_jump(
    seed: int, friction: float, along_tip_normal: bool
) -> None:
    """Several points of one tip stick, then its velocity jumps: the new modes are found.

    For a step that is short against mass and contact stiffness, friction under given normal
    forces is a convex problem: there is a solution.  From any modes the search returns one, that
    is for each point F_T = -mu F_N sign(slip), or |F_T| <= mu F_N and a slip of less than 1e-6
    of the tip's speed, and Newton's law for the free tip to 1e-9 of the contact force.
    """
    rng = np.random.default_rng(seed)
    fingertip, s = samples(along_tip_normal), 3e6
    target = obstacle(Circle(rng.uniform(0.008, 0.03)))
    law = ContactLaw(1e4, 1.0, friction, 0.0, 1e-9)
    tip = tip_response()
    put(tip, press(fingertip, target, rng.uniform(-0.004, 0.008), rng.uniform(-1.6, -0.8), 6e-4))
    points = axis(tip.pose, fingertip)
    touched = [k for k, p in enumerate(points) if point_distance(target, *p)[0] < target.radius]
    assert touched
    mass, inertia = 7.7e-4, 2e-8
    arm = np.array(DESIGN.tip.centre_of_gravity)
    cos, sin = tip.turn
    cx, cz = cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]
    motion = np.array([[1.0, 0.0, -cz], [0.0, 1.0, cx], [0.0, 0.0, 1.0]])
    inertias = motion.T @ np.diag([mass, mass, inertia]) @ motion
    tip.compliance[:, :] = np.linalg.inv(inertias) / s**2
    speed = 10.0 ** rng.uniform(-3.0, -1.0)
    tip.free[:] = speed * rng.normal(size=3) * (1.0, 1.0, 100.0) / s
    workspace = contact_workspace(fingertip)
    workspace.modes.normal[touched] = CLOSED
    workspace.modes.friction[:] = rng.integers(SLIP_RIGHT, SLIP_LEFT + 1, len(points))
    assert solve_contact(fingertip, target, law, s, 1e-10, tip, workspace)

    pressed = workspace.normal_force.sum()
    lack = np.linalg.solve(tip.compliance, workspace.increment - tip.free) - workspace.wrench
    np.testing.assert_allclose(lack[:2], 0.0, atol=1e-7 * max(1.0, pressed))
    rate = s * workspace.increment
    fastest = np.abs(rate[:2]).sum() + 0.02 * abs(rate[2])
    pose = tip.pose + workspace.increment
    for k, point in enumerate(axis(pose, fingertip)):
        lx, lz = point - pose[:2]
        gap, nx, nz, _ = point_distance(target, *point)
        if gap - target.radius > -1e-8:  # open, or damping sets in
            continue
        if along_tip_normal:
            angle = tip.pose[2] + workspace.increment[2] + DESIGN.tip.normal_angles[k]
            nx, nz = -math.cos(angle), -math.sin(angle)
        slip = -nz * (rate[0] - rate[2] * lz) + nx * (rate[1] + rate[2] * lx)
        limit = friction * workspace.normal_force[k]
        assert limit >= 0.0
        assert abs(workspace.friction_force[k]) <= limit * (1.0 + 1e-5)
        if abs(slip) > 1e-6 * fastest:
            assert workspace.friction_force[k] == pytest.approx(
                -math.copysign(limit, slip), rel=1e-6
            )
