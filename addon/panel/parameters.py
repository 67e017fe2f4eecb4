"""The panel Parameters: what may change."""

from __future__ import annotations

from typing import Any

import bpy

from .. import rows, setups
from ..animated.stored import PROPERTY
from . import derived, icons
from .derived import lines, parameter, pointer
from .tab import Tab, editable, stated

ROWS = 4  # of the list, unless it is dragged longer


class ParameterList(bpy.types.UIList):
    """List of the parameters; each line shows datablock, property, and the value or the effect on the loss as a bar."""

    bl_idname = "EDGEGRAD_UL_parameters"

    def draw_item(self, context: Any, layout: Any, data: Any, item: Any, icon: int, active_data: Any,
                  active_property: str) -> None:  # fmt: skip
        line = lines.get(pointer(item)) or parameter(item)
        # The layout is a row of this line alone, so that the line needs no row of its own.
        if not line.enabled:
            layout.active = False
        layout.prop(item, "enabled", text="")
        if line.share == 1.0:
            layout.label(text=line.words, icon_value=line.icon)
            return
        split = layout.split(factor=line.share, align=True)
        split.label(text=line.words, icon_value=line.icon)
        if line.effect >= 0.0:
            split.progress(factor=line.effect, type="BAR", text=line.beside)
        else:
            split.label(text=line.beside)

    if bpy.app.version < (5, 2, 0):  # whose own filter does not read names that are made when they are asked for

        def filter_items(self, context: Any, data: Any, propname: str) -> tuple[list[int], list[int]]:
            """Filter by what the lines show."""
            wanted = self.filter_name.lower()
            if not wanted:
                return [], []
            shown = self.bitflag_filter_item
            return [shown if wanted in row.name.lower() else 0 for row in getattr(data, propname)], []


class AddMenu(bpy.types.Menu):
    """Add values of what is selected or active, or set up a usual task with its parameters and quality"""

    bl_idname = "EDGEGRAD_MT_add"
    bl_label = "Add Parameters"

    def draw(self, context: Any) -> None:
        layout = self.layout
        layout.label(text="From Selection")
        layout.operator_enum("edgegrad.parameters_add", "of")
        layout.separator()
        layout.label(text="Set Up")
        _set_ups(layout)


def _set_ups(layout: Any) -> None:
    """Draw the buttons of usual tasks."""
    for name, one in setups.SETUPS.items():
        layout.operator("edgegrad.set_up", text=one.label, icon=one.icon).task = name


class ParametersPanel(Tab, bpy.types.Panel):
    """Panel with the parameters."""

    bl_idname = "EDGEGRAD_PT_parameters"
    bl_label = "Parameters"
    bl_order = 1

    def draw(self, context: Any) -> None:
        layout, settings = editable(self.layout), context.scene.edgegrad
        count = len(settings.parameters)
        if not count:
            _set_ups(layout.column(align=True))
            layout.operator_menu_enum("edgegrad.parameters_add", "of", text="Add from Selection", icon="ADD")
            return
        derived.see_rows(settings, count, context.region.width)
        row = layout.row()
        row.template_list("EDGEGRAD_UL_parameters", "", settings, "parameters", settings, "active_parameter",
                          item_dyntip_propname="about", rows=ROWS, maxrows=ROWS)  # fmt: skip
        column = row.column(align=True)
        column.menu("EDGEGRAD_MT_add", text="", icon_value=icons.ADD)
        column.operator("edgegrad.parameter_remove", text="", icon_value=icons.REMOVE)


class ParameterDetailsPanel(Tab, bpy.types.Panel):
    """Panel with the settings of the active parameter that are rarely touched."""

    bl_idname = "EDGEGRAD_PT_parameter_details"
    bl_label = "Details"
    bl_parent_id = ParametersPanel.bl_idname
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: Any) -> bool:
        settings = context.scene.edgegrad
        return settings.active_parameter < len(settings.parameters)

    def draw(self, context: Any) -> None:
        layout = editable(self.begin())
        settings = context.scene.edgegrad
        item = settings.parameters[settings.active_parameter]
        icon, owner, words = rows.title(item)
        column = layout.column(align=True)
        column.label(text=owner, icon=icon)
        column.label(text=words, icon="BLANK1")
        stated(column, "Value", rows.value_text(item, whole=True))
        if item.sensitivity >= 0.0:
            stated(column, "Effect", f"{item.sensitivity:.0%}")
        if item.kind == "VERTICES":
            _vertices(layout, item)
            layout.prop(settings, "smoothness")
            layout.prop(settings, "write_to")
        if item.kind != PROPERTY:
            return
        column = layout.column()
        column.prop(item, "step", text="Rate" if item.step else "Rate (auto)")
        if settings.use_frames:
            column.prop(item, "keyed")
        column.prop(item, "use_limits")
        if item.use_limits:
            column.prop(item, "low")
            column.prop(item, "high")


def _vertices(layout: Any, item: Any) -> None:
    """Draw what the vertices of a row may do."""
    column = layout.column()
    if item.owner is not None:
        column.prop_search(item, "vertex_group", item.owner, "vertex_groups")
    row = column.row(heading="Lock", align=True)
    for k, axis in enumerate("XYZ"):
        row.prop(item, "lock", index=k, text=axis, toggle=True)
    column.prop(item, "symmetry")


CLASSES: tuple[Any, ...] = (ParameterList, AddMenu, ParametersPanel, ParameterDetailsPanel)
