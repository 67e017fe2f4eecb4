"""A scene of the comparison: its builder, its depth and samples, and its known differences."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import bpy

Builder = Callable[[], None]


@dataclass(frozen=True)
class Case:
    """A scene of the comparison.

    Attributes
    ----------
    name, title
        Key, and what it shows in a few words.
    feature
        What its family is about: the module's name.
    build
        Makes it in an empty scene.
    bounces
        Cycles' max_bounces, and the limit of every kind of bounce that `limits` doesn't name.
    limits
        Limits of kinds of bounces, and other settings of Cycles, by their names: "diffuse_bounces", "glossy_bounces",
        "transmission_bounces", "blur_glossy" (0 in scenes that don't name it).
    samples
        Per pixel and seed, for Cycles; Edgegrad takes as many.
    differs
        Reasons for which the two pictures are known not to be the same; empty: they must agree.
    source
        Code of the builder and of what builders share, as it was when they were imported.
    """

    name: str
    title: str
    build: Builder
    bounces: int
    samples: int
    differs: tuple[str, ...]
    limits: Mapping[str, float]
    source: str
    feature: str

    def fingerprint(self, *settings: object) -> str:
        """Hash of what decides Cycles' picture: the builder, what builders share, settings, Blender's version."""
        limits = (self.bounces, *sorted(self.limits.items()))
        parts = [self.source, self.name, bpy.app.version_string, repr((*limits, *settings))]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


CASES: dict[str, Case] = {}


@cache
def _parts(file: Path) -> list[tuple[str | None, str]]:
    """A module's parts without comments and layout, those of cases without their decorator; a case's has its name."""
    found: list[tuple[str | None, str]] = []
    for part in ast.parse(file.read_text()).body:
        name = None
        if isinstance(part, ast.FunctionDef) and part.decorator_list:
            name, part.decorator_list = part.name, []
        found.append((name, ast.dump(part)))
    return found


def _code(file: Path, name: str = "") -> str:
    """A module's code without comments and layout; of its cases only the one of that name, without its decorator."""
    return "\n".join(code for of_case, code in _parts(file) if of_case in (None, name))


@cache
def _shared(family: Path) -> str:
    """Code that the builders of a family share: its module's, and that of the modules it imports from these folders."""
    relative = (part for part in ast.parse(family.read_text()).body if isinstance(part, ast.ImportFrom) and part.level)
    found = {family.parents[part.level - 1] / f"{name}.py" for part in relative
             for name in ([part.module] if part.module else [one.name for one in part.names])}  # fmt: skip
    imported = (file for file in sorted(found) if file != Path(__file__))
    return "\n".join([_code(family), *map(_shared, imported)])


def _feature(family: Path) -> str:
    """What a family is about, in words: "lamp settings", "as found: lights"."""
    folders = family.relative_to(Path(__file__).parent).with_suffix("").parts
    return ": ".join(folders).replace("_", " ")


def case(
    title: str, *, bounces: int = 3, samples: int = 48, differs: Sequence[str] = (), **limits: float
) -> Callable[[Builder], Builder]:
    """Register the decorated builder under its own name."""

    def register(build: Builder) -> Builder:
        name = build.__name__
        family = Path(build.__code__.co_filename)
        source = _shared(family) + _code(family, name)
        CASES[name] = Case(name, title, build, bounces, samples, tuple(differs), limits, source, _feature(family))
        return build

    return register
