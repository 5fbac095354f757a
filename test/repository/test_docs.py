"""What the documentation shows works; `test/node/test_documentation.py` has what needs a node."""

from __future__ import annotations

import re
import shutil

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
