"""The URDF: its links stand where the simulation has its bodies, and weigh what they weigh."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from hma_gripper_sim import Circle, GripperDesign, InputError, Scene, Simulation
from hma_gripper_sim.cli.main import cli
from hma_gripper_sim.kernels.chain import chain_workspace, place, tip_response
from hma_gripper_sim.motion.drive_limits import DriveLimits
from hma_gripper_sim.results.gripper_outline import gripper_outline
from hma_gripper_sim.results.robot_description import MOUNT, gripper_urdf

TOLERANCE = 1e-9  # m

LIMITS = DriveLimits(
    max_velocity=0.05, max_acceleration=0.5, travel_min=-0.01, travel_max=0.03, command_timeout=0.5
)


def other_design(thesis: GripperDesign) -> GripperDesign:
    return replace(
        thesis, width=0.003, height=0.01, beam_angle=-0.2, beam_length=0.05, beam_elements=11
    )


SCENES: dict[str, Callable[[GripperDesign], Scene]] = {
    "thesis": lambda design: Scene(design, Circle(0.015)),
    "midpoint": lambda design: Scene(design, Circle(0.015), discretisation="midpoint"),
    "one element": lambda design: Scene(
        design, Circle(0.015), discretisation="midpoint", elements_top=1, elements_beam=1
    ),
    "few elements": lambda design: Scene(design, Circle(0.015), elements_top=3, elements_beam=7),
    "other design": lambda design: Scene(other_design(design), Circle(0.015)),
    "other design, midpoint": lambda design: Scene(
        other_design(design), Circle(0.015), discretisation="midpoint", elements_beam=5
    ),
}


@pytest.fixture(params=SCENES)
def scene(request: pytest.FixtureRequest, design: GripperDesign) -> Scene:
    return SCENES[request.param](design)


def load(text: str):
    return pytest.importorskip("yourdfpy").URDF.load(io.StringIO(text), load_meshes=False)


def in_plane(places) -> np.ndarray:
    """Points of the frame MOUNT, shape (n, 3), in the drawing plane, where z is up."""
    x, y, z = np.transpose(places)
    assert np.abs(y).max() < TOLERANCE
    return np.column_stack([x, -z])


def check_places(scene: Scene, robot, positions: np.ndarray) -> None:
    """Links, centres of gravity and outlines of a pose, against the simulation's."""
    robot.update_cfg(dict(zip(scene.joint_names, positions, strict=True)))
    frames = {name: robot.get_transform(link(name), MOUNT) for name in scene.joint_names}
    chain, n = scene.half.chain, scene.half.chain.rest.size
    workspace, tip, zero = chain_workspace(n), tip_response(), np.zeros(n)
    for columns, mirror in zip(scene.joint_columns, (1.0, -1.0), strict=True):
        q = mirror * positions[columns]
        place(chain, np.array([-positions[0], 0.0, 0.0]), 9.81, q, zero, zero, workspace, tip)
        joints = (
            chain.root
            - (0.0, positions[0])
            + np.cumsum(np.vstack([np.zeros(2), workspace.link[:-1]]), axis=0)
        )
        names = [scene.joint_names[column] for column in columns]
        ours = in_plane([frames[name][:3, 3] for name in names])
        assert ours * (mirror, 1.0) == pytest.approx(joints, abs=TOLERANCE)
        assert ours[-1] * (mirror, 1.0) == pytest.approx(tip.pose[:2], abs=TOLERANCE)
        # Counter-clockwise in the plane: from x, to the right, towards -z, upwards.
        turned = frames[names[-1]][:3, :3] @ (1.0, 0.0, 0.0)
        angle = mirror * tip.pose[2]
        assert turned == pytest.approx((np.cos(angle), 0.0, -np.sin(angle)), abs=TOLERANCE)
        centres = [
            (frames[name] @ robot.link_map[link(name)].inertial.origin)[:3, 3] for name in names
        ]
        assert in_plane(centres) * (mirror, 1.0) == pytest.approx(
            joints + workspace.arm, abs=TOLERANCE
        )
    check_outline(scene, robot, frames, positions)


