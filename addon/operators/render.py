"""The operator edgegrad.render."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from ..export import export_scene, render_export
from ..running.job import Job
from . import _common
from .background import InBackground

NAME = "Edgegrad Render"


class Render(InBackground, bpy.types.Operator):
    """Render the picture of the active camera with Edgegrad into the image 'Edgegrad Render'. Esc: stop"""

    bl_idname = "edgegrad.render"
    bl_label = "Render"
    bl_options = {"REGISTER"}  # noqa: RUF012  Blender's convention

    samples: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Samples", default=0, min=0, description="Samples per pixel; 0: those of the panel")

    def prepare(self, context: Any) -> tuple[Job, None]:
        export = export_scene(context.scene)
        _common.tell(self, export.report)
        samples = self.samples or context.scene.edgegrad.look_samples
        return Job("Render", lambda job: render_export(export.scene, export.settings, samples,
                                                       progress=job.check)), None  # fmt: skip

    def finish(self, context: Any, job: Job) -> set[str]:
        _common.show(NAME, job.result)
        said = f"the picture is in the image '{NAME}'"
        return _common.done(self, said)
