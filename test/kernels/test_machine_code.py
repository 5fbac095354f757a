"""Compiled kernels on disk: right results whatever became of the files, and of the kernels."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from patience import patience

import hma_gripper_sim
from hma_gripper_sim.kernels.compiled import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="numba is missing or switched off")

KERNELS = Path(hma_gripper_sim.__file__).parent / "kernels"

INNER = """
from hma_gripper_sim.kernels.compiled import kernel

@kernel
def stiffness(x):
    return 1000.0 * x
"""

OUTER = """
from hma_gripper_sim.kernels.compiled import kernel
from hma_gripper_sim.kernels.inner import stiffness

@kernel
def force(x):
    return stiffness(x) + 1.0
"""

PROGRAM = """
import json
from hma_gripper_sim.kernels.outer import force
value = force(0.5)
print(json.dumps([value, sum(force.stats.cache_hits.values()), force.stats.cache_path]))
"""


class Run(NamedTuple):
    """What a process found: the force, whether it was compiled before, where, and what it said."""

    value: float
    hits: int
    folder: str
    said: str


class Installation:
    """A package of two kernels, one of which is inlined into the other from another file."""

    def __init__(self, root: Path) -> None:
        self.kernels = root / "site" / "hma_gripper_sim" / "kernels"
        self.kernels.mkdir(parents=True)
        (self.kernels.parent / "__init__.py").touch()
        for source in ("__init__.py", "compiled.py", "machine_code.py"):
            shutil.copy(KERNELS / source, self.kernels)
        (self.kernels / "inner.py").write_text(INNER)
        (self.kernels / "outer.py").write_text(OUTER)
        self.environment = {
            name: value for name, value in os.environ.items() if not name.startswith("NUMBA")
        } | {
            "PYTHONPATH": str(root / "site"),
            "PYTHONDONTWRITEBYTECODE": "1",
            "HOME": str(root / "home"),
            "XDG_CACHE_HOME": str(root / "cache"),
        }
        self.cache = root / "cache"

    def start(self, **options: Any) -> subprocess.Popen[str]:
        """Start a process that calls the outer kernel."""
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM],
            env=self.environment,
            cwd=self.kernels.parents[2],  # not where the tested package lies
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            **options,
        )

    def run(self, **options: Any) -> Run:
        """Return what such a process finds."""
        return finished(self.start(**options))

    def files(self) -> list[Path]:
        """What is kept."""
        return [path for path in self.cache.rglob("*") if path.is_file()]


def finished(process: subprocess.Popen[str]) -> Run:
    out, said = process.communicate(timeout=patience(120.0))
    assert process.returncode == 0, said
    return Run(*(*json.loads(out), said))


@pytest.fixture
def installation(tmp_path: Path) -> Installation:
    return Installation(tmp_path)


def test_the_second_start_compiles_nothing_and_the_package_stays_as_it_was(installation) -> None:
    before = sorted(installation.kernels.rglob("*"))
    first, second = installation.run(), installation.run()
    assert (first.value, first.hits) == (501.0, 0)
    assert (second.value, second.hits) == (501.0, 1)
    assert Path(first.folder).is_relative_to(installation.cache)
    assert sorted(installation.kernels.rglob("*")) == before
    assert first.said == second.said == ""


@pytest.mark.parametrize("own_folder", [False, True])
def test_a_changed_kernel_is_noticed_where_it_is_inlined(
    installation, tmp_path, own_folder
) -> None:
    """Also by its content alone: with the size and the time that it had."""
    if own_folder:
        installation.environment["NUMBA_CACHE_DIR"] = str(tmp_path / "numba")
    source = installation.kernels / "inner.py"
    assert installation.run().value == 501.0
    times = source.stat()
    source.write_text(INNER.replace("1000.0", "2000.0"))
    os.utime(source, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert installation.run().value == 1001.0


def test_the_times_of_files_do_not_matter(installation) -> None:
    installation.run()
    for source in installation.kernels.iterdir():
        os.utime(source, (1, 1))
    assert installation.run().hits == 1
    for source in installation.kernels.iterdir():
        os.utime(source)
    assert installation.run().hits == 1


def test_the_folder_can_be_chosen(installation, tmp_path) -> None:
    installation.environment["NUMBA_CACHE_DIR"] = str(tmp_path / "numba")
    run = installation.run()
    assert Path(run.folder).is_relative_to(tmp_path / "numba")
    assert installation.files() == []
    assert installation.run().hits == 1


@pytest.mark.parametrize("home", ["a file", "no home"])
def test_without_a_folder_to_write_to_one_line_says_so(installation, tmp_path, home) -> None:
    if home == "a file":
        (tmp_path / "file").touch()
        installation.environment["XDG_CACHE_HOME"] = str(tmp_path / "file" / "cache")
    else:  # a user without an entry in the password file
        del installation.environment["XDG_CACHE_HOME"], installation.environment["HOME"]
        startup = installation.kernels.parents[1] / "sitecustomize.py"
        startup.write_text("import pwd\npwd.getpwuid = {}.__getitem__\n")
    for _ in range(2):
        run = installation.run()
        assert (run.value, run.hits) == (501.0, 0)
        assert run.said.startswith("the compiled solver cannot be kept")
        assert "NUMBA_CACHE_DIR" in run.said
        assert run.said.count("\n") == 1
    assert not list(tmp_path.glob("~*"))


def test_a_full_disk_leaves_nothing_half_written(installation) -> None:
    def full() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))

    run = installation.run(preexec_fn=full)
    assert run.value == 501.0
    assert run.said.count("\n") == 1
    assert installation.files() == []


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",
        lambda content: content[:-1],
        lambda content: content[:-200] + bytes(100) + content[-100:],
    ],
)
def test_a_file_that_was_cut_short_is_compiled_and_written_anew(
    installation, damage: Callable[[bytes], bytes]
) -> None:
    installation.run()
    assert len(installation.files()) == 2
    for path in installation.files():
        path.write_bytes(damage(path.read_bytes()))
    damaged, mended = installation.run(), installation.run()
    assert (damaged.value, damaged.hits) == (501.0, 0)
    assert (mended.value, mended.hits) == (501.0, 1)


def test_first_starts_at_the_same_time_do_not_disturb_each_other(installation) -> None:
    for run in [finished(process) for process in [installation.start() for _ in range(3)]]:
        assert run.value == 501.0
        assert run.said == ""
    assert len(installation.files()) == 2
    assert installation.run().hits == 1


def test_of_many_versions_the_oldest_are_deleted(installation) -> None:
    versions = installation.cache / "hma_gripper_sim"
    for age in range(12):
        (versions / f"version_{age}").mkdir(parents=True)
        os.utime(versions / f"version_{age}", (1e9 - age, 1e9 - age))
    (versions / "version_3" / "kernel").touch()
    os.utime(versions / "version_3", (1e9 - 3, 1e9 - 3))
    run = installation.run()
    assert {path.name for path in versions.iterdir()} == {
        Path(run.folder).name, *(f"version_{age}" for age in range(7))
    }  # fmt: skip