def check_outline(scene: Scene, robot, frames, positions: np.ndarray) -> None:
    """Every corner of every box, and the axes of the discs that round off the tips."""
    bodies = gripper_outline(scene, positions).bodies
    drawn = np.vstack(bodies)
    corners, discs = [], []
    for name, frame in frames.items():
        for visual in robot.link_map[link(name)].visuals:
            at = frame @ visual.origin
            if visual.geometry.box is not None:
                x, y, z = 0.5 * np.asarray(visual.geometry.box.size)
                assert 2.0 * y == pytest.approx(scene.design.height)
                for a, b in ((x, z), (x, -z), (-x, z), (-x, -z)):
                    corners.append((at @ (a, 0.0, b, 1.0))[:3])
            else:
                disc = visual.geometry.cylinder
                assert disc.length == pytest.approx(scene.design.height)
                assert np.abs(at[:3, 2]) == pytest.approx((0.0, 1.0, 0.0), abs=TOLERANCE)
                discs.append((*at[:3, 3], disc.radius))
    assert len(corners) == 4 * len(bodies)
    assert distances(in_plane(corners), drawn).min(axis=1).max() < TOLERANCE
    bars = np.vstack([body for body in bodies if len(body) == 5])
    assert distances(bars, in_plane(corners)).min(axis=1).max() < TOLERANCE
    arcs = np.vstack([body for body in bodies if len(body) > 5])
    centres, radii = in_plane([disc[:3] for disc in discs]), np.array([disc[3] for disc in discs])
    assert np.abs(distances(arcs, centres) - radii).min(axis=1).max() < TOLERANCE


