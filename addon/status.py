"""Messages of the last operator and progress of the running fit, for the panel; not saved in the .blend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy


@dataclass
class Status:
    """State that the panel shows.

    Attributes
    ----------
    warnings, notes
        Sentences on approximations of the export, and on terms that the derivatives lack.
    scene
        File and name of the scene that the sentences are about.
    fraction
        Completed fraction of the running fit; None: no fit is running.
    text
        Text of the progress bar.
    """

    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()
    scene: tuple[str, str] = ("", "")
    fraction: float | None = None
    text: str = ""

    def say(self, warnings: Sequence[str], notes: Sequence[str]) -> None:
        """Replace the sentences by those of an operator on the current scene."""
        self.warnings, self.notes, self.scene = tuple(warnings), tuple(dict.fromkeys(notes)), _scene()
        redraw()

    @property
    def lines(self) -> list[tuple[str, str]]:
        """List (icon, sentence) for the current scene."""
        if self.scene != _scene():
            return []
        return [*(("ERROR", line) for line in self.warnings), *(("INFO", line) for line in self.notes)]


STATUS = Status()


def redraw() -> None:
    """Redraw the sidebars of 3D views: Blender does not notice changes of the status."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def _scene() -> tuple[str, str]:
    return bpy.data.filepath, bpy.context.scene.name_full
