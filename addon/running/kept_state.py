"""Checkpoints of fits in Blender's window: if Blender ends before a fit has, the same fit goes on the next time."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import bpy

from ..preferences import checkpoint_folder


def file_for(scene: Any) -> Path | None:
    """Return the file for the state of this scene's fit; None: none is kept.

    Raises
    ------
    Problem
        If the folder in the preferences does not exist.
    """
    folder = checkpoint_folder()
    if folder is None:
        return None
    name = Path(bpy.data.filepath).stem or "unsaved"
    # Files of equal names in different folders have different digests.
    digest = hashlib.sha256(f"{bpy.data.filepath}\0{scene.name_full}".encode()).hexdigest()[:12]
    return folder / f"{bpy.path.clean_name(name)}-{digest}.npz"
