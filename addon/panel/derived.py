"""What the panel derives from the file, such as names of properties and what is in the way of a fit.

Blender draws a panel at each move of the pointer over it. What it shows is therefore kept until Blender has evaluated
an edit. Pictures change without an edit: while the panel is being drawn, a timer looks at them. What was not drawn for
a while is derived anew.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, TypeVar

import bpy
from bpy.app.handlers import persistent

from .. import preflight, quality
from .. import rows as parameter_rows
from ..status import STATUS, redraw
from ..targets import rows as target_rows
from . import icons

T = TypeVar("T")

SECONDS = 0.5  # between two looks at the pictures

_kept: dict[Hashable, Any] = {}


class _Seen:
    """What the file was like when it was looked at.

    Attributes
    ----------
    rows
        Numbers of rows by the pointer of a scene's settings.
    edits
        Number of edits of rows.
    pictures
        State of the pictures of all targets.
    drawn
        Whether the panel was drawn since the last look.
    """

    rows: dict[int, tuple[int, int]] = {}  # noqa: RUF012
    edits: int = 0
    pictures: object = None
    drawn: bool = False


def _derived(key: Hashable, make: Callable[[], T]) -> T:
    _Seen.drawn = True
    if key not in _kept:
        _kept[key] = make()
    found: T = _kept[key]
    return found


@persistent
def forget(*_: Any) -> None:
    """Derive everything anew."""
    _kept.clear()


@persistent
def _leave_file(*_: Any) -> None:
    """Forget the last job of a file that is left. A job that still runs is ended after this, and says so."""
    STATUS.forget_end()


def see_rows(settings: Any) -> None:
    """Forget what is kept if rows were added, removed or edited, of which Blender's handlers do not tell."""
    rows, scene = (len(settings.targets), len(settings.parameters)), settings.as_pointer()
    if _Seen.edits != STATUS.edits or _Seen.rows.get(scene) != rows:
        _Seen.edits, _Seen.rows[scene] = STATUS.edits, rows
        forget()


def see_pictures() -> float:
    """Forget what is kept, and draw the panel, if pictures have changed; return the seconds to the next call."""
    if not _Seen.drawn:
        forget()
        return SECONDS
    _Seen.drawn = False
    manager = bpy.context.window_manager
    scenes = {window.scene for window in manager.windows} if manager is not None else set()
    pictures = {(scene.name_full, k): target_rows.fingerprint(row) for scene in scenes
                for k, row in enumerate(scene.edgegrad.targets)}  # fmt: skip
    if pictures != _Seen.pictures:
        _Seen.pictures = pictures
        forget()
        redraw()
    return SECONDS


_HANDLERS = (bpy.app.handlers.depsgraph_update_post, bpy.app.handlers.undo_post, bpy.app.handlers.redo_post,
             bpy.app.handlers.load_post, bpy.app.handlers.frame_change_post)  # fmt: skip


def register() -> None:
    """Notice edits and changes of pictures."""
    for handlers in _HANDLERS:
        handlers.append(forget)
    bpy.app.handlers.load_pre.append(_leave_file)
    bpy.app.timers.register(see_pictures, first_interval=SECONDS, persistent=True)


def unregister() -> None:
    """Undo `register`."""
    for handlers in _HANDLERS:
        handlers.remove(forget)
    bpy.app.handlers.load_pre.remove(_leave_file)
    if bpy.app.timers.is_registered(see_pictures):
        bpy.app.timers.unregister(see_pictures)
    _Seen.rows, _Seen.pictures, _Seen.drawn = {}, None, False
    forget()


def obstacle(context: Any) -> preflight.Obstacle | None:
    """Return what is in the way of a fit (`preflight.obstacle`)."""
    settings = context.scene.edgegrad
    see_rows(settings)
    return _derived(("obstacle", settings.as_pointer()), lambda: preflight.obstacle(context))


def fit_label(settings: Any) -> str:
    """Return the text of the button Fit of a scene that `obstacle` has seen, with the time of a fit if it is known."""

    def make() -> str:
        known = quality.time_to_go(settings, STATUS.cost)
        return f"Fit   ({known})" if known else "Fit"

    return _derived(("fit", settings.as_pointer(), STATUS.cost), make)


@dataclass(frozen=True)
class Line:
    """A line of the list of parameters.

    Attributes
    ----------
    icon, words, value
        Of the row and its value.
    enabled
        Whether the row is switched on.
    effect
        Effect on the loss, relative to the largest; negative: not known.
    """

    icon: str
    words: str
    value: str
    enabled: bool
    effect: float


def parameter(row: Any) -> Line:
    """Return the line of a parameter, whose list `see_rows` has seen."""
    _Seen.drawn = True
    key = row.as_pointer()
    found: Line | None = _kept.get(key)
    if found is None:
        found = _kept[key] = _line(row)
    return found


def _line(row: Any) -> Line:
    icon, owner, words = parameter_rows.title(row)
    return Line(icon, f"{owner}: {words}", parameter_rows.value_text(row), row.enabled, row.sensitivity)


@dataclass(frozen=True)
class Picture:
    """The picture of a target.

    Attributes
    ----------
    icon, words
        Its state, and its name or what is wrong with it.
    camera
        Name of the camera; empty: it has none.
    thumbnail
        Number of its icon; 0: there is none.
    size
        Width and height in words; empty: it is a movie, or can't be read.
    difference
        How its size differs from that of renders; empty: it does not.
    """

    icon: str
    words: str
    camera: str
    thumbnail: int
    size: str
    difference: str


def picture(row: Any, scene: Any) -> Picture:
    """Return what is known of the picture of a target, whose list `see_rows` has seen."""
    return _derived(row.as_pointer(), lambda: _picture(row, scene))


def _picture(row: Any, scene: Any) -> Picture:
    camera = "" if row.camera is None else row.camera.name
    icon, words = target_rows.state(row, scene)
    size, rendered, shown, difference = target_rows.size_of(row), target_rows.render_size(scene), "", ""
    if size is not None:
        shown = f"{size[0]} × {size[1]}"
        if size == rendered:
            shown += ", as renders"
        else:
            aspect = "" if target_rows.has_aspect(row, scene) else "Of another aspect: "
            difference = f"{aspect}{'r' if aspect else 'R'}enders are {rendered[0]} × {rendered[1]}"
    return Picture(icon, words, camera, icons.thumbnail(row.image), shown, difference)
