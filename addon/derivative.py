"""The derivative picture of one of Blender's values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from .export import export_scene
from .export.scene import Export
from .parameters import Names

DIRECTIONS = ("NORMAL", "X", "Y", "Z")


def derivative_picture(context: Any, names: Names, direction: str, samples: int, camera: Any = None, seed: int = 0,
                       progress: Any = None) -> tuple[NDArray[np.float32], Export]:  # fmt: skip
    """How the picture changes when one value grows.

    Parameters
    ----------
    names
        The value or values; they grow together, each by 1 per unit (vertices: by 1 m).
    direction
        Where vertices move: "NORMAL" outwards along their normals, or along a world axis "X", "Y", "Z".
    samples
        Per pixel.

    Returns
    -------
    (H, W, 3) float32 and the export.
    """
    names.check_objects(context.evaluated_depsgraph_get(), in_place=True)
    export = export_scene(context.scene, context.evaluated_depsgraph_get(), camera)
    scene = export.scene
    tangent = {}
    for path in names.paths(export):
        collection, _, rest = path.partition(".")
        name, _, fieldname = rest.rpartition(".")
        if fieldname == "vertices":
            mesh = scene.meshes[name]
            tangent[path] = _normals(mesh) if direction == "NORMAL" else _along(direction, len(mesh.vertices))
        else:
            tangent[path] = np.ones(np.shape(getattr(getattr(scene, collection)[name], fieldname)))
    return edgegrad.render_forward(scene, tangent, spp=samples, seed=seed, progress=progress), export


def _along(direction: str, count: int) -> NDArray[np.float64]:
    out = np.zeros((count, 3))
    out[:, "XYZ".index(direction)] = 1.0
    return out


def _normals(mesh: edgegrad.Mesh) -> NDArray[np.float64]:
    """(n, 3) unit normals, faces weighted by area; zero for vertices without faces."""
    corners = mesh.vertices[mesh.faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    out = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(out, mesh.faces[:, k], cross)
    length = np.linalg.norm(out, axis=1)[:, None]
    return np.divide(out, length, out=np.zeros_like(out), where=length > 0.0)
