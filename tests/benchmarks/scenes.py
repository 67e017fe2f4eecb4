"""The benchmark scenes as renderer-independent data: nested dicts of arrays, in ``.npz`` with ``scene/...`` keys.

The format is the one that `tests.peer_scenes.load` reads. Each scene has a parameter theta (a rigid motion or a
scale), so that the derivative image can be compared as well.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Neutral = dict[str, Any]
F64 = NDArray[np.float64]


def look_at(origin: ArrayLike, target: ArrayLike = (0.0, 0.0, 0.0)) -> F64:
    """(4, 4) camera-to-world transform of a camera that looks down its -Z, with +Y up."""
    position, aim = np.asarray(origin, float), np.asarray(target, float)
    back = (position - aim) / np.linalg.norm(position - aim)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, position], axis=1)
    return pose


def subdivided_sphere(cuts: int, bump: float = 0.0) -> Neutral:
    """Unit sphere of 20 cuts² triangles (a subdivided icosahedron), its radius modulated by up to about 1.25 bump."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0],
                        [0, -1, golden], [0, 1, golden], [0, -1, -golden], [0, 1, -golden],
                        [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1]])
    faces = np.array([[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
                      [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8],
                      [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]])
    grid = [(i, j) for i in range(cuts + 1) for j in range(cuts + 1 - i)]
    index = {node: k for k, node in enumerate(grid)}
    cells = [(index[i, j], index[i + 1, j], index[i, j + 1]) for i, j in grid if i + j < cuts]
    cells += [(index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]) for i, j in grid if i + j < cuts - 1]
    weights = np.array([(cuts - i - j, i, j) for i, j in grid]) / cuts
    points = np.einsum("kc,fcd->fkd", weights, corners[faces]).reshape(-1, 3)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    triangles = (np.array(cells)[None] + (np.arange(20) * len(grid))[:, None, None]).reshape(-1, 3)
    # Neighbouring icosahedron faces share the nodes on their common edge.
    _, first, welded = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    points, triangles = points[first], welded.reshape(-1)[triangles]
    x, y, z = points.T
    coarse = np.sin(7 * x) * np.sin(6 * y + 1) * np.sin(5 * z + 2)
    fine = np.sin(31 * x) * np.sin(29 * y) * np.sin(27 * z)
    return {"vertices": points * (1 + bump * (coarse + 0.25 * fine))[:, None], "faces": triangles}


def box(half: ArrayLike, degrees: float) -> Neutral:
    """A box around the origin with outward normals, turned about +Y."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [f for p, q, r, t in quads for f in ([p, q, r], [p, r, t])]
    return {"vertices": (signs * half) @ turn.T, "faces": np.array(faces)}


def _diffuse(geometry: Neutral, reflectance: ArrayLike, emission: ArrayLike | None = None) -> Neutral:
    bsdf = {"type": "diffuse", "reflectance": np.asarray(reflectance, float)}
    return geometry | {"bsdf": bsdf} | ({} if emission is None else {"emission": np.asarray(emission, float)})


def _scene(name: str, meshes: list[Neutral], lights: list[Neutral], parameter: Neutral, eye: ArrayLike) -> Neutral:
    camera = {"to_world": look_at(eye), "fov_x": 40.0, "width": 128, "height": 128}
    return {"name": name, "max_depth": 2, "camera": camera, "meshes": meshes, "lights": lights,
            "parameter": parameter}


_WHITE = {"type": "constant", "radiance": np.ones(3)}


def crease() -> Neutral:
    """A flat-shaded box that turns in front of an area light: derivatives on edges between two visible faces."""
    light = {"vertices": np.array([[1, -1, 6], [-1, -1, 6], [-1, 1, 6], [1, 1, 6]], float),
             "faces": np.array([[0, 1, 2], [0, 2, 3]])}
    turn = {"kind": "rotate", "meshes": np.array([0]), "axis": np.array([0.0, 1, 0]), "center": np.zeros(3),
            "eps": 0.0015}
    return _scene("crease", [_diffuse(box((0.7, 0.6, 0.5), 30), (0.5, 0.5, 0.5)),
                             _diffuse(light, (0, 0, 0), (12, 12, 12))], [], turn, (0, 1.2, 4))


def sphere_env() -> Neutral:
    """A flat-shaded sphere of 5,120 triangles that grows in a constant environment."""
    grow = {"kind": "scale", "meshes": np.array([0]), "center": np.zeros(3), "eps": 0.0015}
    return _scene("sphere_env", [_diffuse(subdivided_sphere(16), (0.4, 0.5, 0.6))], [_WHITE], grow, (0, 0, 4))


def dense_200k() -> Neutral:
    """A displaced sphere of 200,000 triangles that shifts in a constant environment."""
    shift = {"kind": "translate", "meshes": np.array([0]), "direction": np.array([1, 0.5, 0]), "eps": 0.0015}
    bumpy = _diffuse(subdivided_sphere(100, bump=0.12), (0.5, 0.5, 0.5))
    return _scene("dense_200k", [bumpy], [_WHITE], shift, (0, 0, 4))


SCENES: dict[str, Callable[[], Neutral]] = {"crease": crease, "sphere_env": sphere_env, "dense_200k": dense_200k}


def flatten(value: Any, path: str = "") -> dict[str, NDArray[Any]]:
    """{"meshes/0/vertices": array, ...} of nested dicts and lists."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        nested = [flatten(v, f"{path}/{k}" if path else str(k)) for k, v in items]
        return {k: v for part in nested for k, v in part.items()}
    return {path: np.asarray(value)}


def save(path: Path, scene: Neutral) -> None:
    """Write a scene as ``.npz``."""
    arrays: dict[str, Any] = {f"scene/{k}": v for k, v in flatten(scene).items()}
    np.savez(path, **arrays)
