"""The API reference, from the docstrings: `make docs` builds it in build/docs."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

project = "hma_gripper_sim"
release = ET.parse(Path(__file__).parents[2] / "package.xml").findtext("version")
author = copyright = "hma_gripper_sim contributors"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
templates_path = ["templates"]
html_theme = "furo"
autodoc_default_options = {"members": True, "show-inheritance": True, "ignore-module-all": True}
autodoc_typehints = "description"
autosummary_generate = True
default_role = "code"  # names in docstrings stand in single backquotes
napoleon_google_docstring = False
napoleon_use_ivar = True
