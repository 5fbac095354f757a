"""From design to chain: masses, lengths and joints of both discretisations."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from hma_gripper_sim import GripperDesign, Scene
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.mechanics.half_gripper import HalfGripper, cantilever, discretise
from hma_gripper_sim.model.contours.circle import Circle
from hma_gripper_sim.simulation.trace import beam_chord, beam_tangent

SPLITS = [("thesis", 5, 25), ("midpoint", 5, 25), ("midpoint", 1, 1), ("midpoint", 1, 3)]
SPLITS += [("midpoint", 2, 8), ("thesis", 1, 1), ("thesis", 3, 4), ("midpoint", 16, 64)]


def poses(half: HalfGripper, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Joints x + i z [m] and angles [rad] of all bodies; the middle of the top beam at 0."""
    chain = half.chain
    position, angle, joints, angles = complex(*chain.root), 0.0, [], []
    for i in range(len(q)):
        angle += chain.rest[i] + q[i]
        joints.append(position)
        angles.append(angle)
        position += complex(*chain.link[i]) * cmath.exp(1j * angle)
    return np.array(joints), np.array(angles)


def test_chain_of_the_thesis(design: GripperDesign) -> None:
    """Joints, stiffnesses and masses of thesis 3.2 and A.1, to the digits they are given with."""
    half = discretise(design, "thesis", 5, 25)
    chain = half.chain
    joints, angles = poses(half, np.zeros(31))
    np.testing.assert_allclose(joints[:5], 1.05e-3 + 2.1e-3 * np.arange(5), rtol=1e-12)
    assert joints[5] == pytest.approx(9.55e-3 - 2e-3j, rel=1e-12)
    along = cmath.exp(-1j * math.radians(83.0))
    np.testing.assert_allclose(joints[5:], joints[5] + 1.72e-3 * np.arange(26) * along, rtol=1e-12)
    np.testing.assert_allclose(angles[:5], 0.0)
    np.testing.assert_allclose(angles[5:], -math.radians(83.0), rtol=1e-14)
    np.testing.assert_allclose(chain.stiffness[:5], 0.15822, rtol=5e-5)
    np.testing.assert_allclose(chain.stiffness[5:], 0.19318, rtol=5e-5)
    np.testing.assert_allclose(chain.damping, 0.01, rtol=1e-14)
    np.testing.assert_allclose(chain.mass[:5], 0.057624e-3, rtol=1e-12)
    np.testing.assert_allclose(chain.mass[5:30], 0.0471968e-3, rtol=1e-12)
    assert chain.mass[30] == pytest.approx(0.76832e-3, rel=1e-12)
    bar = (0.0471968e-3) * (1.72e-3**2 + 4e-3**2) / 12.0
    np.testing.assert_allclose(chain.inertia[5:30], bar, rtol=1e-12)
    assert chain.inertia[30] == pytest.approx(2.0395151e-8, rel=1e-12)
    np.testing.assert_allclose(chain.centre[30], [8.808687272e-3, -2.331376882e-3], rtol=1e-12)
    assert half.middle_mass == pytest.approx(0.057624e-3, rel=1e-12)


def test_midpoint_chain(design: GripperDesign) -> None:
    """Joints in the middle of their GBEs; k = E I / l, b = 0.01 N m s/rad x 1.72 mm / l."""
    half = discretise(design, "midpoint", 2, 8)
    chain = half.chain
    joints, _ = poses(half, np.zeros(10))
    np.testing.assert_allclose(joints[:2], np.array([0.25, 0.75]) * 10.5e-3, rtol=1e-12)
    along = cmath.exp(-1j * math.radians(83.0))
    beam = (9.55e-3 - 2e-3j) + (np.arange(8) + 0.5) / 8.0 * 43e-3 * along
    np.testing.assert_allclose(joints[2:], beam, rtol=1e-12)
    lengths = np.array([5.25e-3] * 2 + [5.375e-3] * 8)
    np.testing.assert_allclose(chain.stiffness, design.bending_stiffness / lengths, rtol=1e-12)
    np.testing.assert_allclose(chain.damping, 0.01 * 1.72e-3 / lengths, rtol=1e-12)
    np.testing.assert_allclose(half.tip_origin, [2.6875e-3, 0.0], rtol=1e-12)


