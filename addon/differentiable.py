"""Export of the scene for fits and gradients, with the light path limits of its render settings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import bpy

import edgegrad
from edgegrad.rendering.engine import engine_class
from edgegrad.rendering.one_shot import CAUSTIC_SAMPLES
from edgegrad.rendering.renderer import MAX_DERIVATIVE_DEPTH
from edgegrad.scene import parameters

from .export import Export, export_scene

# Resolution of baked images for the reference engine, which uses only the mean colours of textures.
MEAN_RESOLUTION = 64


def export_differentiable(scene: Any, cameras: Sequence[Any] = ()) -> Export:
    """Export Blender's scene for derivatives, seen by each of the cameras (none: the active camera).

    If only the reference engine can be loaded, the scene is simplified to a flat-shaded, diffuse one, and the report
    names each simplification.
    """
    if not engine_class("auto").narrow:
        return export_scene(scene, cameras)
    export = export_scene(scene, cameras, bake=MEAN_RESOLUTION, coded=False)
    export.scene, notes = edgegrad.differentiable(export.scene)
    export.views = [edgegrad.differentiable(edgegrad.Scene(view))[0].camera for view in export.views]
    export.settings = replace(export.settings, max_depth=min(export.settings.max_depth, MAX_DERIVATIVE_DEPTH))
    for note in notes:
        where, _, what = note.partition(": ")
        export.report.warn(where, f"{what} (the reference engine's derivatives need it)")
    return export


def let_normals_follow(export: Export, paths: Sequence[str]) -> list[str]:
    """Let the smooth normals of meshes follow their vertices if these are parameters.

    Blender averages the normals of polygons. Where they differ from those of the triangles, as in most meshes of quads,
    they are exported as given normals, which would stay as they are while the vertices move.

    Returns
    -------
    A sentence on each mesh with custom normals, which do stay.
    """
    notes = []
    for path in paths:
        collection, name, fieldname = parameters.split(path)
        if collection != "meshes" or fieldname != "vertices" or name not in export.meshes:
            continue
        owner = export.meshes[name].object
        if not bpy.data.objects[owner].data.has_custom_normals:
            export.scene.meshes[name].normals = None
        elif export.scene.meshes[name].normals is not None:
            notes.append(f"object '{owner}': has custom normals, which stay as they are while its vertices move, so "
                         "its shading follows its shape in part only; clear them (Clear Custom Split Normals Data)")
    return notes


def not_computed(export: Export, paths: list[str]) -> list[str]:
    """Sentences that name terms of the derivative which are not computed although they may be non-zero."""
    limits = export.settings
    missing = edgegrad.plan(export.scene, paths, max_depth=limits.max_depth, bounces=limits.bounces,
                            measure=CAUSTIC_SAMPLES).missing  # fmt: skip
    return [f"not computed: {sentence}" for sentence in missing]
