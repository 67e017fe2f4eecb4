"""Preferences of the add-on: settings of the user, which no .blend has."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from typing import Any

import bpy

# The most that a renderer takes (edgegrad.rendering.options.MOST_THREADS), which may not be loaded here.
MOST_THREADS = 4096


class Preferences(bpy.types.AddonPreferences):
    """Preferences of Edgegrad."""

    bl_idname = __package__

    threads: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Threads", default=0, min=0, max=MOST_THREADS,
        description="Threads of renders and fits; 0: one per core. Results are the same for any number")

    def draw(self, _: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "threads")


def threads() -> int:
    """Return the number of threads that the user has chosen; 0, one per core, where the add-on is not enabled."""
    addon = bpy.context.preferences.addons.get(__package__)
    return 0 if addon is None or addon.preferences is None else int(addon.preferences.threads)
