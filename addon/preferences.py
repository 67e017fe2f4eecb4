"""Preferences of the add-on: settings of the user, which no .blend has."""

# This file has no postponed annotations, since Blender reads properties from annotations.
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .problem import Problem

# The most that a renderer takes (edgegrad.rendering.options.MOST_THREADS), which may not be loaded here.
MOST_THREADS = 4096


@dataclass(frozen=True)
class Preview:
    """How a rendered view answers an edit.

    Attributes
    ----------
    label, use
        Name, and what it is good for.
    seconds
        A view whose pixels take longer is first rendered with fewer of them.
    """

    label: str
    use: str
    seconds: float


PREVIEWS = {
    "FAST": Preview("Fast", "The first picture after an edit comes soon, and may have few pixels", 0.01),
    "BALANCED": Preview("Balanced", "The first picture after an edit has as many pixels as 0.02 seconds allow", 0.02),
    "SHARP": Preview("Sharp", "The first picture after an edit has more pixels and comes later", 0.08),
}
USUAL_PREVIEW = "BALANCED"


class Preferences(bpy.types.AddonPreferences):
    """Preferences of Edgegrad."""

    bl_idname = __package__

    threads: bpy.props.IntProperty(  # type: ignore[valid-type]
        name="Threads", default=0, min=0, max=MOST_THREADS,
        description="Threads of renders and fits; 0: one per core. Results are the same for any number")
    preview: bpy.props.EnumProperty(  # type: ignore[valid-type]
        name="Rendered Views", default=USUAL_PREVIEW,
        items=[(name, one.label, one.use) for name, one in PREVIEWS.items()],
        description="Pixels of the first picture after an edit")
    checkpoints: bpy.props.StringProperty(  # type: ignore[valid-type]
        name="Checkpoints", subtype="DIR_PATH",
        description="Folder in which running fits keep their state. If Blender ends before a fit has, the same fit "
                    "goes on from there. Empty: no state is kept")

    def draw(self, _: Any) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "threads")
        layout.prop(self, "preview")
        layout.prop(self, "checkpoints")


def threads() -> int:
    """Return the number of threads that the user has chosen; 0, one per core, where the add-on is not enabled."""
    chosen = _chosen()
    return 0 if chosen is None else int(chosen.threads)


def first_seconds() -> float:
    """Return the seconds that the first picture of a rendered view may take."""
    chosen = _chosen()
    return PREVIEWS[USUAL_PREVIEW if chosen is None else chosen.preview].seconds


def checkpoint_folder() -> Path | None:
    """Return the folder for checkpoints; None: no checkpoints are kept.

    Raises
    ------
    Problem
        If there is no such folder.
    """
    chosen = _chosen()
    if chosen is None or not chosen.checkpoints.strip():
        return None
    folder = Path(bpy.path.abspath(chosen.checkpoints))
    if not folder.is_dir():
        raise Problem(f"preferences: the folder for checkpoints, '{folder}', does not exist; make it, choose another "
                      "one in the preferences of Edgegrad, or leave the field empty")  # fmt: skip
    return folder


def _chosen() -> Any:
    addon = bpy.context.preferences.addons.get(__package__)
    return None if addon is None else addon.preferences
