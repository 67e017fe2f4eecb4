"""What the panel derives from the file, such as names of properties and what is in the way of a fit.

Blender draws a panel at each move of the pointer over it. What it shows is therefore kept until Blender has evaluated
an edit, and not longer than `SECONDS`, since files can change without an edit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy
from bpy.app.handlers import persistent

from .. import preflight
from .. import rows as parameter_rows
from ..targets import rows as target_rows
from . import icons

T = TypeVar("T")

SECONDS = 0.5

_kept: dict[Hashable, Any] = {}
_until: list[float] = [0.0]


def _derived(key: Hashable, make: Callable[[], T]) -> T:
    if time.monotonic() > _until[0]:
        _kept.clear()
        _until[0] = time.monotonic() + SECONDS
    if key not in _kept:
        _kept[key] = make()
    found: T = _kept[key]
    return found


@persistent
def forget(*_: Any) -> None:
    """Derive everything anew."""
    _kept.clear()


_HANDLERS = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.undo_post, bpy.app.handlers.redo_post,
             bpy.app.handlers.load_post, bpy.app.handlers.frame_change_post)  # fmt: skip


def register() -> None:
    """Notice edits."""
    for handlers in _HANDLERS:
        handlers.append(forget)


def unregister() -> None:
    """Undo `register`."""
    for handlers in _HANDLERS:
        handlers.remove(forget)
    forget()


def obstacle(context: Any) -> preflight.Obstacle | None:
    """Return what is in the way of a fit (`preflight.obstacle`)."""
    settings = context.scene.edgegrad
    # Rows that a script adds or removes are no edit.
    key = "obstacle", settings.as_pointer(), len(settings.targets), len(settings.parameters)
    return _derived(key, lambda: preflight.obstacle(context))


@dataclass(frozen=True)
class Line:
    """A line of the list of parameters: the icon and words of a row, and its value."""

    icon: str
    words: str
    value: str


def parameter(row: Any) -> Line:
    """Return the line of a parameter."""
    return _derived((row.as_pointer(), row.kind, row.path), lambda: _line(row))


def _line(row: Any) -> Line:
    icon, owner, words = parameter_rows.title(row)
    return Line(icon, f"{owner}: {words}", parameter_rows.value_text(row))


@dataclass(frozen=True)
class Picture:
    """The picture of a target.

    Attributes
    ----------
    icon, words
        Its state, and its name or what is wrong with it.
    thumbnail
        Number of its icon; 0: there is none.
    size, render_size
        Width and height of it and of the renders; None: a movie, or a file that can't be read.
    fits
        Whether it has the aspect of the renders.
    """

    icon: str
    words: str
    thumbnail: int
    size: tuple[int, int] | None
    render_size: tuple[int, int]
    fits: bool


def picture(row: Any, scene: Any) -> Picture:
    """Return what is known of the picture of a target."""
    return _derived((row.as_pointer(), row.image), lambda: _picture(row, scene))


def _picture(row: Any, scene: Any) -> Picture:
    return Picture(*target_rows.state(row, scene), icons.thumbnail(row.image), target_rows.size_of(row),
                   target_rows.render_size(scene), target_rows.has_aspect(row, scene))  # fmt: skip
