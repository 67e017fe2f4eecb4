"""Malformed calls: a valid call of each public function, and a valid object of each public class, with one value wrong.

`python -m tests.torture.malformed` makes all of them, in processes of their own, and counts what happened. The rule:
each gives a result, or a `ValueError`, `TypeError` or `OSError` whose text names what is wrong.
"""

from __future__ import annotations

import argparse
import collections
import faulthandler
import fractions
import json
import resource
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import edgegrad
from edgegrad import expression
from edgegrad.scene import parameters
from tests.torture.malformed_files import broken_files, read
from tests.torture.malformed_stores import STORES, broken_stores
from tests.torture.malformed_stores import read as read_store
from tests.torture.valid import NAMES, Call, nodes, valid_calls, valid_scene

SECONDS, MEMORY = 30, 8 << 30


class Odd:
    """An object that no check knows, whose words are those of a text."""

    def __repr__(self) -> str:
        return "<odd>" * 1000


class Failing:
    """An object that fails when numpy asks for its numbers."""

    def __array__(self, *arguments: Any, **options: Any) -> Any:
        raise RuntimeError("no numbers here")


def _ring() -> list[Any]:
    ring: list[Any] = []
    ring.append(ring)
    return ring


# Name to a function that makes the value anew: some are used up by being read.
BAD: dict[str, Callable[[], Any]] = {
    "None": lambda: None, "True": lambda: True, "False": lambda: False, "np.bool_": lambda: np.bool_(True),
    "0": lambda: 0, "1": lambda: 1, "2": lambda: 2, "3": lambda: 3, "5": lambda: 5, "-1": lambda: -1,
    "0.0": lambda: 0.0, "0.5": lambda: 0.5, "2.5": lambda: 2.5, "-0.5": lambda: -0.5,
    "2**31": lambda: 2**31, "2**32": lambda: 2**32, "2**63": lambda: 2**63, "2**64": lambda: 2**64,
    "10**400": lambda: 10**400, "10**5000": lambda: 10**5000, "-10**400": lambda: -(10**400),
    "nan": lambda: float("nan"), "inf": lambda: float("inf"), "-inf": lambda: float("-inf"),
    "1e-320": lambda: 1e-320, "complex": lambda: 1j, "np.complex": lambda: np.complex128(1.0),
    "float16": lambda: np.float16(0.5), "longdouble": lambda: np.longdouble(0.5), "int8": lambda: np.int8(1),
    "uint64": lambda: np.uint64(2**63), "Fraction": lambda: fractions.Fraction(1, 3),
    "datetime": lambda: np.datetime64("2020-01-01"),
    "''": lambda: "", "'7'": lambda: "7", "'0.5'": lambda: "0.5", "'no'": lambda: "no", "'clay'": lambda: "clay",
    "long text": lambda: "x" * 100_000, "NUL": lambda: "a\0b", "surrogate": lambda: "\ud800", "bytes": lambda: b"clay",
    "[]": list, "()": tuple, "{}": dict, "set()": set, "frozenset": frozenset,
    "[None]": lambda: [None], "['']": lambda: [""], "['clay']": lambda: ["clay"], "[5]": lambda: [5],
    "['camera', 5]": lambda: ["camera", 5], "[[]]": lambda: [[]],
    "{'a': 1}": lambda: {"a": 1}, "{1: 2}": lambda: {1: 2},
    "{'x': None}": lambda: {"x": None}, "ring": _ring, "ragged": lambda: [[1.0], [1.0, 2.0]],
    "one more axis": lambda: np.zeros((1, 4, 4, 3)),
    "(1, 1, 1, 1)": lambda: (1, 1, 1, 1), "(0.5, 0.5)": lambda: (0.5, 0.5), "('a', 'b')": lambda: ("a", "b"),
    "[10**400] * 3": lambda: [10**400] * 3, "['1', '2', '3']": lambda: ["1", "2", "3"], "range": lambda: range(3),
    "generator": lambda: (x for x in (1.0, 2.0, 3.0)), "lambda": lambda: lambda *a, **k: None,
    "class": lambda: dict, "module": lambda: sys,
    "Ellipsis": lambda: Ellipsis,
    "slice": lambda: slice(None), "Odd": Odd, "Failing": Failing, "object": object,
    "0-d": lambda: np.array(0.5), "0-d object": lambda: np.array(None), "empty": lambda: np.zeros(0),
    "(0, 3)": lambda: np.zeros((0, 3)), "(1,)": lambda: np.zeros(1), "(3,)": lambda: np.full(3, 0.5),
    "(3,) nan": lambda: np.full(3, np.nan), "(3,) complex": lambda: np.full(3, 0.5j),
    "(3,) bool": lambda: np.ones(3, bool),
    "(3,) object": lambda: np.array([0.5, None, 1.0], object),
    "(3,) masked": lambda: np.ma.array([1.0] * 3, mask=[0, 1, 0]),
    "(3,) text": lambda: np.array(["0.5"] * 3), "(3,) records": lambda: np.zeros(3, [("a", float)]),
    "(3, 3)": lambda: np.eye(3), "(4, 4) zeros": lambda: np.zeros((4, 4)), "(4, 4) sheared": lambda: np.tri(4),
    "(2, 3, 4)": lambda: np.zeros((2, 3, 4)), "(4, 4, 3) uint8": lambda: np.full((4, 4, 3), 200, np.uint8),
    "(4, 4, 3) nan": lambda: np.full((4, 4, 3), np.nan), "32-d": lambda: np.zeros((1,) * 32),
    "a scene": lambda: edgegrad.Scene(None), "a material": edgegrad.Material,  # type: ignore[arg-type]
    "an expression": lambda: expression.Backfacing(), "a camera": lambda: edgegrad.Camera(np.zeros((4, 4))),
    "a lamp": lambda: edgegrad.PointLight(np.zeros(3)), "bounces": edgegrad.Bounces,
}  # fmt: skip


