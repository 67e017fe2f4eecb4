"""The nearest scene with exact derivatives, in the place of an exported one."""

from __future__ import annotations

import edgegrad

from .export import Export


def simplify(export: Export) -> None:
    """Replace the exported scene by `edgegrad.differentiable`'s, whose sentences join the warnings."""
    export.scene, notes = edgegrad.differentiable(export.scene)
    for note in notes:
        where, _, what = note.partition(": ")
        export.report.warn(where, f"{what} (derivatives need it)")


def simplified_camera(camera: edgegrad.Camera) -> edgegrad.Camera:
    """The nearest camera with exact derivatives."""
    return edgegrad.differentiable(edgegrad.Scene(camera))[0].camera
