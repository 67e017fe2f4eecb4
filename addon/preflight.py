"""Why a fit can't start, in one line, with the operator that cures it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from . import target_rows
from .rows import switched_on, title


@dataclass(frozen=True)
class Obstacle:
    """A reason why a fit can't start.

    Attributes
    ----------
    sentence
        The reason.
    operator, label, options
        What cures it: the operator, the text of its button, and its properties; empty: only the user can.
    """

    sentence: str
    operator: str = ""
    label: str = ""
    options: dict[str, Any] = field(default_factory=dict)


def obstacle(context: Any) -> Obstacle | None:
    """Return the first reason why a fit can't start; None: nothing is known to be in its way."""
    scene = context.scene
    settings = scene.edgegrad
    if not any(ob.type == "CAMERA" for ob in scene.objects):
        return Obstacle("The scene has no camera", "object.camera_add", "Add a Camera")
    if not settings.targets:
        return Obstacle("There is no target", "edgegrad.target_open", "Open Target Picture")
    for k, row in enumerate(settings.targets):
        found = _target(row, k, scene)
        if found is not None:
            return found
    chosen = list(switched_on(scene))
    if not chosen:
        if settings.parameters:
            return Obstacle("Every parameter is switched off")
        return Obstacle("Nothing may change yet", "edgegrad.parameters_add", "Fit Selected Vertices",
                        {"of": "VERTICES"})  # fmt: skip
    for k, row in enumerate(settings.parameters):
        if row.enabled and row.owner is None:
            return Obstacle(f"Parameter '{title(row)[2]}': its datablock was removed", "edgegrad.row_remove",
                            "Remove It", {"parameters": True, "number": k})  # fmt: skip
    for row in chosen:
        ob = row.owner
        if row.kind == "VERTICES" and scene.objects.get(ob.name) != ob:
            return Obstacle(f"Object '{ob.name}' is not in this scene")
        if row.kind == "VERTICES" and ob.mode in ("EDIT", "SCULPT"):
            return Obstacle(f"Object '{ob.name}' is in {ob.mode.title()} Mode", "object.mode_set", "Leave It",
                            {"mode": "OBJECT"})  # fmt: skip
    return None


def _target(row: Any, number: int, scene: Any) -> Obstacle | None:
    name = "" if row.camera is None else row.camera.name
    if row.camera is None or scene.objects.get(name) != row.camera:
        return Obstacle(f"Target {number + 1} has no camera of this scene", "edgegrad.row_remove", "Remove It",
                        {"parameters": False, "number": number})  # fmt: skip
    open_it = {"number": number}
    if not row.image.strip():
        return Obstacle(f"Camera '{name}' has no picture", "edgegrad.target_open", "Open Target Picture", open_it)
    if target_rows.file_of(row.image) is None:
        return Obstacle(f"Picture '{row.image}' is missing", "edgegrad.target_open", "Open Target Picture", open_it)
    size, rendered = target_rows.picture_size(row.image), target_rows.render_size(scene)
    if size is None:
        return Obstacle(f"Picture '{row.image}' can't be read", "edgegrad.target_open", "Open Target Picture", open_it)
    if size != rendered:
        return Obstacle(f"Picture of '{name}' is {size[0]} × {size[1]}, renders are {rendered[0]} × {rendered[1]}",
                        "edgegrad.match_render", "Match Render to Picture", open_it)  # fmt: skip
    return None