def forms(value: np.ndarray) -> dict[str, Any]:
    """The same numbers in other forms: each must give the same result, or be refused."""
    out: dict[str, Any] = {
        "list": value.tolist(), "big-endian": value.astype(value.dtype.newbyteorder(">")),
        "Fortran": np.asfortranarray(value), "read-only": value.copy(), "longdouble": value.astype(np.longdouble),
        "object": value.astype(object), "nothing masked": np.ma.array(value), "complex": value.astype(complex),
        "text": value.astype(str), "strided": np.repeat(value, 2, axis=-1)[..., ::2] if value.ndim else value,
        "reversed": np.ascontiguousarray(value[::-1])[::-1] if value.ndim else value,
        "float64": value.astype(np.float64),
    }  # fmt: skip
    out["read-only"].setflags(write=False)
    if value.ndim == 2:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PendingDeprecationWarning)  # of `np.matrix` itself
            out["matrix"] = np.asmatrix(value)
    if value.dtype.kind == "i":
        out |= {"uint64": value.astype(np.uint64), "2**32 more": value.astype(np.int64) + 2**32,
                "2**63 more": value.astype(np.uint64) + np.uint64(2**63), "a half more": value + 0.5,
                "2**31 more": value.astype(np.int64) + 2**31}  # fmt: skip
    return out


@dataclass
class Case:
    """A call with one wrong value.

    Attributes
    ----------
    what
        "function(argument): value" or "Class.field: value".
    run
        Makes the call; returns what it gives.
    names
        Words of which the text of an error must contain one.
    same
        What the result must equal, where the value is a valid one in another form.
    """

    what: str
    run: Callable[[], Any]
    names: tuple[str, ...]
    same: Callable[[], Any] | None = None


def cases() -> Iterator[Case]:
    """All malformed calls, always in the same order."""
    for call in valid_calls():
        for argument, value in call.arguments().items():
            what, names = f"{call.name}({argument})", (argument, *NAMES.get(argument, ()))
            yield from (Case(f"{what}: {word}", partial(with_argument, call, argument, make), names)
                        for word, make in BAD.items())
            if isinstance(value, np.ndarray):
                yield from (Case(f"{what}: {word}",
                                 partial(with_argument, call, argument, partial(other_form, value, word)),
                                 names, partial(call.run, {})) for word in forms(value))
    for path, held in objects(valid_scene()).items():
        for f in fields(held):
            what, names = f"{path}.{f.name}", (f.name, *NAMES.get(f.name, ()))
            yield from (Case(f"{what}: {word}", partial(with_field, path, f.name, make), names)
                        for word, make in BAD.items())
            value = getattr(held, f.name)
            if isinstance(value, np.ndarray):
                yield from (Case(f"{what}: {word}", partial(with_field, path, f.name, partial(other_form, value, word)),
                                 names, picture) for word in forms(value))
        yield Case(f"{path}: misspelt", partial(misspelt, path), ("rougness",))
    for name, (kind, options) in nodes().items():
        for argument in options:
            yield from (Case(f"{name}({argument}): {word}", partial(with_node, kind, options, argument, make),
                             (argument, "textures")) for word, make in BAD.items())


