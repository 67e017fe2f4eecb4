"""The panels of Blender that are shown for the engine.

Panels name the engines that they are for. Those of all engines are found as Cycles finds them. Of the panels of single
engines, those are shown whose settings the export reads.
"""

from __future__ import annotations

from typing import Any

import bpy

from .settings import ENGINE

# Panels of all engines with settings that this engine does not have, or that another panel shows in full.
LEFT_OUT = frozenset({
    "DATA_PT_light", "DATA_PT_falloff_curve", "NODE_DATA_PT_light", "VIEWLAYER_PT_layer_passes",
    "VIEWLAYER_PT_filter", "RENDER_PT_freestyle", "VIEWLAYER_PT_freestyle", "EEVEE_MATERIAL_PT_viewport_settings",
})  # fmt: skip
# Panels of single engines. Those of Cycles for data-blocks cannot be used: they ask for Cycles by name.
USED = frozenset({
    "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_MATERIAL_PT_displacement",
    "DATA_PT_EEVEE_light", "EEVEE_WORLD_PT_surface",
    "CYCLES_RENDER_PT_light_paths", "CYCLES_RENDER_PT_light_paths_max_bounces",
    "CYCLES_RENDER_PT_light_paths_caustics",
})  # fmt: skip


def _panels() -> list[Any]:
    found, seen = [], [bpy.types.Panel]
    while seen:  # panels also derive from other panels
        for panel in seen.pop().__subclasses__():
            seen.append(panel)
            engines = getattr(panel, "COMPAT_ENGINES", None)
            if engines is None:
                continue
            name = panel.__name__
            if name in USED or ("BLENDER_RENDER" in engines and name not in LEFT_OUT):
                found.append(panel)
    return found


def show() -> None:
    """Show the panels for the engine."""
    for panel in _panels():
        # Panels may share a set, of which each gets a copy.
        panel.COMPAT_ENGINES = {*panel.COMPAT_ENGINES, ENGINE}


def hide() -> None:
    """Undo `show`."""
    for panel in _panels():
        panel.COMPAT_ENGINES = set(panel.COMPAT_ENGINES) - {ENGINE}
