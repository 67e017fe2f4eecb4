"""Scenes of the comparison with Cycles, as the add-on exports them."""

from __future__ import annotations

import bpy

from edgegrad_addon.export import export_scene
from edgegrad_addon.export.exported import Export
from tests.benchmarks import cycles_peer
from tests.benchmarks.cycles_scenes import Case, stage


def exported(case: Case, scale: float) -> Export:
    """The case's scene and settings, in a picture of `scale` times its width and height."""
    stage.empty()
    case.build()  # may open a file, which replaces the scene
    scene = bpy.context.scene
    own = scene.cycles.blur_glossy  # derivatives are measured as users see them, and not beside Cycles
    cycles_peer.prepare(scene, case.samples, case.bounces, {"blur_glossy": own, **case.limits})
    render = scene.render
    render.resolution_percentage = max(round(render.resolution_percentage * scale), 1)
    return export_scene(scene)
