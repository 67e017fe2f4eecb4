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
from ..write_back.kept import TEXT
from . import icons

T = TypeVar("T")

SECONDS = 0.5  # between two looks at the pictures
# Of the list of parameters, in pixels at scale 1: what is beside the words and their icon; the icon with its margins;
# the mean width of a character; the width of a line below which values and the numbers of bars are left out.
BESIDE, ICON, CHARACTER, NARROW = 116, 30, 5.9, 184

_kept: dict[Hashable, Any] = {}
# Lines of parameters by the pointers of their rows.
lines: dict[int, Line] = {}

# The pointer of Blender's data. As an attribute it would first be searched for among their properties and functions.
pointer: Callable[[Any], int] = bpy.types.bpy_struct.as_pointer


class _Seen:
    """What the file was like when it was looked at.

    Attributes
    ----------
    rows
        Number of edits and of parameters, by the pointer of a scene's settings.
    width
        Pixels of a line of the list of parameters, at scale 1.
    pictures
        State of the pictures of all targets.
    drawn
        Whether the panel was drawn since the last look.
    """

    rows: dict[int, tuple[int, int]] = {}  # noqa: RUF012
    width: float = NARROW
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
    lines.clear()


@persistent
def _leave_file(*_: Any) -> None:
    """Forget the last job of a file that is left. A job that still runs is ended after this, and says so."""
    STATUS.forget_end()


def see_rows(settings: Any, count: int, width: float) -> None:
    """Forget what is kept if parameters were added, removed or edited, of which Blender's handlers do not tell.

    Words of lines fit into a width (`line_width`).
    """
    rows, scene = (STATUS.edits, count), pointer(settings)
    if _Seen.rows.get(scene) != rows:
        _Seen.rows[scene] = rows
        forget()
    if _Seen.width != width:
        _Seen.width = width
        lines.clear()


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


@dataclass(frozen=True)
class Start:
    """What the start of a fit needs.

    Attributes
    ----------
    obstacle
        What is in its way (`preflight.obstacle`).
    quality
        The quality in words.
    label
        Text of the button Fit, with the time of a fit if it is known.
    kept
        Whether the file has the result of a fit that could not be written.
    """

    obstacle: preflight.Obstacle | None
    quality: str
    label: str
    kept: bool


def start(context: Any) -> Start:
    """Return what the start of a fit needs."""
    settings = context.scene.edgegrad
    # Of edits and removed rows Blender's handlers do not tell. The end of a job may have changed what the file keeps.
    key = (pointer(settings), STATUS.edits, len(settings.targets), len(settings.parameters), STATUS.cost, STATUS.said)
    return _derived(key, lambda: _start(context, settings))


def _start(context: Any, settings: Any) -> Start:
    known = quality.time_to_go(settings, STATUS.cost)
    return Start(preflight.obstacle(context), f"Quality: {quality.QUALITIES[settings.quality].label}",
                 f"Fit   ({known})" if known else "Fit", TEXT in bpy.data.texts)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """A line of the list of parameters.

    Attributes
    ----------
    icon
        Number of its icon.
    words, beside
        Of the row, and of its value or effect.
    share
        Part of the line that the words have; 1: there is nothing beside them.
    enabled
        Whether the row is switched on.
    effect
        Effect on the loss, relative to the largest; negative: not known.
    about
        All that is known of the row, for its tooltip.
    """

    icon: int
    words: str
    beside: str
    share: float
    enabled: bool
    effect: float
    about: str


def parameter(row: Any) -> Line:
    """Return the line of a parameter, whose list `see_rows` has seen."""
    key = pointer(row)
    found = lines.get(key)
    if found is None:
        narrow, effect, value = _Seen.width < NARROW, row.sensitivity, parameter_rows.value_text(row, whole=True)
        share = 0.76 if not narrow else 0.93 if effect >= 0.0 else 1.0
        icon, name, words = parameter_rows.names(row, int((_Seen.width * share - ICON) / CHARACTER))
        about = [name, f"Value: {value}"]
        if effect >= 0.0:
            about.append(f"Effect on the loss: {effect:.0%} of the largest")
        beside = "" if narrow else f"{effect:.0%}" if effect >= 0.0 else parameter_rows.value_text(row)
        found = lines[key] = Line(icons.number(icon), words, beside, share, row.enabled, effect, "\n".join(about))
    return found


def line_width(context: Any) -> float:
    """Return the width of a line of the list of parameters, in pixels at scale 1."""
    return float(context.region.width / _derived("scale", lambda: context.preferences.system.ui_scale) - BESIDE)


@dataclass(frozen=True)
class Picture:
    """The picture of a target.

    Attributes
    ----------
    icon
        Number of the icon of its state.
    words
        Its name, or what is wrong with it.
    complete
        Whether camera and picture are there, and the object of a silhouette.
    camera
        Name of the camera.
    thumbnail
        Number of its icon; 0: there is none.
    size
        Width and height in words; empty: it is a movie, or can't be read.
    difference
        How its size differs from that of renders; empty: it does not.
    """

    icon: int
    words: str
    complete: bool
    camera: str
    thumbnail: int
    size: str
    difference: str


def picture(row: Any, scene: Any, count: int) -> Picture:
    """Return what is known of the picture of a target, one of `count`."""
    return _derived((pointer(row), STATUS.edits, count), lambda: _picture(row, scene))


def _picture(row: Any, scene: Any) -> Picture:
    camera = "no camera" if row.camera is None else row.camera.name
    icon, words = target_rows.state(row, scene)
    complete = row.camera is not None and not target_rows.problem_of(row) and not target_rows.lacks_object(row)
    size, rendered, shown, difference = target_rows.size_of(row), target_rows.render_size(scene), "", ""
    if size is not None:
        shown = f"{size[0]} × {size[1]}"
        if size == rendered:
            shown += ", as renders"
        else:
            aspect = "" if target_rows.has_aspect(row, scene) else "Of another aspect: "
            difference = f"{aspect}{'r' if aspect else 'R'}enders are {rendered[0]} × {rendered[1]}"
    return Picture(icons.number(icon if complete else "ERROR"), words, complete, camera, icons.thumbnail(row.image),
                   shown, difference)  # fmt: skip
