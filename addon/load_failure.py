"""A panel and a command that say why Edgegrad's library cannot be loaded. Nothing else is registered then.

Nothing here imports Edgegrad at the top of the file: this must work where a wheel does not.
"""

from __future__ import annotations

import platform
import sys
import textwrap
from typing import Any

import bpy

WIDTH = 40  # characters of a line in the panel
_commands: list[Any] = []


def cause() -> str | None:
    """Return one sentence on why Edgegrad or its native engine cannot be loaded, and what helps; None: both can."""
    try:
        from edgegrad.rendering.engine import engine_class

        engine_class("native")
    except (ImportError, OSError, RuntimeError) as error:
        return (f"{str(error).rstrip('.')}; install the extension's zip for this platform "
                f"({platform.system()} {platform.machine()}, Python {sys.version_info.major}.{sys.version_info.minor}, "
                f"{' '.join(platform.libc_ver()) or 'no glibc'})")  # fmt: skip
    return None


class LoadFailurePanel(bpy.types.Panel):
    """Panel that says why Edgegrad does not work here."""

    bl_idname = "EDGEGRAD_PT_load_failure"
    bl_label = "Edgegrad can't be loaded"
    bl_category = "Edgegrad"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_order = 0

    sentence = ""

    def draw(self, _: Any) -> None:
        column = self.layout.column(align=True)
        for k, line in enumerate(textwrap.wrap(self.sentence, WIDTH)):
            column.label(text=line, icon="ERROR" if k == 0 else "BLANK1")


def register() -> bool:
    """Register the panel and the command if the library cannot be loaded; return whether they were."""
    failure = cause()
    if failure is None:
        return False
    print(f"Edgegrad can't be loaded: {failure}", file=sys.stderr)
    LoadFailurePanel.sentence = failure
    bpy.utils.register_class(LoadFailurePanel)
    _commands.append(bpy.utils.register_cli_command("edgegrad", _refuse))
    return True


def unregister() -> bool:
    """Undo `register`; return whether there was anything to undo."""
    if not _commands:
        return False
    bpy.utils.unregister_cli_command(_commands.pop())
    bpy.utils.unregister_class(LoadFailurePanel)
    return True


def _refuse(_: list[str]) -> int:
    """Refuse ``blender --command edgegrad``; the exit code is that of a failure."""
    print(f"edgegrad: error: can't be loaded: {LoadFailurePanel.sentence}", file=sys.stderr)
    return 1
