"""Open surfaces whose displacement is rendered as bump, with lamps behind them.

In Cycles such a lamp lights the surface also from behind, through the surface, where the bent normal allows it. Worlds
and emissive meshes do not, and neither do lamps where the bump is that of a Bump node.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad.geometry import topology
from edgegrad.scene.placement import places

from ..exported import Export
from ..geometry.normals import unit

F64 = NDArray[np.float64]

# Places of a mesh, and faces of each, that are tested at most; and the sine of the angle below a face from which on
# hardly a bent normal faces a lamp.
MOST_PLACES, MOST_FACES, STEEPEST = 16, 256, 0.8


def warn_about_lit_through(out: Export) -> None:
    """Report open meshes with such a bump of which the camera sees faces that a lamp lies behind."""
    for name, mesh in out.scene.meshes.items():
        bumped = any(slot in out.materials and out.materials[slot].bumped for slot in mesh.used_materials)
        if not bumped or topology.is_closed(mesh.faces, topology.weld(mesh.vertices)):
            continue
        lamps = [key for key, light in out.scene.lights.items() if _behind(out.scene, mesh, light)]
        if lamps:
            titles = ", ".join(f"'{out.lights[key].object}'" for key in lamps if key in out.lights) or "the sky's sun"
            out.report.warn(f"object '{out.meshes[name].object}'", "is open, and its displacement is rendered as bump: "
                            f"lamps behind it ({titles}) light it through its faces in Cycles where the bump allows "
                            "it, and not here; use a Bump node")  # fmt: skip


def _behind(scene: edgegrad.Scene, mesh: edgegrad.Mesh, light: Any) -> bool:
    """Whether a lamp lies on the other side of some faces than the camera, at a small angle below them."""
    faces = mesh.faces[:: -(-len(mesh.faces) // MOST_FACES)]
    vertices = np.asarray(mesh.vertices, np.float64)
    for place in places(mesh)[:MOST_PLACES]:
        corners = vertices[faces] @ place[:, :3].T + place[:, 3]
        middle = corners.mean(axis=1)
        normal = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        view = np.einsum("fk,fk->f", normal, _to_camera(scene.camera, middle))
        lit = np.einsum("fk,fk->f", normal, _to_light(light, middle)) * np.sign(view)
        if ((lit < 0.0) & (lit > -STEEPEST)).any():
            return True
    return False


def _to_camera(camera: edgegrad.Camera, points: F64) -> F64:
    if camera.kind == "ORTHOGRAPHIC":
        return np.broadcast_to(camera.to_world[:3, 2], points.shape)
    return camera.to_world[:3, 3] - points


def _to_light(light: Any, points: F64) -> F64:
    """Unit vectors to the middle of a lamp."""
    if isinstance(light, edgegrad.SunLight):
        return np.broadcast_to(unit(-np.asarray(light.direction, np.float64)), points.shape)
    middle = light.to_world[:3, 3] if isinstance(light, edgegrad.AreaLight) else light.position
    return unit(middle - points)
