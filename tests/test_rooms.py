"""The rooms of the house: what may know what.

Includes of `native/` and imports of `core/` and of `tests/` are read from the sources, those within functions and those
for type checkers too. They must go one way, from a room to the rooms below it, and never in a circle.
"""

from __future__ import annotations

import ast
import pathlib
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, partial

import pytest

ROOT = pathlib.Path(__file__).parents[1]

# Each room may include itself and those of earlier lines; rooms of one line don't know each other.
NATIVE = (
    ("simd", "util"),  # packets of numbers; threads and memory
    ("embree", "sampling"),  # the C interface of Embree; random numbers
    ("sdf",),  # distance fields: splines, bricks, rays
    ("scene",),  # tables and views of a scene, its BVH, its lights
    ("film", "tasks"),  # filters, which a scene's view holds; what engine and kernels agree on, which refers to views
    ("texture",),  # evaluates a view's programs for a surface
    ("shading",),
    ("path",),
    ("reparameterisation",),  # warps of the picture that carry outlines of fields with them
    ("adjoint",),  # path and shading code once more, on numbers that record derivatives
    ("boundary",),
    ("kernels",),
    ("engine",),
    ("python",),
)
# Folders within a room, in the same way.
WITHIN_NATIVE = {
    "boundary": (("meshes",), ("curves",), ("fields",), ("samples",), ("segment",), ("terms",), ("specular",),
                 ("caustics",)),
}
# Arrows against these directions that are still there: (file, what it includes). May only get fewer.
AGAINST_NATIVE: set[tuple[str, str]] = set()

PYTHON = (
    ("_native", "_check", "_fields", "progress"),  # the compiled module; checks of values; names of fields
    ("expression",),  # numbers of a scene may be expressions
    ("scene",),
    ("geometry", "images"),  # of a scene's meshes and cameras; files and derivatives as pictures
    ("distance_fields", "calibration"),  # made from meshes and made into meshes; cameras and pictures of trackers
    ("tables",),
    ("derivatives",),
    ("reference",),  # an engine, which the renderer chooses among others
    ("rendering",),
    ("planning",),
    ("fitting",),  # asks the plan what a fit cannot find
    ("edgegrad", "__main__"),  # the package's public names; its command line
)
AGAINST_PYTHON = {
    # The options of a call are those of all engines. They are in the room of the renderer that passes them on.
    ("reference.engine", "rendering.options"),
}

SOURCES = (".h", ".cpp", ".inc")
# A folder has one idea; more files than this are several.
MOST_FILES = 22
# Folders of more files that are still there. May only get smaller.
# A family of scenes is a file.
FULL = {"tests/benchmarks/cycles_scenes": 33}
BLENDER = ("bpy", "bmesh", "mathutils", "gpu", "blf", "aud", "bl_math", "freestyle", "idprop", "imbuf")
LONGEST = 400  # lines of a file

Arrows = dict[str, set[str]]


# ---------------------------------------------------------------- reading
@cache
def includes(folder: pathlib.Path) -> Arrows:
    """Which files of native/ include which others of it, by their paths below it."""
    found: Arrows = {}
    for path in sorted(p for p in folder.rglob("*") if p.suffix in SOURCES):
        name = path.relative_to(folder).as_posix()
        found[name] = set()
        for included in re.findall(r'^\s*#\s*include\s*"([^"]+)"', path.read_text(encoding="utf-8"), re.MULTILINE):
            assert (folder / included).exists(), f"{name} includes {included}, which is not a path below native/"
            found[name].add(included)
    return found


