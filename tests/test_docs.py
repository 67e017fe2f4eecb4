"""The README and the documentation: their examples run, and their commands and options exist."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import edgegrad
from edgegrad import losses, optimisers, parameters

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
PAGES = sorted((ROOT / "docs").rglob("*.md"))
# Sizes and samples of the examples, and smaller ones for tests.
SMALLER = {"spp": 2, "iterations": 2, "width": 16, "height": 16, "measure": 1}


def fenced(page: Path, language: str) -> list[str]:
    """The page's code blocks in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)


def examples(page: Path) -> str:
    """The Python examples of a page as one program, with few samples and small pictures."""
    text = "\n".join(fenced(page, "python"))
    return re.sub(rf"\b({'|'.join(SMALLER)})=\d+", lambda found: f"{found[1]}={SMALLER[found[1]]}", text)


def run(page: Path, names: dict[str, Any]) -> None:
    exec(compile(examples(page), str(page), "exec"), names)


@pytest.mark.parametrize("page", [README, *(page for page in PAGES if fenced(page, "python"))],
                         ids=lambda page: str(page.relative_to(ROOT)))  # fmt: skip
def test_python_examples_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Examples of the documentation go on from that of the README."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    run(README, names)
    if page != README:
        run(page, names)


@pytest.mark.parametrize("page", [README, *PAGES], ids=lambda page: str(page.relative_to(ROOT)))
def test_named_files_and_targets_exist(page: Path) -> None:
    text = page.read_text()
    for link in re.findall(r"\]\(([^):#]+)(?:#[^)]*)?\)", text):
        assert (page.parent / link).exists(), f"there is no {link}"
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for target in re.findall(r"(?:`|^)make ([a-z-]+)", text, re.MULTILINE):
        assert target in targets, f"there is no make {target}"


def test_command_line_options() -> None:
    """The page of the command line names all options, and pages name none that doesn't exist."""
    pytest.importorskip("bpy")
    from edgegrad_addon.command_line import _parser

    (commands,) = (action for action in _parser()._actions if action.dest == "==SUPPRESS==" or action.choices)
    assert commands.choices is not None
    options = {
        name: {option for action in parser._actions for option in action.option_strings if option.startswith("--")}
        for name, parser in dict(commands.choices).items()
    }
    page = (ROOT / "docs" / "reference" / "command_line.md").read_text()
    named = set(re.findall(r"^\| `(--[a-z-]+)", page, re.MULTILINE))
    assert named == set().union(*options.values()) - {"--help"}
    for other in (README, *PAGES):
        text = other.read_text().replace("\\\n", " ")
        for command, rest in re.findall(r"edgegrad (fit|render|gradient) ([^`\n]*)", text):
            for option in re.findall(r"--[a-z-]+", rest):
                assert option in options[command], f"{other.name}: edgegrad {command} has no {option}"


def test_reference_has_all_public_names() -> None:
    """What users may call is described: the package's names, and those of its public modules."""
    pages = "\n".join(page.read_text() for page in (ROOT / "docs" / "reference").glob("*.md"))
    described = set(re.findall(r"^\.\. (?:auto\w+|data):: (?:\w+\.)*(\w+)$", pages, re.MULTILINE))
    assert {name for name in edgegrad.__all__ if not isinstance(getattr(edgegrad, name), ModuleType)} <= described
    for module in (losses, optimisers, parameters):
        public = {name for name, held in vars(module).items() if getattr(held, "__module__", "") == module.__name__}
        assert {name for name in public if not name.startswith("_")} <= described, module.__name__


def test_pages_are_listed() -> None:
    """Each page is in a table of contents, so that readers find it."""
    for page in PAGES:
        if page.name != "index.md":
            listed = fenced(page.parent / "index.md", "{toctree}")
            assert any(page.stem in block.split() for block in listed), page
