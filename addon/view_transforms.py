"""The view transform of a target picture: chosen by the user, or known from the picture's origin."""

from __future__ import annotations

import importlib
import importlib.machinery
import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

import bpy

from edgegrad import images

from .problem import Problem

AUTO, SCENE, SRGB = "AUTO", "SCENE", "SRGB"
LIBRARY = "PyOpenColorIO"

VIEW_ITEMS = (
    (AUTO, "Automatic", "Renders that Blender saved: the scene's view transform; other pictures: sRGB; EXR: linear"),
    (SCENE, "Scene", "The view transform, look, exposure and gamma of this scene's color management"),
    (SRGB, "sRGB", "A photograph, or a picture that was saved with the view transform Standard"),
    ("AgX", "AgX", "AgX without a look"),
    ("Filmic", "Filmic", "Filmic without a look"),
    ("Khronos PBR Neutral", "Khronos PBR Neutral", "Khronos PBR Neutral without a look"),
)


def view_of(scene: Any, path: Path, choice: str) -> tuple[images.ViewTransform | None, str]:
    """Return the view transform of a picture file, None if it holds linear light, and a note for the user or "".

    Parameters
    ----------
    scene
        Blender's scene.
    path
        The picture.
    choice
        "AUTO": from the picture's origin; "SCENE": that of the scene; "SRGB"; or the name of one of Blender's view
        transforms. Capitals make no difference.

    Raises
    ------
    Problem, ValueError
        If the scene's settings can't be undone, or the file can't be read.
    """
    linear = path.suffix.lower() == ".exr"
    named = choice.upper()
    if named == AUTO:
        if linear:
            return None, ""
        settings = _settings(scene)
        if images.made_by_blender(path):
            transform = _of_scene(scene)
            return transform, f"image '{path.name}': Blender rendered it, so it is read with the view transform " \
                              f"'{transform.view}' of scene '{scene.name}'"  # fmt: skip
        note = ""
        if settings.view_transform != "Standard":
            note = (f"image '{path.name}': is read as sRGB, as a photograph; if Blender saved it with the scene's view "
                    f"transform '{settings.view_transform}', set its View to Scene (--view scene)")  # fmt: skip
        return images.ViewTransform(), note
    if named == SCENE:
        return (None if linear else _of_scene(scene)), ""
    if named == SRGB:
        return images.ViewTransform(), ""
    view = next((known for known in _views(scene) if known.lower() == choice.lower()), choice)
    return _with_library(images.ViewTransform(view=view, config=_config())), ""


def _of_scene(scene: Any) -> images.ViewTransform:
    """Return the view transform of renders that the scene saves."""
    where = f"scene '{scene.name}'"
    settings = _settings(scene)
    if settings.use_curve_mapping:
        raise Problem(f"{where}: its color management has curves, which can't be undone in a target; switch "
                      "'Use Curves' off and save the target again")  # fmt: skip
    if getattr(settings, "use_white_balance", False):
        raise Problem(f"{where}: its color management has a white balance, which can't be undone in a target; switch "
                      "it off and save the target again")  # fmt: skip
    display = (_override(scene) or scene).display_settings.display_device
    return _with_library(images.ViewTransform(settings.view_transform, settings.look, settings.exposure,
                                              settings.gamma, display, _config()))  # fmt: skip


def _settings(scene: Any) -> Any:
    return (_override(scene) or scene).view_settings


def _override(scene: Any) -> Any:
    output = scene.render.image_settings
    return output if getattr(output, "color_management", "") == "OVERRIDE" else None


def _views(scene: Any) -> list[str]:
    """List the view transforms of Blender's configuration. Blender names them only when it refuses another name."""
    settings = scene.view_settings
    try:
        settings.view_transform = "?"
    except TypeError as error:
        return [part for part in str(error).partition("not found in (")[2].split("'") if part.strip("(), ")]
    return []


def _config() -> str | None:
    """Path of the configuration that Blender uses; None: that of the environment variable OCIO."""
    if os.environ.get("OCIO"):
        return None
    for kind in ("LOCAL", "SYSTEM"):
        path = Path(bpy.utils.resource_path(kind)) / "datafiles" / "colormanagement" / "config.ocio"
        if path.is_file():
            return str(path)
    return None


def _with_library(transform: images.ViewTransform) -> images.ViewTransform:
    """Make OpenColorIO importable if the transform needs it: Blender has it, but bpy does not search its folder."""
    if not transform.plain and importlib.util.find_spec(LIBRARY) is None:
        folders = [str(p) for kind in ("LOCAL", "SYSTEM")
                   for p in Path(bpy.utils.resource_path(kind)).glob("python/lib*/**/site-packages")]  # fmt: skip
        spec = importlib.machinery.PathFinder.find_spec(LIBRARY, folders)
        if spec is not None and spec.loader is not None:
            module = importlib.util.module_from_spec(spec)
            sys.modules[LIBRARY] = module
            try:
                spec.loader.exec_module(module)
            except ImportError:  # built for another Python; `ViewTransform` names the cure
                del sys.modules[LIBRARY]
    return transform
