"""What the panel derives from the file, such as names of properties and what is in the way of a fit.

Blender draws a panel at each move of the pointer over it. What it shows is therefore kept until Blender has evaluated
an edit. Pictures change without an edit: while a window shows the panel, a timer looks at them. Nothing is kept while
no window does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.app.handlers import persistent

from .. import preflight, quality
from .. import rows as parameter_rows
from ..export.surroundings.camera import render_size
from ..status import STATUS, redraw
from ..targets import rows as target_rows
from ..write_back.kept import TEXT
from . import icons
from .tab import Tab

SECONDS = 0.5  # between two looks at the pictures
# Of the list of parameters, in pixels at scale 1: what is beside the words and their icon; the icon with its margins;
# the mean width of a character; the width of a line below which values and the numbers of bars are left out.
BESIDE, ICON, CHARACTER, NARROW = 125, 26, 5.9, 184

# Lines of parameters by the pointers of their rows; pictures of targets by the pointers of their rows and their number;
# scenes by the pointers of their settings.
lines: dict[int, Line] = {}
_pictures: dict[tuple[int, int], Picture] = {}
_scenes: dict[int, Seen] = {}

# The pointer of Blender's data. As an attribute it would first be searched for among their properties and functions.
pointer: Callable[[Any], int] = bpy.types.bpy_struct.as_pointer


@dataclass(slots=True)
class Seen:
    """What the panel shows of a scene. All of it is in one place, since each draw finds the processor's caches empty.

    Attributes
    ----------
    targets, parameters
        Numbers of rows. Neither handlers nor updates of properties tell of removed rows.
    target
        The only target; None: it was not drawn, or there is another number of them.
    start
        What the start of a fit needs; None: it was not drawn.
    cost, said
        Of the status, for which that is.
    width
        Pixels of the region that lines of parameters were made for.
    """

    targets: int
    parameters: int
    target: Picture | None = None
    start: Start | None = None
    cost: float = 0.0
    said: str = ""
    width: float = 0.0


class _Looked:
    """What was there at the last look.

    Attributes
    ----------
    width
        Pixels of a line of the list of parameters, at scale 1.
    pictures
        State of the pictures of all targets.
    """

    width: float = NARROW
    pictures: object = None


@persistent
def forget(*_: Any) -> None:
    """Derive everything anew."""
    lines.clear()
    _pictures.clear()
    _scenes.clear()


@persistent
def _leave_file(*_: Any) -> None:
    """Forget the jobs of a file that is left. A job that still runs is ended after this, and says so."""
    STATUS.forget()


def _see(settings: Any, before: Seen | None) -> Seen:
    """See a scene; forget what is kept if it was seen with other rows."""
    if before is not None:
        forget()
    found = _scenes[pointer(settings)] = Seen(len(settings.targets), len(settings.parameters))
    return found


def see_targets(settings: Any, count: int) -> Seen:
    """Return what the panel shows of a scene with a number of targets."""
    found = _scenes.get(pointer(settings))
    return found if found is not None and found.targets == count else _see(settings, found)


def see_rows(settings: Any, count: int, width: float) -> None:
    """See a scene with a number of parameters, whose lines fit into a region of a width in pixels."""
    found = _scenes.get(pointer(settings))
    if found is None or found.parameters != count:
        found = _see(settings, found)
    if found.width != width:
        lines.clear()
        for one in _scenes.values():
            one.width = 0.0
        found.width = width
        _Looked.width = width / (bpy.context.preferences.system.ui_scale or 1.0) - BESIDE  # 0: there is no window


def see_pictures() -> float:
    """Forget what is kept, and draw the panel, if pictures have changed; return the seconds to the next call."""
    if not is_shown():
        forget()
        return SECONDS
    manager = bpy.context.window_manager
    scenes = {window.scene for window in manager.windows} if manager is not None else set()
    pictures = {(scene.name_full, k): target_rows.fingerprint(row) for scene in scenes
                for k, row in enumerate(scene.edgegrad.targets)}  # fmt: skip
    if pictures != _Looked.pictures:
        _Looked.pictures = pictures
        forget()
        redraw()
    return SECONDS


def is_shown() -> bool:
    """Return whether a window shows the tab. Its draws do not note it, since they come much more often."""
    manager = bpy.context.window_manager
    return any(getattr(region, "active_panel_category", Tab.bl_category) == Tab.bl_category
               for window in (() if manager is None else manager.windows) for area in window.screen.areas
               if area.type == Tab.bl_space_type and area.spaces.active.show_region_ui
               for region in area.regions if region.type == Tab.bl_region_type)  # fmt: skip


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
    _Looked.pictures = None
    forget()


@dataclass(frozen=True, slots=True)
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
    film
        Whether the frames of movies are fitted.
    """

    obstacle: preflight.Obstacle | None
    quality: str
    label: str
    kept: bool
    film: bool


