"""Forward kinematics against the solver's own sweep and against differences of poses."""

from __future__ import annotations

import cmath

import numpy as np
import pytest

from hma_gripper_sim import Circle, GripperDesign, Scene
from hma_gripper_sim.kernels.chain import Chain, chain_workspace, place, tip_response
from hma_gripper_sim.kernels.kinematics import place_tip
from hma_gripper_sim.mechanics.body_motion import body_motion
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS


@pytest.fixture(params=DISCRETISATIONS)
def chain(design: GripperDesign, request: pytest.FixtureRequest) -> Chain:
    return Scene(design, Circle(0.015), discretisation=request.param).half.chain


def joints(chain: Chain, q: np.ndarray) -> np.ndarray:
    """Joints x + i z [m], one after the other: a joint slides by s q^2, half of q further round."""
    place, angle, found = complex(*chain.root), 0.0, []
    columns = (chain.rest, chain.link, chain.straightening, q)
    for rest, link, slides, turn in zip(*columns, strict=True):
        angle += rest + turn
        place += slides * turn**2 * cmath.exp(1j * (angle - turn / 2))
        found.append(place)
        place += complex(*link) * cmath.exp(1j * angle)
    return np.array(found)


def random_state(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles [rad], rates and accelerations as large as where a beam snaps through."""
    rng = np.random.default_rng(2013)
    return 0.1 * rng.normal(size=n), 3.0 * rng.normal(size=n), 400.0 * rng.normal(size=n)


def test_joints_are_where_a_recursion_by_hand_has_them(chain: Chain) -> None:
    q, v, a = random_state(len(chain.rest))
    expected = joints(chain, q)
    np.testing.assert_allclose(body_motion(chain, q, v, a).joint, expected, rtol=0.0, atol=1e-16)
    x, z, angle = place_tip(chain, 0.02, q)
    assert complex(x, z) == pytest.approx(expected[-1] - 0.02j, abs=1e-16)
    assert angle == pytest.approx((q + chain.rest).sum(), abs=1e-14)


def test_the_solver_has_the_same_poses_and_the_same_inertia_forces(chain: Chain) -> None:
    """Its loads are -m (acceleration + g) at the centres of gravity, the base's motion included."""
    n = len(chain.rest)
    q, v, a = random_state(n)
    workspace, tip = chain_workspace(n), tip_response()
    place(chain, np.array([-0.02, -0.3, 5.0]), 9.81, q, v, a, workspace, tip)
    motion = body_motion(chain, q, v, a)
    assert complex(*tip.pose[:2]) == pytest.approx(motion.joint[-1] - 0.02j, abs=1e-15)
    arms = motion.centre - motion.joint
    np.testing.assert_allclose(workspace.arm @ (1.0, 1j), arms, rtol=0.0, atol=1e-16)
    loads = -chain.mass * (motion.centre_acceleration + 1j * (5.0 + 9.81))
    scale = np.abs(loads).max()
    np.testing.assert_allclose(
        workspace.load[:, :2] @ (1.0, 1j), loads, rtol=0.0, atol=1e-12 * scale
    )


def test_velocities_and_accelerations_are_the_rates_of_places(chain: Chain) -> None:
    """Along q + v t + a t^2 / 2, by central differences, whose error is of second order in h."""
    q, v, a = random_state(len(chain.rest))
    h = 1e-5
    before, after = (
        body_motion(chain, q + sign * h * v + 0.5 * h**2 * a, v, a).centre for sign in (-1.0, 1.0)
    )
    motion = body_motion(chain, q, v, a)
    velocity = (after - before) / (2.0 * h)
    acceleration = (after - 2.0 * motion.centre + before) / h**2
    for found, expected in (
        (velocity, motion.centre_velocity),
        (acceleration, motion.centre_acceleration),
    ):
        largest = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * largest)