@pytest.mark.parametrize(("discretisation", "top", "beam"), SPLITS)
def test_same_rigid_body_when_stress_free(
    design: GripperDesign, discretisation: str, top: int, beam: int
) -> None:
    """Mass, centre of gravity and inertia of the undeformed gripper depend on no discretisation.

    Reference: line, corner and tip by hand.  Half the middle GBE reaches to the first joint of
    the thesis, or to half the first GBE; with it the top beam reaches from 0 to 11.55 mm.
    """
    half = discretise(design, discretisation, top, beam)
    chain = half.chain
    joints, angles = poses(half, np.zeros(len(chain.mass)))
    arms = (chain.centre[:, 0] + 1j * chain.centre[:, 1]) * np.exp(1j * angles)
    middle = half.middle_mass / 2.0  # from 0 to the first joint
    reach = chain.root[0]
    masses = np.append(chain.mass, middle)
    places = np.append(joints + arms, 0.5 * reach)
    inertia = chain.inertia.sum() + middle * (reach**2 + 4e-3**2) / 12.0
    inertia += float(masses @ np.abs(places) ** 2)

    line = 980.0 * 4e-3 * 7e-3
    along = cmath.exp(-1j * math.radians(83.0))
    corner = 9.55e-3 - 2e-3j
    parts = [
        (line * 11.55e-3, 5.775e-3 + 0j, line * 11.55e-3 * (11.55e-3**2 + 4e-3**2) / 12.0),
        (line * 43e-3, corner + 21.5e-3 * along, line * 43e-3 * (43e-3**2 + 4e-3**2) / 12.0),
        (
            0.76832e-3,
            corner + (43e-3 + 8.808687272e-3 - 2.331376882e-3j) * along,
            2.0395151e-8,
        ),
    ]
    mass = sum(part[0] for part in parts)
    first = sum(part[0] * part[1] for part in parts)
    second = sum(part[2] + part[0] * abs(part[1]) ** 2 for part in parts)
    assert masses.sum() == pytest.approx(mass, rel=1e-12)
    assert masses @ places == pytest.approx(first, rel=1e-12)
    assert inertia == pytest.approx(second, rel=1e-12)
    assert 2.0 * masses.sum() == pytest.approx(design.mass, rel=1e-12)


@pytest.mark.parametrize(("discretisation", "top", "beam"), SPLITS)
def test_tip_is_where_it_is(
    design: GripperDesign, discretisation: str, top: int, beam: int
) -> None:
    """The tip's frame starts 43 mm down the beam, whatever the discretisation."""
    half = discretise(design, discretisation, top, beam)
    joints, angles = poses(half, np.zeros(len(half.chain.mass)))
    origin = joints[-1] + complex(*half.tip_origin) * cmath.exp(1j * angles[-1])
    along = cmath.exp(-1j * math.radians(83.0))
    assert origin == pytest.approx((9.55e-3 - 2e-3j) + 43e-3 * along, rel=1e-12)
    assert math.degrees(beam_tangent(half, np.zeros(len(angles)))) == pytest.approx(97.0)
    assert math.degrees(beam_chord(half, np.zeros(len(angles)))) == pytest.approx(97.0)


