"""The derivative picture of one of Blender's values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.fitting.variables import vertex_normals
from edgegrad.scene import parameters as values

from .differentiable import export_differentiable, not_computed
from .export import Export
from .parameters import Names

DIRECTIONS = ("NORMAL", "X", "Y", "Z")


def derivative_picture(context: Any, names: Names, direction: str, samples: int, camera: Any = None, seed: int = 0,
                       progress: Any = None) -> tuple[NDArray[np.float32], Export, list[str]]:  # fmt: skip
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
    (H, W, 3) float32, the export, and what the picture leaves out though it may not be zero, in sentences.
    """
    names.check_objects(context.evaluated_depsgraph_get(), in_place=True)
    export = export_differentiable(context, camera)
    paths = names.paths(export)
    scene = export.scene
    tangent = {}
    for path in paths:
        value = values.get(scene, path)
        _, name, fieldname = values.split(path)
        if fieldname == "vertices":
            tangent[path] = _motion(scene.meshes[name], direction)
        else:
            tangent[path] = np.ones(np.shape(value))
    limits = export.settings
    picture = edgegrad.render_forward(scene, tangent, spp=samples, max_depth=limits.max_depth, bounces=limits.bounces,
                                      seed=seed, progress=progress)  # fmt: skip
    return picture, export, not_computed(export, paths)


def _motion(mesh: edgegrad.Mesh, direction: str) -> NDArray[np.float64]:
    """(n, 3) the motion of vertices, in their space, that is 1 m in the world along their normals or an axis."""
    linear = mesh.transform[:3, :3]
    vertices = mesh.vertices @ linear.T
    if direction == "NORMAL":
        # The front of the faces stays outside where the transform mirrors.
        along = np.sign(np.linalg.det(linear)) * _normals(vertices, mesh.faces)
    else:
        along = np.zeros_like(vertices)
        along[:, "XYZ".index(direction)] = 1.0
    return along @ np.linalg.inv(linear).T


def _normals(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(n, 3) unit normals, faces weighted by area; zero for vertices without faces."""
    return vertex_normals(vertices, faces, np.arange(len(vertices)))
