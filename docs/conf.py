"""Sphinx configuration; `make docs` builds the pages into build/docs."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

_DOCS = Path(__file__).resolve().parent
_PROJECT = tomllib.loads((_DOCS.parent / "pyproject.toml").read_text())["project"]

project = "Edgegrad"
author = "The Edgegrad developers"
project_copyright = author
version = release = _PROJECT["version"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"Edgegrad {version}"

# Docstrings: numpy's sections. `name` links to what is documented here, and is code where nothing is.
default_role = "py:obj"
napoleon_google_docstring = False
napoleon_use_ivar = True  # attributes are described in the class, not once more as members
napoleon_use_rtype = False
autodoc_default_options = {"members": True, "member-order": "bysource", "exclude-members": "checks"}
autodoc_typehints = "none"  # docstrings name shapes, units and ranges, which types don't
python_use_unqualified_type_names = True
maximum_signature_line_length = 88


def setup(app: Any) -> None:
    """Connect what follows to Sphinx."""
    app.connect("source-read", _link_files)


def _link_files(app: Any, page: str, source: list[str]) -> None:
    """Let links to Markdown outside of docs/ be links to files: MyST takes them for pages of its own."""
    folder = (_DOCS / page).parent

    def link(found: re.Match[str]) -> str:
        inside = (folder / found[1]).resolve().is_relative_to(_DOCS)
        return found[0] if inside else f"](path:{found[1]})"

    source[0] = re.sub(r"\]\(([^):#]+\.md)\)", link, source[0])
