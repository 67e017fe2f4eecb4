"""Datablocks that are found again after they were renamed, and after an undo, which replaces them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ..problem import Problem


@dataclass(frozen=True)
class Held:
    """A datablock, by what stays the same while Blender runs.

    Attributes
    ----------
    collection
        Name of its collection in ``bpy.data``.
    uid
        Blender's number of the datablock.
    name
        Its name at the beginning, for messages.
    """

    collection: str
    uid: int
    name: str

    @staticmethod
    def of(collection: str, datablock: Any) -> Held:
        """Hold a datablock."""
        return Held(collection, datablock.session_uid, datablock.name_full)

    def find(self) -> Any:
        """Return the datablock as it is now; None: it was removed."""
        return next((one for one in getattr(bpy.data, self.collection) if one.session_uid == self.uid), None)

    @property
    def name_now(self) -> str:
        """Its full name as it is now; that at the beginning if it was removed."""
        found = self.find()
        return self.name if found is None else str(found.name_full)

    def get(self) -> Any:
        """Return the datablock as it is now.

        Raises
        ------
        Problem
            If it was removed; names it.
        """
        found = self.find()
        if found is None:
            kind = bpy.types.BlendData.bl_rna.properties[self.collection].fixed_type.name.lower()
            raise Problem(f"{kind} '{self.name}': was removed while it was fitted; undo that")
        return found
