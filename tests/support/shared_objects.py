"""Parts of scenes that modules of tests hold in common, and whether a test has changed one.

Scenes are mutable. A test that changes a camera or a mesh that other tests use, too, makes those depend on which tests
ran before them.
"""

from __future__ import annotations

import pickle
import sys
import zlib
from collections.abc import Iterator
from typing import Any

import edgegrad

SHARED = (
    edgegrad.AreaLight, edgegrad.Camera, edgegrad.Image, edgegrad.Material, edgegrad.Mesh, edgegrad.Mixture,
    edgegrad.PointLight, edgegrad.Scene, edgegrad.SpotLight, edgegrad.SunLight, edgegrad.World,
)  # fmt: skip


def fingerprints() -> dict[str, int]:
    """A checksum of every part of a scene that is a global of a module of tests, or in a global dict, list or tuple."""
    found = {}
    for name, module in list(sys.modules.items()):
        if not name.startswith("tests."):
            continue
        for variable, value in list(vars(module).items()):
            for path, part in _parts(f"{name}.{variable}", value):
                found[path] = zlib.crc32(pickle.dumps(part))
    return found


def changes(before: dict[str, int], now: dict[str, int]) -> list[str]:
    """Names of the parts whose checksums differ."""
    return [name for name, checksum in before.items() if name in now and now[name] != checksum]


def _parts(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, SHARED):
        yield path, value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _parts(f"{path}[{key!r}]", item)
    elif isinstance(value, (list, tuple)):
        for index, item in enumerate(value):
            yield from _parts(f"{path}[{index}]", item)
