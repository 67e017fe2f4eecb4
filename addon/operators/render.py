"""The operator edgegrad.render."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

from ..export import export_scene, render_export
from . import _common


class Render(bpy.types.Operator):
    """Render the picture of the active camera with Edgegrad into the image 'Edgegrad Render'"""

    bl_idname = "edgegrad.render"
    bl_label = "Render"
    bl_options = {"REGISTER"}  # noqa: RUF012  Blender's convention

    samples: bpy.props.IntProperty(name="Samples", default=64, min=1)  # type: ignore[valid-type]

    def execute(self, context: Any) -> set[str]:
        try:
            export = export_scene(context.scene)
            picture = render_export(export.scene, export.settings, self.samples)
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        _common.tell(self, export.report)
        _common.show("Edgegrad Render", picture)
        self.report({"INFO"}, "the picture is in the image 'Edgegrad Render'")
        return {"FINISHED"}
