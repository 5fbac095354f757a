"""`colcon test` in a Jazzy workspace of Ubuntu 24.04 sees every test.

It runs pytest 7.4.4 with the plugin of launch_testing 3.4, which imports each test file once more
and by its bare name: files of equal names collide, and what is skipped while a module is imported
takes the whole collection with it.  Of the packages that the tests use, Ubuntu lacks yourdfpy.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from patience import patience

ROOT = Path(__file__).parents[2]

LONGEST_NAME = 2000  # characters: over one of two million colcon sat for more than ten minutes

PLUGIN = """
import sys

from _pytest.pathlib import import_path


class Missing:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name.partition(".")[0] == "yourdfpy":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


sys.meta_path.insert(0, Missing)


def pytest_pycollect_makemodule(module_path, parent):
    assert not hasattr(import_path(module_path, root=None), "generate_test_description")
"""


def collected(*options: str, **variables: str) -> Counter[str]:
    """How many tests are collected of each file."""
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*command, *options],
        cwd=ROOT,
        env={**os.environ, **variables, "PYTEST_ADDOPTS": ""},  # colcon's own are in there
        capture_output=True,
        text=True,
        timeout=patience(300.0),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert max(map(len, lines)) < LONGEST_NAME
    return Counter(line.partition("::")[0] for line in lines if "::" in line)


def test_all_tests_are_collected_as_colcon_does(tmp_path: Path) -> None:
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--target", str(tmp_path)]
    installed = subprocess.run(
        [*install, "pytest==7.4.4"], capture_output=True, text=True, timeout=patience(300.0)
    )
    if installed.returncode:
        pytest.skip(f"pytest 7.4.4 cannot be installed: {installed.stderr.strip()[-200:]}")
    (tmp_path / "like_launch_testing.py").write_text(PLUGIN)
    version = subprocess.run(
        [sys.executable, "-m", "pytest", "--version"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "7.4.4" in version.stdout + version.stderr
    everything = collected()
    assert everything.total() > 2000
    assert collected("-p", "like_launch_testing", PYTHONPATH=str(tmp_path)) == everything
