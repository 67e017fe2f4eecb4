"""The settings of a target in the panel, below its row in the list."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .frames import is_movie


def draw_target(layout: Any, item: Any) -> None:
    """Draw what a target is; a silhouette needs its object or its collection."""
    layout.prop(item, "camera")
    layout.prop(item, "image")
    layout.prop(item, "kind")
    if item.kind == "SILHOUETTE":
        layout.prop(item, "silhouette_object")
        layout.prop(item, "silhouette_collection")


def draw_details(layout: Any, item: Any) -> None:
    """Draw the settings of a target that are rarely touched."""
    layout.prop(item, "datablock")
    if _has_frames(item):
        layout.prop(item, "use_frame")
        if item.use_frame:
            layout.prop(item, "frame")
    layout.prop(item, "mask")
    if item.kind != "SILHOUETTE":
        layout.prop(item, "alpha")
        layout.prop(item, "view")
        layout.prop(item, "exposure")
        if item.exposure == "FIXED":
            layout.prop(item, "stops")
        else:
            layout.prop(item, "shared")
    layout.prop(item, "weight")


def _has_frames(item: Any) -> bool:
    if item.datablock is not None:
        return item.datablock.source in ("MOVIE", "SEQUENCE")
    return is_movie(Path(item.image))