def file_cases() -> Iterator[Case]:
    """All broken pictures, checkpoints and calibrations; the error names the file."""
    for what, data in broken_files():
        yield Case(what, partial(read, what, data), (what.split(":")[0],))
    for what, kind, contents in broken_stores():
        yield Case(what, partial(read_store, kind, contents), STORES[kind])


def objects(scene: edgegrad.Scene) -> dict[str, Any]:
    """Every object of a scene by its path, the scene too."""
    out: dict[str, Any] = {"scene": scene, "camera": scene.camera, "world": scene.world}
    for collection in parameters.COLLECTIONS:
        out |= {f"{collection}.{name}": held for name, held in getattr(scene, collection).items()}
    return out


def other_form(value: np.ndarray, word: str) -> Any:
    return forms(value)[word]


def picture(scene: edgegrad.Scene | None = None) -> Any:
    return edgegrad.render(valid_scene() if scene is None else scene, 1, threads=1, max_depth=3)


def with_argument(call: Call, argument: str, make: Callable[[], Any]) -> Any:
    return call.run({argument: make()})


def with_field(path: str, name: str, make: Callable[[], Any]) -> Any:
    scene = valid_scene()
    setattr(objects(scene)[path], name, make())
    return picture(scene)


def misspelt(path: str) -> Any:
    objects(valid_scene())[path].rougness = 0.1


def with_node(kind: type, options: dict[str, Any], argument: str, make: Callable[[], Any]) -> Any:
    scene = valid_scene()
    paint = scene.materials["paint"]
    assert isinstance(paint, edgegrad.Material)
    paint.textures = {"base_color": kind(**{**options, argument: make()})}
    return picture(scene)


def outcome(case: Case) -> str:
    """Return "right", "refused", or a description of the error."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", PendingDeprecationWarning)  # of `np.matrix`
        warnings.filterwarnings("ignore", "fit: no gradient")  # of a picture without light that moves
        try:
            result = case.run()
        except AttributeError as error:
            return "refused" if case.what.endswith("misspelt") else f"traceback: AttributeError: {error}"[:300]
        except (ValueError, TypeError, OSError) as error:
            text = str(error)
            if not any(name in text for name in case.names):
                return f"unnamed: {type(error).__name__}: {text}"[:300]
            return "refused" if len(text) < 700 else f"long: {len(text)} characters: {text[:200]}"
        except Exception as error:
            return f"traceback: {type(error).__name__}: {error}"[:300]
    if case.what.endswith("misspelt"):
        return "silent: a misspelt field"
    if told:
        return f"warned: {told[0].category.__name__}: {told[0].message}"[:300]
    if case.same is not None and not equal(result, case.same()):
        return "wrong: another result than the same numbers in their usual form"
    return "right"


def equal(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(equal(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b, equal_nan=True)
    return True


def _work(files: bool, first: int, step: int) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for number, case in enumerate(file_cases() if files else cases()):
        if number < first or number % step:
            continue
        print(json.dumps([number, case.what, "begun"]), flush=True)
        faulthandler.dump_traceback_later(SECONDS, exit=True)
        print(json.dumps([number, case.what, outcome(case)]), flush=True)
        faulthandler.cancel_dump_traceback_later()


def run_all(step: int = 1, *, files: bool = False) -> dict[str, str]:
    """What became of each malformed call or file (every `step`-th of them); crashes and hangs are outcomes too."""
    found: dict[str, str] = {}
    first = 0
    while True:
        command = [sys.executable, "-m", "tests.torture.malformed",
                   "--worker", str(first), "--step", str(step), *(["--files"] if files else [])]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
        last = None
        for line in done.stdout.splitlines():
            if line.startswith("["):
                last = json.loads(line)
                found[last[1]] = last[2]
        if last is None or last[2] != "begun":
            if done.returncode:
                raise RuntimeError(done.stderr[-3000:])
            return found
        found[last[1]] = f"crashed or hung: exit code {done.returncode}"
        first = last[0] + 1


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--files", action="store_true", help="broken picture files instead of malformed calls")
    parser.add_argument("--step", type=int, default=1, help="make every STEP-th call only")
    parser.add_argument("--output", help="a JSON file for what became of each call")
    chosen = parser.parse_args()
    if chosen.worker is not None:
        _work(chosen.files, chosen.worker, chosen.step)
        return
    found = run_all(chosen.step, files=chosen.files)
    if chosen.output:
        Path(chosen.output).write_text(json.dumps(found, indent=0))
    for kind, count in collections.Counter(text.split(":")[0] for text in found.values()).most_common():
        print(f"{count:6} {kind}")


if __name__ == "__main__":
    main()
