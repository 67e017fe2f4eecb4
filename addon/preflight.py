"""Why a fit can't start, in one line, with the operator that cures it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .export.surroundings.camera import render_size
from .rows import title
from .targets import rows


@dataclass(frozen=True)
class Obstacle:
    """A reason why a fit can't start.

    Attributes
    ----------
    sentence
        The reason.
    operator, label, options
        What cures it: the operator, the text of its button, and its properties; empty: only the user can.
    is_above
        Whether the panel Targets has the same button.
    """

    sentence: str
    operator: str = ""
    label: str = ""
    options: dict[str, Any] = field(default_factory=dict)
    is_above: bool = False


def obstacle(context: Any) -> Obstacle | None:
    """Return the first reason why a fit can't start; None: nothing is known to be in its way."""
    scene = context.scene
    settings = scene.edgegrad
    if not any(ob.type == "CAMERA" for ob in scene.objects):
        return Obstacle("The scene has no camera", "object.camera_add", "Add a Camera")
    if not settings.targets:
        return Obstacle("There is no target: open its picture above", "edgegrad.target_open", "Open Target Picture",
                        is_above=True)
    for k, row in enumerate(settings.targets):
        found = _target(row, k, scene)
        if found is not None:
            return found
    rows_on = [(k, row) for k, row in enumerate(settings.parameters) if row.enabled]
    if not rows_on:
        if settings.parameters:
            return Obstacle("Every parameter is switched off")
        return Obstacle("Nothing may change yet: choose a task above, or", "edgegrad.parameters_add",
                        "Fit Selected Vertices", {"of": "VERTICES"})  # fmt: skip
    for k, row in rows_on:
        if row.owner is None:
            return Obstacle(f"Parameter '{title(row)[2]}': its datablock was removed", *_remove_parameter(k))
    for k, row in rows_on:
        if row.kind not in ("VERTICES", "POWER"):
            continue
        ob = row.owner
        if scene.objects.get(ob.name) != ob:
            return Obstacle(f"Object '{ob.name}' is not in this scene", *_remove_parameter(k))
        if ob.mode in ("EDIT", "SCULPT"):
            mode = f"{ob.mode.title()} Mode"
            return Obstacle(f"Object '{ob.name}' is in {mode}", "object.mode_set", f"Leave {mode}", {"mode": "OBJECT"})
    return None


def _remove_parameter(number: int) -> tuple[str, str, dict[str, Any]]:
    """Return the cure of a parameter that can't be fitted."""
    return "edgegrad.row_remove", "Remove It", {"parameters": True, "number": number}


def _target(row: Any, number: int, scene: Any) -> Obstacle | None:
    name = "" if row.camera is None else row.camera.name
    if row.camera is None or scene.objects.get(name) != row.camera:
        told, free = f"Target {number + 1} has no camera of this scene", rows.next_camera(scene)
        if free is not None:
            return Obstacle(told, "edgegrad.target_use_camera", f"Use '{free.name}'", {"number": number})
        return Obstacle(told, "edgegrad.row_remove", "Remove It", {"parameters": False, "number": number})
    open_it = {"number": number}
    problem = rows.problem_of(row)
    if problem:
        return Obstacle(f"Camera '{name}': {problem}", "edgegrad.target_open", "Open Target Picture", open_it)
    size, rendered = rows.size_of(row), render_size(scene)
    if size is not None and not rows.has_aspect(row, scene):
        return Obstacle(f"Picture of '{name}' is {size[0]} × {size[1]}, of another aspect than renders of "
                        f"{rendered[0]} × {rendered[1]}", "edgegrad.match_render", "Match Render to Picture", open_it)
    if rows.lacks_object(row):
        return Obstacle(f"Camera '{name}': a silhouette needs an object or a collection; choose it below the targets")
    return None
