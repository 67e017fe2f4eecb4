"""The panel of fits as fields, in Edgegrad's tab."""

from __future__ import annotations

from typing import Any

import bpy

from ..panel.tab import Tab, editable


class FieldPanel(Tab, bpy.types.Panel):
    """Panel with the options and the button of a fit as a field."""

    bl_idname = "EDGEGRAD_PT_field"
    bl_label = "Fit as Field"
    bl_order = 3
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: Any) -> None:
        layout = editable(self.begin())
        settings = context.scene.edgegrad
        ob = context.view_layer.objects.active
        layout.prop(settings, "field_resolution")
        row = layout.row()
        row.active = ob is None or ob.type != "EMPTY"
        row.prop(settings, "field_start")
        layout.label(text=settings.bl_rna.properties["field_values"].name)
        row = layout.row(align=True)
        row.use_property_split = False  # beside the name, the buttons are too narrow for their words
        row.prop(settings, "field_values")
        text = "Select an object or an empty" if ob is None else f"Fit '{ob.name}' as Field"
        layout.operator("edgegrad.fit_as_field", text=text, icon="META_BALL")