def start(context: Any, settings: Any) -> Start:
    """Return what the start of a fit with a scene's settings needs."""
    seen = _scenes.get(pointer(settings))
    if seen is None or seen.targets != len(settings.targets) or seen.parameters != len(settings.parameters):
        seen = _see(settings, seen)
    # The end of a job may have changed what the file keeps.
    if seen.start is None or seen.cost != STATUS.cost or seen.said != STATUS.said:
        seen.start, seen.cost, seen.said = _start(context, settings), STATUS.cost, STATUS.said
    return seen.start


def _start(context: Any, settings: Any) -> Start:
    known = quality.time_to_go(settings, STATUS.cost)
    return Start(preflight.obstacle(context), f"Quality: {quality.QUALITIES[settings.quality].label}",
                 f"Fit   ({known})" if known else "Fit", TEXT in bpy.data.texts, settings.use_frames)  # fmt: skip


@dataclass(frozen=True, slots=True)
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
        narrow, effect, value = _Looked.width < NARROW, row.sensitivity, parameter_rows.value_text(row, whole=True)
        share = 0.76 if not narrow else 0.93 if effect >= 0.0 else 1.0
        icon, name, words = parameter_rows.names(row, int((_Looked.width * share - ICON) / CHARACTER))
        about = [name, f"Value: {value}"]
        if effect >= 0.0:
            about.append(f"Effect on the loss: {effect:.0%} of the largest")
        beside = "" if narrow else f"{effect:.0%}" if effect >= 0.0 else parameter_rows.value_text(row)
        found = lines[key] = Line(icons.number(icon), words, beside, share, row.enabled, effect, "\n".join(about))
    return found


@dataclass(frozen=True, slots=True)
class Picture:
    """The picture of a target.

    Attributes
    ----------
    icon
        Number of the icon of its state.
    words
        Its name, or what is wrong with it.
    title
        The same with its camera.
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
    title: str
    complete: bool
    camera: str
    thumbnail: int
    size: str
    difference: str


def only_target(seen: Seen, scene: Any) -> Picture:
    """Return what is known of the picture of a scene's only target."""
    if seen.target is None:
        seen.target = _picture(scene.edgegrad.targets[0], scene)
    return seen.target


def picture(row: Any, scene: Any, count: int) -> Picture:
    """Return what is known of the picture of a target, one of `count`."""
    key = pointer(row), count
    found = _pictures.get(key)
    if found is None:
        found = _pictures[key] = _picture(row, scene)
    return found


def _picture(row: Any, scene: Any) -> Picture:
    camera = "no camera" if row.camera is None else row.camera.name
    icon, words = target_rows.state(row, scene)
    complete = row.camera is not None and not target_rows.problem_of(row) and not target_rows.lacks_object(row)
    size, rendered, shown, difference = target_rows.size_of(row), render_size(scene), "", ""
    if size is not None:
        shown = f"{size[0]} × {size[1]}"
        if size == rendered:
            shown += ", as renders"
        else:
            aspect = "" if target_rows.has_aspect(row, scene) else "Of another aspect: "
            difference = f"{aspect}{'r' if aspect else 'R'}enders are {rendered[0]} × {rendered[1]}"
    return Picture(icons.number(icon if complete else "ERROR"), words, f"{camera}: {words}", complete, camera,
                   icons.thumbnail(row.image), shown, difference)  # fmt: skip
