"""The benchmark scenes as renderer-independent data: nested dicts of arrays (format: `tests.support.peer_scenes`)."""

from __future__ import annotations

import copy
import pathlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.support import peer_scenes

Neutral = dict[str, Any]
F64 = NDArray[np.float64]

REFERENCES = pathlib.Path(__file__).parent.parent / "references"
# Built here: their files would be large.
BUILT = ("dense_200k", "cornell_box")


def names() -> list[str]:
    """All benchmark scenes."""
    return sorted(path.stem for path in REFERENCES.glob("*.npz")) + list(BUILT)


def neutral(name: str) -> Neutral:
    """A benchmark scene.

    Raises
    ------
    ValueError
        For an unknown name.
    """
    if name == "dense_200k":
        return dense_sphere(100)
    if name == "cornell_box":
        return cornell_box()
    if name not in names():
        raise ValueError(f"unknown scene '{name}'; there are {', '.join(names())}")
    return peer_scenes.read(REFERENCES / f"{name}.npz")[0]


def cornell_box() -> Neutral:
    """The Cornell box (36 triangles) at 256 x 256 pixels, paths of up to 8 segments."""
    scene = copy.deepcopy(neutral("cornell_albedo"))
    scene["camera"].update(width=256, height=256)
    return scene | {"name": "cornell_box", "max_depth": 8}


def dense_sphere(cuts: int) -> Neutral:
    """A displaced sphere of 20 cuts² triangles that shifts in a constant environment."""
    pose = np.eye(4)
    pose[2, 3] = 4.0
    view = {"to_world": pose, "fov_x": 40.0, "width": 128, "height": 128}
    bumpy = displaced_sphere(cuts, 0.12) | {"bsdf": {"type": "diffuse", "reflectance": np.full(3, 0.5)}}
    shift = {"kind": "translate", "meshes": np.array([0]), "direction": np.array([1, 0.5, 0]), "eps": 0.0015}
    return {"name": f"dense_{20 * cuts * cuts}", "max_depth": 2, "camera": view, "meshes": [bumpy],
            "lights": [{"type": "constant", "radiance": np.ones(3)}], "parameter": shift}


def displaced_sphere(cuts: int, bump: float) -> Neutral:
    """Unit sphere of 20 cuts² triangles (a subdivided icosahedron), its radius modulated by up to about 1.25 bump."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([[-1, golden, 0], [1, golden, 0], [-1, -golden, 0], [1, -golden, 0],
                        [0, -1, golden], [0, 1, golden], [0, -1, -golden], [0, 1, -golden],
                        [golden, 0, -1], [golden, 0, 1], [-golden, 0, -1], [-golden, 0, 1]])
    faces = np.array([[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4],
                      [11, 10, 2], [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8],
                      [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]])
    # Grid nodes (i, j), i + j <= cuts, of one face, row by row.
    i, j = (k.ravel() for k in np.meshgrid(np.arange(cuts + 1), np.arange(cuts + 1), indexing="ij"))
    i, j = i[i + j <= cuts], j[i + j <= cuts]

    def node(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
        return a * (cuts + 1) - a * (a - 1) // 2 + b

    up, down = i + j < cuts, i + j < cuts - 1
    cells = np.concatenate([
        np.stack([node(i, j), node(i + 1, j), node(i, j + 1)], axis=1)[up],
        np.stack([node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)], axis=1)[down],
    ])
    weights = np.stack([cuts - i - j, i, j], axis=1) / cuts
    points = np.einsum("kc,fcd->fkd", weights, corners[faces]).reshape(-1, 3)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    triangles = (cells[None] + (np.arange(20) * len(weights))[:, None, None]).reshape(-1, 3)
    # Neighbouring icosahedron faces share the nodes on their common edge: weld by position on a fine grid.
    key = np.round((points + 2.0) * 2.0**18).astype(np.int64) @ np.array([1, 1 << 21, 1 << 42])
    _, first, welded = np.unique(key, return_index=True, return_inverse=True)
    points, triangles = points[first], welded.reshape(-1)[triangles]
    x, y, z = points.T
    coarse = np.sin(7 * x) * np.sin(6 * y + 1) * np.sin(5 * z + 2)
    fine = np.sin(31 * x) * np.sin(29 * y) * np.sin(27 * z)
    return {"vertices": points * (1 + bump * (coarse + 0.25 * fine))[:, None], "faces": triangles}
