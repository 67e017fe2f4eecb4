"""The derivative of a picture with respect to values of Blender's scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.fitting.vertices.variables import vertex_normals
from edgegrad.scene import parameters as values

from ..animated.driver import Driver
from ..animated.parameter import Wanted
from ..differentiable import export_differentiable, let_normals_follow, not_computed
from ..export import Export
from ..parameters import Names, unit
from ..preferences import threads
from ..problem import Problem

DIRECTIONS = ("NORMAL", "X", "Y", "Z")


@dataclass
class Derivative:
    """The derivative of the picture along a direction in which values of Blender's scene move.

    Attributes
    ----------
    export
        The exported scene.
    tangent
        Maps paths of the exported scene to the motion of their values.
    notes
        Sentences that name terms of the derivative which are not computed although they may be non-zero.
    """

    export: Export
    tangent: dict[str, NDArray[np.float64]]
    notes: list[str]

    def picture(self, samples: int, seed: int = 0, terms: Sequence[str] = edgegrad.TERMS,
                progress: Any = None) -> NDArray[np.float32]:  # fmt: skip
        """Render it, (H, W, 3), without access to Blender's data."""
        limits = self.export.settings
        return edgegrad.render_forward(self.export.scene, self.tangent, spp=samples, max_depth=limits.max_depth,
                                       bounces=limits.bounces, seed=seed, threads=threads(), terms=terms,
                                       progress=progress)  # fmt: skip


def derivative_of_names(context: Any, names: Names, direction: str, camera: Any = None) -> Derivative:
    """Prepare the derivative by values of meshes, materials and lights.

    Parameters
    ----------
    names
        The values. The derivative is along the direction in which each increases by 1 unit (vertices move by 1 m).
    direction
        Direction in which vertices move: "NORMAL", outwards along their normals, or a world axis "X", "Y" or "Z".
    """
    names.check_objects(context.scene, in_place=True)
    export = export_differentiable(context.scene, () if camera is None else (camera,))
    paths = names.paths(export)
    notes = let_normals_follow(export, paths)
    scene = export.scene
    tangent = {}
    for path in paths:
        value = values.get(scene, path)
        _, name, fieldname = values.split(path)
        if fieldname == "vertices":
            tangent[path] = _motion(scene.meshes[name], direction)
        else:
            tangent[path] = np.full(np.shape(value), unit(export, path))
    return Derivative(export, tangent, [*notes, *not_computed(export, paths)])


def derivative_of_properties(context: Any, wanted: Sequence[Wanted], direction: str,
                             camera: Any = None) -> Derivative:  # fmt: skip
    """Prepare the derivative by animatable properties.

    Parameters
    ----------
    direction
        "NORMAL": all their numbers increase by 1 unit; "X", "Y" or "Z": only the first, second or third of each.
    """
    driver = Driver(context.scene, [camera or context.scene.camera], wanted)
    start = {one.path: one.value for one in driver.variables}
    placement = driver.place(start)
    tangent: dict[str, NDArray[np.float64]] = {}
    for one in driver.parameters:
        for place, column in zip(one.places, placement.columns[one.path], strict=True):
            if direction != "NORMAL" and place.index != "XYZ".index(direction):
                continue
            for path, value in seen_by_first(column, placement).items():
                tangent[path] = tangent.get(path, 0.0) + value
    if not tangent:
        raise Problem(f"the picture does not change with number {direction} of the property; choose another direction")
    export = driver.export_at(start)
    return Derivative(export, tangent, [*driver.notes, *not_computed(export, list(tangent))])


def seen_by_first(column: Any, placement: Any) -> dict[str, NDArray[np.float64]]:
    """Return the part of a number's difference quotients that the driver's first camera sees."""
    return {path: value for (view, path), value in column.items() if view <= 0 and path in placement.paths[0]}


def derivative_picture(context: Any, names: Names, direction: str, samples: int, camera: Any = None, seed: int = 0,
                       progress: Any = None) -> tuple[NDArray[np.float32], Export, list[str]]:  # fmt: skip
    """Prepare and render the derivative by names; return it with the export and the notes."""
    found = derivative_of_names(context, names, direction, camera)
    return found.picture(samples, seed, progress=progress), found.export, found.notes


def _motion(mesh: edgegrad.Mesh, direction: str) -> NDArray[np.float64]:
    """(n, 3) motion of vertices, in mesh space, that equals 1 m in world space along their normals or an axis."""
    if direction == "NORMAL":
        along = outward_normals(mesh)
    else:
        along = np.zeros_like(mesh.vertices)
        along[:, "XYZ".index(direction)] = 1.0
    return along @ np.linalg.inv(mesh.transform[:3, :3]).T


def outward_normals(mesh: edgegrad.Mesh) -> NDArray[np.float64]:
    """(n, 3) world-space unit normals, area-weighted means over the faces; zero for vertices without faces."""
    linear = mesh.transform[:3, :3]
    vertices = mesh.vertices @ linear.T
    # A mirroring transform reverses the normals of the vertices in world space; outwards is the other direction.
    return np.sign(np.linalg.det(linear)) * vertex_normals(vertices, mesh.faces, np.arange(len(vertices)))
