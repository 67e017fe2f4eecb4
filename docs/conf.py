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

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"Edgegrad {version}"

# `name` in a docstring links to what is documented here, and is code where nothing is.
default_role = "py:obj"
numpydoc_show_class_members = False  # autodoc lists them
autodoc_default_options = {"members": True, "member-order": "bysource", "exclude-members": "checks"}
autodoc_typehints = "none"  # docstrings name shapes, units and ranges, which types don't
python_use_unqualified_type_names = True
maximum_signature_line_length = 88


def setup(app: Any) -> None:
    """Connect what follows to Sphinx."""
    app.connect("source-read", _link_files)
    app.connect("autodoc-process-docstring", _join_returns, priority=400)  # numpydoc's is 500
    app.connect("autodoc-process-docstring", _escape_bars, priority=400)
    app.connect("autodoc-process-docstring", _without_docstring_of_tuple, priority=600)


def _link_files(app: Any, page: str, source: list[str]) -> None:
    """Let links to Markdown outside of docs/ be links to files: MyST takes them for pages of its own."""
    folder = (_DOCS / page).parent

    def link(found: re.Match[str]) -> str:
        inside = (folder / found[1]).resolve().is_relative_to(_DOCS)
        return found[0] if inside else f"](path:{found[1]})"

    source[0] = re.sub(r"\]\(([^):#]+\.md)\)", link, source[0])


def _join_returns(app: Any, what: str, name: str, held: Any, options: Any, lines: list[str]) -> None:
    """Write what a function returns as one line: numpydoc takes each line that is not indented for a value."""
    if "Returns" not in lines:
        return
    first = lines.index("Returns") + 2
    last = next((k for k in range(first, len(lines)) if not lines[k]), len(lines))
    lines[first:last] = [" ".join(line.strip() for line in lines[first:last])]


def _escape_bars(app: Any, what: str, name: str, held: Any, options: Any, lines: list[str]) -> None:
    """Keep |x|, an absolute value: reStructuredText takes it for a substitution."""
    lines[:] = [re.sub(r"\|([^|\s`]+)\|", r"\\|\1\\|", line) for line in lines]


def _without_docstring_of_tuple(app: Any, what: str, name: str, held: Any, options: Any, lines: list[str]) -> None:
    """A constant has no docstring of its own, and that of its type says nothing."""
    if what == "data" and isinstance(held, tuple):
        lines.clear()
