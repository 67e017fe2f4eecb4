"""The panel of fits as fields, in Edgegrad's tab."""

from __future__ import annotations

from typing import Any

import bpy


class FieldPanel(bpy.types.Panel):
    """Panel with the options and the button of a fit as a field."""

    bl_idname = "EDGEGRAD_PT_field"
    bl_label = "Fit as Field"
    bl_category = "Edgegrad"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.edgegrad
        ob = context.view_layer.objects.active
        layout.prop(settings, "field_resolution")
        row = layout.row()
        row.active = ob is None or ob.type != "EMPTY"
        row.prop(settings, "field_start")
        text = "Select an object or an empty" if ob is None else f"Fit '{ob.name}' as Field"
        layout.operator("edgegrad.fit_as_field", text=text, icon="META_BALL")
