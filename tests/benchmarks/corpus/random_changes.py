"""A random change of a random parameter of a scene, for comparisons of derivatives with differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.scene import parameters
from edgegrad.scene.placement import placed_meshes

F64 = NDArray[np.float64]

# What is changed, and how often: shapes are what edges are about.
_KINDS = {"meshes.transform": 3, "meshes.vertices": 2, "meshes.": 1, "materials.": 3, "lights.": 2, "camera.": 2,
          "world.": 1, "images.": 1, "fields.": 2}  # fmt: skip
MOST_NUMBERS = 400_000
# Numbers change by up to this factor, and zeros to this value, so that one-sided limits keep clear of the interval.
_CLEAR = 0.06


@dataclass(frozen=True)
class Change:
    """A parameter as a function of theta, and the length of the interval of theta that a difference is taken over."""

    path: str
    value: Callable[[float], Any]
    interval: float


def rotation(axis: F64, angle: float) -> F64:
    """(3, 3) rotation about an axis, by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def changes(scene: edgegrad.Scene, rng: np.random.Generator) -> Iterator[Change]:
    """Yield changes in random order. Some of them may break a limit of their field."""
    paths = parameters.paths(scene)
    by_kind: dict[str, list[str]] = {kind: [] for kind in _KINDS}
    for path in paths:
        collection, _, field = parameters.split(path)
        kind = f"{collection}.{field}"
        by_kind[kind if kind in by_kind else f"{collection}."].append(path)
    while any(by_kind.values()):
        kinds = [kind for kind, found in by_kind.items() if found]
        odds = np.array([_KINDS[kind] for kind in kinds], np.float64)
        found = by_kind[kinds[int(rng.choice(len(kinds), p=odds / odds.sum()))]]
        change = _change(scene, found.pop(int(rng.integers(len(found)))), rng)
        if change is not None:
            yield change


def _change(scene: edgegrad.Scene, path: str, rng: np.random.Generator) -> Change | None:
    value = np.asarray(parameters.get(scene, path), np.float64)
    collection, name, field = parameters.split(path)
    if not 0 < value.size <= MOST_NUMBERS:
        return None
    if value.shape[-2:] == (4, 4):
        return Change(path, _rigid(scene, collection, name, value, rng), 0.02)
    if field == "vertices" or field.startswith("attributes."):
        return Change(path, _wave(value, rng), 0.02)
    if field in ("position", "center", "lower", "upper"):
        shift = rng.normal(size=value.shape)
        return Change(path, lambda theta: value + theta * shift, 0.02)
    axis = rng.normal(size=3)
    if value.shape == (3, 3):
        return Change(path, lambda theta: rotation(axis, theta) @ value, 0.05)
    if field == "direction":
        return Change(path, lambda theta: rotation(axis, theta) @ value, 0.05)
    rate = rng.uniform(0.5, 1.0, size=value.shape)
    rate = np.where(value == 0.0, -rate, value * rate)
    return Change(path, lambda theta: value + (theta - _CLEAR) * rate, 0.05)


def _rigid(
    scene: edgegrad.Scene, collection: str, name: str, value: F64, rng: np.random.Generator
) -> Callable[[float], F64]:
    """A placement, or many at once, turned and shifted in world space."""
    center, extent = value[..., :3, 3].reshape(-1, 3).mean(axis=0), 2.0
    turn, reach = (0.1, 0.3) if collection == "camera" else (0.5, 1.0)
    if collection == "meshes":
        for placed in (p for key, p in zip(scene.meshes, placed_meshes(scene), strict=True) if key == name):
            if len(placed.vertices):
                center = placed.vertices.mean(axis=0)
                extent = float(np.linalg.norm(np.ptp(placed.vertices, axis=0)))
    axis, shift = rng.normal(size=(2, 3))
    shift *= 0.5 * reach * extent / np.linalg.norm(shift)

    def at(theta: float) -> F64:
        turned = rotation(axis, turn * theta)
        out = value.copy()
        out[..., :3, :3] = turned @ value[..., :3, :3]
        out[..., :3, 3] = (value[..., :3, 3] - center) @ turned.T + center + theta * shift
        return out

    return at


def _wave(value: F64, rng: np.random.Generator) -> Callable[[float], F64]:
    """Points that a plane wave shifts, about as long as their box."""
    flat = value.reshape(len(value), -1)
    extent = float(np.linalg.norm(np.ptp(flat, axis=0))) or 1.0
    phase = flat @ (rng.normal(size=flat.shape[1]) * 4.0 / extent)
    shift = (np.sin(phase)[:, None] * rng.normal(size=flat.shape[1]) * 0.3 * extent).reshape(value.shape)
    return lambda theta: value + theta * shift
