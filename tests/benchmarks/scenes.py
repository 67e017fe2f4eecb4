"""The benchmark scenes as renderer-independent data: nested dicts of arrays (format: `tests.support.peer_scenes`)."""

from __future__ import annotations

import copy
import pathlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.support import peer_scenes
from tests.support.shapes import displaced_sphere

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


