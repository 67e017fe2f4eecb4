"""What the panel shows of the last operator and of the fit that runs; no .blend remembers it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy


@dataclass
class Status:
    """What there is to show.

    Attributes
    ----------
    warnings, notes
        Sentences on what was exported in another way, and on what derivatives leave out.
    scene
        File and scene that they are about.
    fraction
        Part of the running fit that is done; None: no fit runs.
    text
        What the fit's progress bar says.
    """

    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()
    scene: tuple[str, str] = ("", "")
    fraction: float | None = None
    text: str = ""

    def say(self, warnings: Sequence[str], notes: Sequence[str]) -> None:
        """Replace what is shown by what an operator says of the current scene."""
        self.warnings, self.notes, self.scene = tuple(warnings), tuple(dict.fromkeys(notes)), _scene()
        redraw()

    @property
    def lines(self) -> list[tuple[str, str]]:
        """(icon, sentence) of what is said of the current scene."""
        if self.scene != _scene():
            return []
        return [*(("ERROR", line) for line in self.warnings), *(("INFO", line) for line in self.notes)]


STATUS = Status()


def redraw() -> None:
    """Have the sidebars of 3D views drawn again: Blender doesn't know that what they show has changed."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def _scene() -> tuple[str, str]:
    return bpy.data.filepath, bpy.context.scene.name_full