def modules(folder: pathlib.Path, package: str) -> dict[str, pathlib.Path]:
    """Files of a package by the names of their modules."""
    found = {}
    for path in sorted(folder.rglob("*.py")):
        parts = (package, *path.relative_to(folder).with_suffix("").parts)
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imported(path: pathlib.Path, module: str) -> tuple[str, ...]:
    """Dotted names that a module imports anywhere: modules, or names within them."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            origin = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            found += [f"{origin}.{alias.name}" for alias in node.names]
    return tuple(found)


@cache
def imports(folder: pathlib.Path, package: str) -> Arrows:
    """Which modules of a package import which others of it."""
    known = modules(folder, package)
    found: Arrows = {}
    for module, path in known.items():
        found[module] = set()
        for name in imported(path, module):
            if name.split(".")[0] != package:
                continue
            while name not in known and name != f"{package}._native":  # which is compiled
                name = name.rpartition(".")[0]
            found[module].add(name)
        found[module].discard(module)
    return found


# ---------------------------------------------------------------- rules
def levels(rooms: Iterable[tuple[str, ...]]) -> dict[str, int]:
    """The line on which each room stands."""
    return {room: level for level, line in enumerate(rooms) for room in line}


def against(arrows: Arrows, room_of: Mapping[str, str], level: Mapping[str, int]) -> set[tuple[str, str]]:
    """The arrows that don't go from a room to a lower one, or stay within it."""
    return {
        (one, other) for one, others in arrows.items() for other in others
        if room_of[one] != room_of[other] and level[room_of[one]] <= level[room_of[other]]
    }  # fmt: skip


def cycle(arrows: Mapping[str, Iterable[str]]) -> list[str]:
    """The nodes of one cycle, in order; empty if there is none."""
    done: set[str] = set()

    def follow(node: str, way: list[str]) -> list[str]:
        if node in way:
            return [*way[way.index(node) :], node]
        if node in done:
            return []
        for other in sorted(arrows.get(node, ())):
            if found := follow(other, [*way, node]):
                return found
        done.add(node)
        return []

    return next((found for node in sorted(arrows) if (found := follow(node, []))), [])


@dataclass(frozen=True)
class House:
    """The arrows between files, the room of each, the order of rooms, and arrows against it that are still there."""

    arrows: Arrows
    room_of: dict[str, str]
    rooms: tuple[tuple[str, ...], ...]
    exceptions: set[tuple[str, str]]


def native() -> House:
    arrows = includes(ROOT / "native")
    return House(arrows, {name: name.split("/")[0] for name in arrows}, NATIVE, AGAINST_NATIVE)


def within(room: str) -> House:
    """A room of native/ whose folders have an order."""
    arrows = {name: {other for other in others if other.startswith(f"{room}/")}
              for name, others in includes(ROOT / "native").items() if name.startswith(f"{room}/")}  # fmt: skip
    return House(arrows, {name: name.split("/")[1] for name in arrows}, WITHIN_NATIVE[room], set())


def python() -> House:
    short = {
        name.removeprefix("edgegrad."): {other.removeprefix("edgegrad.") for other in others}
        for name, others in imports(ROOT / "core", "edgegrad").items()
    }
    room_of = {name: name.split(".")[0] for name in [*short, "_native"]}
    # The compiled module is taken from the package itself, which is no arrow to its public names.
    return House(short, room_of, PYTHON, AGAINST_PYTHON)


HOUSES: dict[str, Callable[[], House]] = {
    "native": native, **{f"native/{room}": partial(within, room) for room in WITHIN_NATIVE}, "core": python,
}  # fmt: skip


@pytest.mark.parametrize("name", HOUSES)
def test_arrows_go_one_way(name: str) -> None:
    house = HOUSES[name]()
    level = levels(house.rooms)
    assert set(house.room_of.values()) == set(level), "a room without a place in the order, or a place without a room"
    wrong = against(house.arrows, house.room_of, level)
    assert not wrong - house.exceptions, f"against the direction: {sorted(wrong - house.exceptions)}"
    assert not house.exceptions - wrong, f"no longer there: take {sorted(house.exceptions - wrong)} from the list"


@pytest.mark.parametrize("name", HOUSES)
def test_nothing_goes_in_a_circle(name: str) -> None:
    house = HOUSES[name]()
    # Two exceptions could close a circle between files, which no list excuses.
    assert not cycle(house.arrows)
    between = defaultdict(set)
    for one, others in house.arrows.items():
        for other in others:
            if house.room_of[one] != house.room_of[other] and (one, other) not in house.exceptions:
                between[house.room_of[one]].add(house.room_of[other])
    assert not cycle(between)


def test_the_addon_has_no_circles() -> None:
    assert not cycle(imports(ROOT / "addon", "edgegrad_addon"))


