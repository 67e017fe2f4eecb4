"""Messages of the last operator, and the running job, for the panel; not saved in the .blend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from .problem import sentence
from .running.job import Job


@dataclass
class Status:
    """State that the panel shows.

    Attributes
    ----------
    warnings, notes
        Sentences on approximations of the export, and on terms that the derivatives lack.
    plan, checks
        Lines of the last plan, and of the last comparison with finite differences.
    scene
        File and name of the scene that the sentences are about.
    job
        The running job; None: nothing runs.
    said
        How the last job ended; empty: nothing ran yet.
    failed
        Whether it ended with an error.
    cost
        Seconds that one sample per pixel of one picture takes in an iteration, from the last fit; 0: not known.
    """

    warnings: Sequence[str] = ()
    notes: Sequence[str] = ()
    plan: Sequence[str] = ()
    checks: Sequence[str] = ()
    scene: tuple[str, str] = ("", "")
    job: Job | None = None
    said: str = ""
    failed: bool = False
    cost: float = 0.0

    def say(self, warnings: Sequence[str], notes: Sequence[str]) -> None:
        """Replace the sentences by those of an operator on the current scene."""
        self._at_scene()
        self.warnings, self.notes = tuple(warnings), tuple(dict.fromkeys(notes))
        redraw()

    def show(self, plan: Sequence[str] | None = None, checks: Sequence[str] | None = None) -> None:
        """Replace the lines of the plan or of the comparisons by those of the current scene."""
        self._at_scene()
        self.plan = self.plan if plan is None else tuple(plan)
        self.checks = self.checks if checks is None else tuple(checks)
        redraw()

    def ended(self, said: str, failed: bool = False) -> None:
        """Say how a job ended."""
        self.said, self.failed = sentence(said), failed
        redraw()

    def forget(self) -> None:
        """Forget all but the running job, as at another file: its scene may have the same name, and no file yet."""
        self.said, self.failed, self.cost = "", False, 0.0
        self.warnings = self.notes = self.plan = self.checks = ()

    @property
    def lines(self) -> list[tuple[str, str]]:
        """List (icon, sentence) for the current scene."""
        if self.scene != _scene():
            return []
        return [*(("ERROR", line) for line in self.warnings), *(("INFO", line) for line in self.notes)]

    def of_scene(self, lines: Sequence[str]) -> Sequence[str]:
        """Return lines of a plan or a comparison if they are about the current scene."""
        return lines if self.scene == _scene() else ()

    def _at_scene(self) -> None:
        if self.scene != _scene():
            self.warnings = self.notes = self.plan = self.checks = ()
            self.scene = _scene()


STATUS = Status()


def redraw(all_regions: bool = False) -> None:
    """Redraw the sidebars of 3D views, or all of their regions: Blender does not notice changes of the status."""
    manager = bpy.context.window_manager
    for window in () if manager is None else manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if all_regions or region.type == "UI":
                        region.tag_redraw()


def _scene() -> tuple[str, str]:
    return bpy.data.filepath, bpy.context.scene.name_full
