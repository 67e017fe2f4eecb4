"""The derivative of a picture with respect to values of Blender's scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.fitting.variables import vertex_normals
from edgegrad.scene import parameters as values

from .differentiable import export_differentiable, not_computed
from .export import Export
from .parameters import Names, unit
from .preferences import threads

DIRECTIONS = ("NORMAL", "X", "Y", "Z")


def derivative_picture(context: Any, names: Names, direction: str, samples: int, camera: Any = None, seed: int = 0,
                       progress: Any = None) -> tuple[NDArray[np.float32], Export, list[str]]:  # fmt: skip
    """Render the derivative of the picture with respect to some values.

    Parameters
    ----------
    names
        The values. The derivative is along the direction in which each increases by 1 unit (vertices move by 1 m).
    direction
        Direction in which vertices move: "NORMAL", outwards along their normals, or a world axis "X", "Y" or "Z".
    samples
        Samples per pixel.

    Returns
    -------
    The derivative (H, W, 3) float32, the export, and sentences that name terms of the derivative which were not
    computed although they may be non-zero.
    """
    names.check_objects(context.scene, in_place=True)
    export = export_differentiable(context.scene, () if camera is None else (camera,))
    paths = names.paths(export)
    scene = export.scene
    tangent = {}
    for path in paths:
        value = values.get(scene, path)
        _, name, fieldname = values.split(path)
        if fieldname == "vertices":
            tangent[path] = _motion(scene.meshes[name], direction)
        else:
            tangent[path] = np.full(np.shape(value), unit(export, path))
    limits = export.settings
    picture = edgegrad.render_forward(scene, tangent, spp=samples, max_depth=limits.max_depth, bounces=limits.bounces,
                                      seed=seed, threads=threads(), progress=progress)  # fmt: skip
    return picture, export, not_computed(export, paths)


def _motion(mesh: edgegrad.Mesh, direction: str) -> NDArray[np.float64]:
    """(n, 3) motion of vertices, in mesh space, that equals 1 m in world space along their normals or an axis."""
    linear = mesh.transform[:3, :3]
    vertices = mesh.vertices @ linear.T
    if direction == "NORMAL":
        # A mirroring transform reverses the normals of the vertices in world space; outwards is the other direction.
        along = np.sign(np.linalg.det(linear)) * _normals(vertices, mesh.faces)
    else:
        along = np.zeros_like(vertices)
        along[:, "XYZ".index(direction)] = 1.0
    return along @ np.linalg.inv(linear).T


def _normals(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """(n, 3) unit vertex normals, area-weighted means over the faces; zero for vertices without faces."""
    return vertex_normals(vertices, faces, np.arange(len(vertices)))