def test_no_two_native_files_have_the_same_name() -> None:
    places = defaultdict(set)
    for path in (p for p in (ROOT / "native").rglob("*") if p.suffix in (".h", ".cpp")):
        places[path.stem].add(path.parent.relative_to(ROOT).as_posix())
    assert not {name: sorted(folders) for name, folders in places.items() if len(folders) > 1}


def test_folders_have_few_files() -> None:
    full = {}
    for top in ("native", "core", "addon", "tests"):
        for folder in [ROOT / top, *(p for p in (ROOT / top).rglob("*") if p.is_dir() and p.name != "__pycache__")]:
            files = [p for p in folder.iterdir() if p.suffix in (".h", ".cpp", ".py")]
            if len(files) > MOST_FILES:
                full[folder.relative_to(ROOT).as_posix()] = len(files)
    assert full == FULL


def test_only_the_addon_knows_blender() -> None:
    python_files = modules(ROOT / "core", "edgegrad")
    found = {module: sorted({name for name in imported(path, module) if name.split(".")[0] in BLENDER})
             for module, path in python_files.items()}  # fmt: skip
    assert not {module: names for module, names in found.items() if names}
    blender = re.compile(r"^\s*#\s*include\s*[\"<](BKE_|BLI_|DNA_|RNA_|MEM_guardedalloc|bpy)", re.MULTILINE)
    native_files = (p for p in (ROOT / "native").rglob("*") if p.suffix in (".h", ".cpp"))
    assert not [str(p) for p in native_files if blender.search(p.read_text(encoding="utf-8"))]


# ---------------------------------------------------------------- tests
def test_no_test_is_imported() -> None:
    """What tests share is in tests/support; benchmarks and stability take it from there, too."""
    wrong = {
        module: sorted(names) for module, path in modules(ROOT / "tests", "tests").items()
        if (names := {name for name in imported(path, module)
                      if name.startswith("tests.") and any(part.startswith("test_") for part in name.split("."))})
    }  # fmt: skip
    assert not wrong


def test_what_tests_share_knows_no_room_of_tests() -> None:
    arrows = imports(ROOT / "tests", "tests")
    wrong = {module: sorted(other for other in others if not other.startswith("tests.support"))
             for module, others in arrows.items() if module.startswith("tests.support")}  # fmt: skip
    assert not {module: others for module, others in wrong.items() if others}
    assert not cycle(arrows)


def test_files_are_short() -> None:
    lines = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8").count("\n")
             for room in ("addon", "core", "native", "tests", "docs", "blend_examples")
             for path in (ROOT / room).rglob("*") if path.suffix in (".py", ".h", ".cpp")}  # fmt: skip
    assert not {name: count for name, count in lines.items() if count > LONGEST}


# ---------------------------------------------------------------- the rules themselves
def test_arrows_against_the_direction_are_found() -> None:
    level = levels((("low",), ("one", "other"), ("high",)))
    room_of = {"a": "low", "b": "one", "c": "other", "d": "high", "e": "high"}
    arrows: Arrows = {"d": {"a", "b", "e"}, "a": {"b"}, "b": {"c"}, "c": {"a"}, "e": set()}
    assert against(arrows, room_of, level) == {("a", "b"), ("b", "c")}
    assert cycle(arrows) == ["a", "b", "c", "a"]
    assert cycle({"d": {"a"}, "a": set()}) == []


def test_every_form_of_import_is_read(tmp_path: pathlib.Path) -> None:
    (tmp_path / "room").mkdir()
    for name in ("__init__.py", "first.py", "room/__init__.py", "room/second.py", "room/third.py"):
        (tmp_path / name).write_text("")
    (tmp_path / "room/second.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from ..first import X\n"
        "def f():\n    import package.room.third as t\n    from package import _native\n"
    )
    (tmp_path / "room/third.py").write_text("from . import second\n")
    found = imports(tmp_path, "package")
    assert found["package.room.second"] == {"package.first", "package.room.third", "package._native"}
    assert found["package.room.third"] == {"package.room.second"}
    assert cycle(found) == ["package.room.second", "package.room.third", "package.room.second"]