def distances(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.linalg.norm(a[:, None] - b[None], axis=2)


def link(joint: str) -> str:
    return f"{joint}_link"


def test_joints_are_those_of_the_joint_states(scene):
    robot = load(gripper_urdf(scene, LIMITS))
    joints = robot.robot.joints
    assert [joint.name for joint in joints] == list(scene.joint_names)
    assert [joint.type for joint in joints] == ["prismatic", *["revolute"] * (len(joints) - 1)]
    assert robot.base_link == MOUNT
    slide = joints[0].limit
    assert (slide.lower, slide.upper, slide.velocity) == (-0.01, 0.03, 0.05)


def test_links_are_where_the_simulation_has_them(scene):
    robot = load(gripper_urdf(scene, LIMITS))
    random = np.random.default_rng(1)
    n = len(scene.joint_names)
    check_places(scene, robot, np.zeros(n))
    for bend in (0.02, 0.1, 0.5):
        check_places(scene, robot, random.normal(scale=bend, size=n) * ([0.1] + [1.0] * (n - 1)))


@pytest.mark.parametrize("discretisation", ["thesis", "midpoint"])
def test_links_are_where_a_simulated_grip_has_them(design, discretisation):
    scene = Scene(
        design, Circle(0.015), discretisation=discretisation, clearance=0.002, offset=0.001
    )
    robot = load(gripper_urdf(scene, LIMITS))
    simulation = Simulation(scene)
    for _ in range(4):
        simulation.step(0.6, 0.004)
        check_places(scene, robot, simulation.state().joint_position)
    right, left = (simulation.state().joint_position[columns] for columns in scene.joint_columns)
    assert np.abs(right + left).max() > 1e-4, "the grip is symmetric: a mix-up would not show"


def test_inertia_is_physical_and_in_the_plane_the_simulations(scene):
    robot = load(gripper_urdf(scene, LIMITS))
    inertials = {name: robot.link_map[link(name)].inertial for name in scene.joint_names}
    assert sum(item.mass for item in inertials.values()) == pytest.approx(
        scene.half.middle_mass + 2.0 * scene.half.chain.mass.sum()
    )
    for item in inertials.values():
        tensor = np.asarray(item.inertia)
        assert tensor == pytest.approx(tensor.T)
        a, b, c = np.linalg.eigvalsh(tensor)
        assert 0.0 < a <= b <= c <= (a + b) * (1 + 1e-12)
    for columns in scene.joint_columns:
        moments = [inertials[scene.joint_names[column]].inertia[1, 1] for column in columns]
        assert moments == pytest.approx(scene.half.chain.inertia, rel=1e-12)


def test_a_straight_body_has_the_inertia_of_a_cuboid(design):
    """I = m (a² + b²) / 12 about each axis; l, h, w along x, y, z."""
    scene = Scene(design, Circle(0.015))
    inertial = load(gripper_urdf(scene, LIMITS)).link_map["beam_left_3_link"].inertial
    length, width, height = design.beam_length / design.beam_elements, design.width, design.height
    squares = np.array([height**2 + width**2, length**2 + width**2, length**2 + height**2])
    assert inertial.inertia == pytest.approx(np.diag(inertial.mass * squares / 12.0))


def test_a_bent_body_has_products_of_inertia_of_either_sign(design):
    """The corner's second piece hangs down and outwards: -∫ x z dm, z down, changes with x."""
    scene = Scene(design, Circle(0.015), discretisation="midpoint", elements_beam=2)
    links = load(gripper_urdf(scene, LIMITS)).link_map
    right, left = (links[f"top_{side}_2_link"].inertial.inertia for side in ("right", "left"))
    assert right[0, 2] < 0.0 < left[0, 2]
    assert right[0, 2] == pytest.approx(-left[0, 2])


def test_revolute_limits_are_the_materials_linear_range(design):
    scene = Scene(design, Circle(0.015))
    robot = load(gripper_urdf(scene, LIMITS))
    for columns in scene.joint_columns:
        for column, stiffness in zip(columns, scene.half.chain.stiffness, strict=True):
            limit = robot.joint_map[scene.joint_names[column]].limit
            assert limit.lower == -limit.upper
            assert design.bending_stress(limit.effort) == pytest.approx(1.2e6)
            assert stiffness * limit.upper == pytest.approx(limit.effort)
            assert limit.velocity > 0.0


def test_a_parent_carries_the_mount_by_a_fixed_joint(design):
    scene = Scene(design, Circle(0.015))
    text = gripper_urdf(scene, LIMITS, parent="tool0", xyz=(0.1, 0.0, 0.2), rpy=(np.pi, 0.0, 0.0))
    robot = load(text)
    assert robot.base_link == "tool0"
    expected = np.diag([1.0, -1.0, -1.0, 1.0])
    expected[:3, 3] = 0.1, 0.0, 0.2
    assert robot.get_transform(MOUNT, "tool0") == pytest.approx(expected)


@pytest.mark.parametrize("name", ["", " ", MOUNT, "slide_link", "tip_left_link"])
def test_a_parent_that_cannot_be_is_refused(design, name):
    with pytest.raises(InputError, match="parent"):
        gripper_urdf(Scene(design, Circle(0.015)), LIMITS, parent=name)


ARM = """<?xml version="1.0" encoding="utf-8"?>
<robot name="arm">
  <link name="base"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/>
    <child link="flange"/>
    <axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/>
    <origin xyz="0.3 0 0.4" rpy="0 0 0"/>
  </joint>
  <link name="flange"/>
</robot>
"""


def test_on_an_arm_the_gripper_moves_with_its_flange(design):
    scene = Scene(design, Circle(0.015))
    text = gripper_urdf(scene, LIMITS, arm=ARM, parent="flange", xyz=(0.0, 0.0, 0.1))
    robot = load(text)
    assert robot.robot.name == "arm"
    assert robot.base_link == "base"
    joints = [joint.name for joint in robot.robot.joints]
    assert joints == ["shoulder", "gripper_mount_joint", *scene.joint_names]
    robot.update_cfg({"shoulder": np.pi / 2, "slide": 0.02})
    # z of the flange, and with it the travel, now points along x of the base.
    place = robot.get_transform("slide_link", "base")[:3, 3]
    assert place == pytest.approx((0.3 + 0.1 + 0.02, 0.0, 0.4))


@pytest.mark.parametrize(
    ("arm", "parent", "reason"),
    [
        (ARM, None, "must be a link of the arm, got None"),
        (ARM, "tool0", "must be a link of the arm, got 'tool0'"),
        (ARM.replace("shoulder", "slide"), "flange", "already has a link or joint 'slide'"),
        (ARM.replace("base", "gripper_mount"), "flange", "joint 'gripper_mount'"),
        (ARM.replace("robot", "sdf"), "flange", "its root is <sdf>"),
        (ARM[:-10], "flange", "not XML"),
        (
            ARM.replace(
                '<link name="base"/>', '<a:arg xmlns:a="http://www.ros.org/wiki/xacro" name="x"/>'
            ),
            "flange",
            "expand it first",
        ),
    ],
)
def test_an_arm_that_cannot_carry_it_is_refused(design, arm, parent, reason):
    with pytest.raises(InputError, match=reason):
        gripper_urdf(Scene(design, Circle(0.015)), LIMITS, arm=arm, parent=parent)


def test_two_grippers_with_prefixes_are_one_description(design, tmp_path):
    """Beside an arm that has a `slide` of its own."""
    (tmp_path / "arm.urdf").write_text(ARM.replace("shoulder", "slide"))
    for prefix in ("left_", "right_"):
        arm = run("--prefix", prefix, "--arm", tmp_path / "arm.urdf", "--parent", "flange")
        assert arm.exit_code == 0, arm.output
        (tmp_path / "arm.urdf").write_text(arm.output)
    robot = load(arm.output)
    names = Scene(design, Circle(0.015)).joint_names
    assert [joint.name for joint in robot.robot.joints] == [
        "slide",
        *("left_gripper_mount_joint", *(f"left_{name}" for name in names)),
        *("right_gripper_mount_joint", *(f"right_{name}" for name in names)),
    ]
    robot.update_cfg({"left_slide": 0.02, "right_slide": 0.01})
    for prefix, travel in (("left_", 0.02), ("right_", 0.01)):
        place = robot.get_transform(f"{prefix}slide_link", f"{prefix}gripper_mount")[:3, 3]
        assert place == pytest.approx((0.0, 0.0, travel))
    materials = [item.get("name") for item in ET.fromstring(arm.output).findall("material")]
    assert len(set(materials)) == 2  # urdfdom refuses two of one name
    refused = run("--prefix", "left_", "--arm", tmp_path / "arm.urdf", "--parent", "flange")
    assert "already has a link or joint 'left_beam_left_1'" in refused.stderr


def test_what_is_seen_can_be_collided_with(scene):
    links = ET.fromstring(gripper_urdf(scene, LIMITS)).findall("link")
    shapes = 0
    for element in links:
        parts = [
            [
                [ET.tostring(part).strip() for part in item if part.tag != "material"]
                for item in kind
            ]
            for kind in (element.findall("visual"), element.findall("collision"))
        ]
        assert parts[0] == parts[1]
        shapes += len(parts[1])
    assert shapes > len(links)  # every link but the mount, and the tips have several


def run(*arguments: str | Path):
    return CliRunner().invoke(cli, ["urdf", *map(str, arguments)])


def test_command_describes_the_gripper_of_a_parameter_file(design, tmp_path):
    other_design(design).to_yaml(tmp_path / "design.yaml")
    parameters = {
        "design": str(tmp_path / "design.yaml"),
        "discretisation": "midpoint",
        "elements_beam": 3,
        "travel_max": 0.02,
        "contours": {"mug": {"type": "circle", "radius": 0.02}},
        "contour": "mug",
    }
    file = tmp_path / "node.yaml"
    file.write_text(yaml.safe_dump({"/arm/hma_gripper_sim": {"ros__parameters": parameters}}))
    output = tmp_path / "gripper.urdf"
    result = run("--params-file", file, "--output", output, "--elements-beam", "4")
    assert (result.exit_code, result.output) == (0, "")
    scene = Scene(other_design(design), Circle(0.02), discretisation="midpoint", elements_beam=4)
    limits = replace(LIMITS, travel_min=0.0, travel_max=0.02)
    assert output.read_text() == gripper_urdf(scene, limits)


def test_command_prints_the_thesis_gripper(design):
    result = run("--parent", "tool0", "--xyz", "0", "0", "0.1")
    assert result.exit_code == 0
    limits = replace(LIMITS, travel_min=0.0)
    scene = Scene(design, Circle(0.015))
    assert result.output == gripper_urdf(scene, limits, parent="tool0", xyz=(0.0, 0.0, 0.1))
    assert len(ET.fromstring(result.output).findall("joint")) == 64


def test_command_hangs_it_on_an_arm(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    result = run("--arm", tmp_path / "arm.urdf", "--parent", "flange")
    assert result.exit_code == 0
    assert load(result.output).base_link == "base"


@pytest.mark.parametrize(
    ("arguments", "content", "start"),
    [
        (["--design", "{file}"], "width: 4 mm", "{file}: material: is missing"),
        (["--discretisation", "fine"], "", "discretisation: must be one of"),
        (["--prefix", "2 "], "", "prefix: must be of letters, digits and _"),
        (["--elements-beam", "-1"], "", "elements_beam: must be at least"),
        (["--parent", "slide_link"], "", "parent: 'slide_link' is no name"),
        (["--xyz", "0", "0", "nan", "--parent", "tool0"], "", "xyz: must be finite"),
        (["--xyz", "0", "0", "1"], "", "parent: a place needs a link"),
        (["--arm", "{file}"], "<robot/>", "parent: must be a link of the arm"),
        (["--arm", "{file}", "--parent", "a"], "{}", "{file}: arm: not XML"),
        (["--arm", "{file}.urdf", "--parent", "a"], "", "{file}.urdf: cannot be read"),
        (["--params-file", "{file}"], "{}", "{file}: holds no ros__parameters"),
        (
            ["--params-file", "{file}"],
            "/**: {ros__parameters: {travel_max: -1.0}}",
            "{file}: travel_max: must be at least",
        ),
    ],
)
def test_command_refuses_bad_input_in_one_line(tmp_path, arguments, content, start):
    file = tmp_path / "bad.yaml"
    file.write_text(content)
    output = tmp_path / "gripper.urdf"
    result = run("--output", output, *(item.format(file=file) for item in arguments))
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith("error: " + start.format(file=file)), result.stderr
    assert result.stderr.count("\n") == 1
    assert not output.exists()
