"""The rows of the scene's list of targets: their pictures' sizes beside those of the renders."""

from __future__ import annotations

import os
import stat
from pathlib import Path, PurePath
from typing import Any

import bpy

from edgegrad import images

from ..export.surroundings.camera import render_size
from .film_files import first_file, is_numbered
from .frames import is_movie

# Size by path, with the time and length of the file that it was read from.
_sizes: dict[str, tuple[tuple[float, int], tuple[int, int] | None]] = {}


def next_camera(scene: Any) -> Any:
    """Return the active camera, or else the next one of the scene, that has no target; None: each has one."""
    taken = {row.camera for row in scene.edgegrad.targets}
    cameras = [ob for ob in scene.objects if ob.type == "CAMERA"]
    if scene.camera is not None:
        cameras.sort(key=lambda ob: ob != scene.camera)  # sorting keeps the order of the others
    return next((ob for ob in cameras if ob not in taken), None)


def file_of(path: str) -> Path | None:
    """Return the file of a path of the list; None: it is empty or there is no such file."""
    found = _look_up(path)
    return None if found is None else found[0]


def picture_size(path: str) -> tuple[int, int] | None:
    """Return width and height of a picture; None: it can't be read. The file is read again when it has changed."""
    found = _look_up(path)
    return None if found is None else _size_of(*found)


def _look_up(path: str) -> tuple[Path, os.stat_result] | None:
    """Return file and state by one access to the disk."""
    if not path.strip():
        return None
    file = Path(bpy.path.abspath(path))
    if is_numbered(file.name):
        file = first_file(file)
    try:
        state = file.stat()
    except (OSError, ValueError):  # ValueError: a zero character
        return None
    return (file, state) if stat.S_ISREG(state.st_mode) else None


def _size_of(file: Path, status: os.stat_result) -> tuple[int, int] | None:
    state = status.st_mtime, status.st_size
    known = _sizes.get(str(file))
    if known is None or known[0] != state:
        try:
            height, width = images.image_size(file)
            known = state, (width, height)
        except ValueError:  # the fit itself says what is wrong with the file
            known = state, None
        _sizes[str(file)] = known
    return known[1]


def set_render_size(scene: Any, size: tuple[int, int]) -> None:
    """Make renders as large as a picture, with square pixels."""
    render = scene.render
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.use_border = False


def size_of(row: Any) -> tuple[int, int] | None:
    """Return width and height of a row's picture; None: it is a movie, or it can't be read."""
    if row.datablock is not None:
        wide, high = row.datablock.size
        return (wide, high) if wide and high else None
    return picture_size(row.image)


def fingerprint(row: Any) -> tuple[Any, ...]:
    """Return what a row's picture is, and the state that it is in; it differs after each change of the picture."""
    if row.datablock is not None:
        return row.datablock.name_full, *row.datablock.size
    found = _look_up(row.image)
    return (row.image,) if found is None else (row.image, found[1].st_mtime, found[1].st_size)


def problem_of(row: Any) -> str:
    """What keeps the picture of a row from being read, in words; empty: nothing is known."""
    if row.datablock is not None:
        return ""
    if not row.image.strip():
        return "no picture"
    found = _look_up(row.image)
    if found is None:
        return f"{_name(row)} is missing"
    return "" if is_movie(found[0]) or _size_of(*found) else f"{_name(row)} can't be read"


def lacks_object(row: Any) -> bool:
    """Whether a row is a silhouette of nothing."""
    return row.kind == "SILHOUETTE" and row.silhouette_object is None and row.silhouette_collection is None


def has_aspect(row: Any, scene: Any) -> bool:
    """Whether the picture of a row, as far as its size is known, has the aspect of renders."""
    size = size_of(row)
    return size is None or images.same_aspect(size[::-1], render_size(scene)[::-1])


def state(row: Any, scene: Any) -> tuple[str, str]:
    """Return icon and words for the picture of a row."""
    problem = problem_of(row)
    if problem:
        return "ERROR", problem
    return ("CHECKMARK" if has_aspect(row, scene) else "ERROR"), _name(row)


def _name(row: Any) -> str:
    return row.datablock.name if row.datablock is not None else PurePath(row.image.replace("\\", "/")).name