@pytest.mark.parametrize("beam", [1, 2, 3, 8, 9, 25])
def test_phi_of_an_evenly_bent_beam(design: GripperDesign, beam: int) -> None:
    """Constant curvature c: the tangent at mid-length turns by c L/2, and so does the chord.

    The tangent of the midpoint discretisation is exact; its chord is that of a polygon, with an
    error below (c L)^2 / (24 n^2) x c L.
    """
    half = discretise(design, "midpoint", 2, beam)
    curvature = 0.4 / 43e-3
    q = np.zeros(2 + beam)
    q[2:] = curvature * 43e-3 / beam
    assert beam_tangent(half, q) - math.radians(97.0) == pytest.approx(0.2, abs=1e-12)
    assert beam_chord(half, q) - math.radians(97.0) == pytest.approx(
        0.2, abs=0.4**3 / (24 * beam**2)
    )


def test_phi_reads_gbe_13_of_the_thesis(design: GripperDesign) -> None:
    """The middle of 25 GBEs lies on the 13th: phi is its angle."""
    half = discretise(design, "thesis", 5, 25)
    q = np.random.default_rng(0).normal(size=31) * 0.01
    _, angles = poses(half, q)
    assert beam_tangent(half, q) == pytest.approx(math.pi + angles[5 + 12], abs=1e-14)


def test_chord_reads_corner_and_tip_joint(design: GripperDesign) -> None:
    """In the thesis' chain the chord goes from the first to the last joint of the beam."""
    half = discretise(design, "thesis", 5, 25)
    q = np.random.default_rng(1).normal(size=31) * 0.01
    joints, _ = poses(half, q)
    chord = cmath.phase(joints[30] - joints[5])
    assert beam_chord(half, q) == pytest.approx(math.pi + chord, abs=1e-13)


def test_joint_names(design: GripperDesign) -> None:
    """63 names in the fixed order, right before left, from the middle outwards."""
    names = Scene(design, Circle(0.015)).joint_names
    wanted = ["slide"]
    wanted += [f"top_{side}_{i}" for side in ("right", "left") for i in range(1, 6)]
    wanted += [f"beam_{side}_{i}" for side in ("right", "left") for i in range(1, 26)]
    wanted += ["tip_right", "tip_left"]
    assert names == tuple(wanted)
    few = Scene(design, Circle(0.015), discretisation="midpoint").joint_names
    assert len(few) == len(set(few)) == 1 + 2 * (2 + 8)
    assert few[:3] == ("slide", "top_right_1", "top_right_2")


@pytest.mark.parametrize("discretisation", ["thesis", "midpoint"])
def test_cantilever_chain(discretisation: str) -> None:
    """All links together are as long as the beam, all springs in a row as soft as E I / L."""
    chain = cantilever(0.03, 10, 2e-4, discretisation)
    assert chain.root[0] + chain.link[:, 0].sum() == pytest.approx(0.03)
    joints = 10 if discretisation == "midpoint" else 9
    assert (1.0 / chain.stiffness).sum() == pytest.approx(0.003 * joints / 2e-4)


@pytest.mark.parametrize(
    ("discretisation", "elements", "degree"),
    [("thesis", 8, 0), ("midpoint", 5, 0), ("gauss", 2, 1), ("gauss", 3, 2), ("gauss", 6, 5)],
)
def test_tangents_of_a_beam_of_polynomial_curvature(
    discretisation: str, elements: int, degree: int
) -> None:
    """Bent with curvature s^degree, each GBE by its length times that at its joint.

    The tangent turns by s^(degree + 1) / (degree + 1); `gauss` interpolates polynomials up to its
    number of joints exactly, the others a constant. The thesis' first joint stands at the start:
    bodies are half a GBE ahead, and reach their last tangent half a GBE before the end.
    """
    at = np.linspace(0.2, 0.9, 8)
    scheme = DISCRETISATIONS[discretisation]
    joints, lengths = scheme.partition(elements)
    angles = lengths * joints**degree
    ahead = 0.5 / elements if discretisation == "thesis" else 0.0
    wanted = (at + ahead) ** (degree + 1) / (degree + 1)
    turned = scheme.tangent_weights(elements, at) @ angles
    np.testing.assert_allclose(turned, wanted, rtol=1e-12)
