"""What the packages' files promise: to ROS 2 tools, to pip, and to users without ROS."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "hma_gripper_sim"
PACKAGE_XML = ET.parse(ROOT / "package.xml").getroot()
ROS_MODULE = re.compile(
    r"rclpy|launch|launch_ros|ament_\w+|rosidl_\w+|tf2_\w+|\w+_(msgs|srvs|interfaces)"
)


@pytest.fixture(scope="module")
def setup_arguments() -> dict[str, ast.expr]:
    """The keyword arguments of the call of setup() in setup.py."""
    for node in ast.walk(ast.parse((ROOT / "setup.py").read_text())):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "setup"
        ):
            return {keyword.arg: keyword.value for keyword in node.keywords if keyword.arg}
    raise LookupError("setup.py calls no setup()")


def imported_modules(path: Path) -> set[str]:
    """The top-level names of all absolute imports in a file, wherever they stand in it."""
    modules = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules.add(node.module)
    return {module.split(".")[0] for module in modules}


def ros_modules(path: Path) -> set[str]:
    return {module for module in imported_modules(path) if ROS_MODULE.fullmatch(module)}


def test_colcon_takes_it_for_an_ament_python_package() -> None:
    """An invalid package.xml makes colcon build a plain Python package that `ros2 run` misses."""
    assert PACKAGE_XML.tag == "package"
    assert PACKAGE_XML.get("format") == "3"
    assert PACKAGE_XML.findtext("export/build_type") == "ament_python"
    for required in ("name", "version", "description", "maintainer", "license"):
        assert PACKAGE_XML.findtext(required), required
    assert (ROOT / "resource" / PACKAGE_XML.findtext("name", "")).is_file()


@pytest.mark.parametrize("field", ["name", "version", "license"])
def test_package_xml_agrees_with_setup_py(field: str, setup_arguments: dict[str, ast.expr]) -> None:
    assert ast.literal_eval(setup_arguments[field]) == PACKAGE_XML.findtext(field)


def test_newest_changelog_entry_is_this_version() -> None:
    entries = re.findall(r"^(\S+) \(.+\)\n-+$", (ROOT / "CHANGELOG.rst").read_text(), re.MULTILINE)
    assert entries[0] == PACKAGE_XML.findtext("version")


def test_every_executable_exists(setup_arguments: dict[str, ast.expr]) -> None:
    for script in ast.literal_eval(setup_arguments["entry_points"])["console_scripts"]:
        module, function = script.split("=")[1].strip().split(":")
        tree = ast.parse((ROOT / module.replace(".", "/")).with_suffix(".py").read_text())
        assert function in {getattr(node, "name", None) for node in tree.body}, script


def test_package_xml_names_every_ros_package_in_use() -> None:
    used = set().union(*map(ros_modules, [*PACKAGE.rglob("*.py"), *ROOT.glob("launch/*.py")]))
    assert used <= {element.text for element in PACKAGE_XML.iter("exec_depend")}


def test_only_the_ros_folder_imports_ros() -> None:
    importers = {path for path in PACKAGE.rglob("*.py") if ros_modules(path)}
    assert importers, "the check finds no imports at all"
    assert {path.relative_to(PACKAGE).parts[0] for path in importers} == {"ros"}


def test_importing_the_package_loads_no_ros() -> None:
    code = "import sys, hma_gripper_sim; print(*sys.modules)"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    loaded = {name.split(".")[0] for name in result.stdout.split()}
    assert "hma_gripper_sim" in loaded
    assert {name for name in loaded if ROS_MODULE.fullmatch(name)} == set()


@pytest.mark.parametrize(
    ("statement", "place"),
    [
        ("from hma_gripper_sim.logs.reader import read_recording", "recordings"),
        ("from hma_gripper_sim.reduced import thesis_joint_states", "analysis.thesis_joints"),
        ("from hma_gripper_sim import reduced", "analysis.thesis_joints"),
    ],
)
def test_a_module_that_has_moved_says_where_it_is(statement: str, place: str) -> None:
    with pytest.raises(ModuleNotFoundError, match=f"is now hma_gripper_sim.{place}"):
        exec(statement)


def test_every_folder_of_the_package_is_installed() -> None:
    """setup.py installs what find_packages() finds: folders that have an __init__.py."""
    assert {path.parent for path in PACKAGE.rglob("*.py")} == {
        path.parent for path in PACKAGE.rglob("__init__.py")
    }


def test_the_tree_names_no_path_of_one_machine() -> None:
    machine_path = re.compile(r"(?<![\w.~})-])/(?:home|root|Users|tmp|mnt|work)/[\w.]")
    skipped = {"build", "install", "log", "report", "dist", "__pycache__"}
    files = [
        path
        for path in ROOT.rglob("*")
        if path.suffix in {".py", ".md", ".rst", ".toml", ".cfg", ".xml", ".yaml", ".csv", ""}
        and path.is_file()
        and not any(
            part in skipped
            or (part.startswith(".") and part != ".ci")
            or part.endswith(".egg-info")
            for part in path.relative_to(ROOT).parts
        )
    ]
    assert ROOT / "setup.py" in files
    named = {path: machine_path.findall(path.read_text(encoding="utf-8")) for path in files}
    assert {path: found for path, found in named.items() if found} == {}
