"""What the documentation shows works; `test/node/test_documentation.py` has what needs a node."""

from __future__ import annotations

import ast
import re
import shutil
from functools import cache

import pytest
from documentation import PAGES, ROOT, SNIPPETS


@pytest.mark.parametrize(
    "code", [pytest.param(s.code, id=s.name) for s in SNIPPETS if not s.uses_ros]
)
def test_python_in_the_documentation_runs(code, tmp_path, monkeypatch, capsys):
    """Its files are there: a log of the node, and the map of its signals."""
    shutil.copytree(ROOT / "test" / "data" / "golden" / "box", tmp_path / "box_1")
    shutil.copy(ROOT / "config" / "signal_maps" / "sim_node.yaml", tmp_path / "my_arm.yaml")
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    assert capsys.readouterr().out


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_of_the_documentation_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text()):
        assert (page.parent / link).exists(), link


FILE = re.compile(r"`([\w*]+/[\w/*.]+\.(?:py|json|yaml|toml|xml))`")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_the_documentation_names_are_there(page):
    """Relative to the repository, to the package or to its rooms."""
    for name in FILE.findall(page.read_text()):
        places = (ROOT, ROOT / "hma_gripper_sim", ROOT / "docs")
        assert any([*place.glob(name)] for place in places), name


@cache
def names_in_the_code():
    """Functions, classes, fields, arguments and variables."""
    found = set()
    for path in (ROOT / "hma_gripper_sim").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            found |= {
                name
                for attribute in ("name", "arg", "id", "attr")
                if isinstance(name := getattr(node, attribute, None), str)
            }
    return found


def test_names_beside_those_of_textbooks_are_in_the_code():
    page = (ROOT / "docs" / "solver.md").read_text()
    table = page.partition("## Names in the code")[2].partition("\n## ")[0]
    rows = [row.split("|")[1] for row in table.splitlines() if row.startswith("| `")]
    names = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert len(names) > 30
    assert set(names) <= names_in_the_code()
