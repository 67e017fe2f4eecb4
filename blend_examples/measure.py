"""How far a .blend of the sculpt is from the true one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from build_sculpt import SCULPT  # type: ignore[import-not-found]
from numpy.typing import NDArray

import edgegrad
from edgegrad_addon.export import export_scene


@dataclass
class Measured:
    """Distance from the truth.

    Attributes
    ----------
    iou
        Intersection over union of the silhouettes, mean over all cameras.
    vertex_error
        Mean distance of each vertex from the same vertex of the true mesh, metres.
    """

    iou: float
    vertex_error: float


def measure(path: Path, truth: Path) -> Measured:
    """Compare the sculpts of two .blend files."""
    mesh, _ = _read(path)
    true_mesh, cameras = _read(truth)
    pairs = [(_silhouette(mesh, camera), _silhouette(true_mesh, camera)) for camera in cameras]
    return Measured(
        float(np.mean([(a & b).sum() / (a | b).sum() for a, b in pairs])),
        float(np.linalg.norm(mesh.vertices - true_mesh.vertices, axis=1).mean()),
    )


def _read(path: Path) -> tuple[edgegrad.Mesh, list[edgegrad.Camera]]:
    """The sculpt in world space, as it is evaluated, and all cameras."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    export = export_scene(scene, [ob for ob in scene.objects if ob.type == "CAMERA"])
    return export.scene.meshes[SCULPT], export.views


def _silhouette(mesh: edgegrad.Mesh, camera: edgegrad.Camera) -> NDArray[np.bool_]:
    """(H, W) pixels that the mesh covers by more than half."""
    white = edgegrad.Material(np.zeros(3), np.ones(3))
    alone = edgegrad.Mesh(mesh.vertices, mesh.faces, ("white",))
    scene = edgegrad.Scene(camera, {SCULPT: alone}, {"white": white})
    coverage: NDArray[np.float32] = edgegrad.render(scene, spp=64, max_depth=1)[..., 0]
    return coverage > 0.5
