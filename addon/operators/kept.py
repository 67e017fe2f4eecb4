"""The operator edgegrad.write_kept_result."""

from __future__ import annotations

from typing import Any

import bpy

from ..write_back.kept import TEXT, write_kept
from . import _common


class WriteKeptResult(bpy.types.Operator):
    """Write the result of a fit that could not be written when the fit ended"""

    bl_idname = "edgegrad.write_kept_result"
    bl_label = "Write Kept Result"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, _: Any) -> bool:
        return bpy.data.texts.get(TEXT) is not None

    def execute(self, context: Any) -> set[str]:
        """Write what can be written now, and tell what can't."""
        try:
            done, failed = write_kept()
        except _common.EXPECTED as error:
            return _common.refuse(self, error)
        for sentence in failed:
            _common.say(self, "WARNING", sentence)
        _common.say(self, "INFO", f"written: {', '.join(done) or 'nothing'}")
        return {"FINISHED"} if done else {"CANCELLED"}


CLASSES: tuple[Any, ...] = (WriteKeptResult,)
