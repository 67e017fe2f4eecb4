"""Targets on the command line: options, and the pictures that they describe."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import bpy

from edgegrad.fitting.targets import AS_MASK, EXPOSURE, OVER_WORLD, WHITE_BALANCE

from ..problem import Problem
from ..view_transforms import AUTO
from .calibrated_cameras import CLIP, Imported, add_calibration
from .pictures import Picture

T = TypeVar("T")

# Largest exposure in stops, and words for exposures that are found.
MOST_STOPS = 32.0
FOUND = {"fit": EXPOSURE, "balance": WHITE_BALANCE}

OPTIONS = {
    "target": ("CAMERA=FILE", "target picture or movie of a camera; names may contain ="),
    "cameras": ("FILE", "calibration whose cameras are added to the scene, with their pictures as targets: "
                "transforms.json of NeRF, the folder of COLMAP's text model, or clip:NAME:STEP, each STEP-th frame of "
                "a solved movie clip"),
    "mask": ("CAMERA=FILE", "mask of a camera's target: black pixels are ignored"),
    "silhouette": ("CAMERA=FILE", "mask that the silhouette of the objects of --silhouette-of should match"),
    "silhouette-of": ("NAME", "object or collection of the silhouettes"),
    "view": ("[CAMERA=]VIEW", "view transform of the targets, or of one: auto (default), scene, sRGB, Standard, AgX, "
             "Filmic or another of Blender's"),
    "exposure": ("[CAMERA=]STOPS", "by how many stops the targets, or one, are brighter than the scene; fit: an "
                 "unknown exposure; balance: one of each channel; fit:NAME or balance:NAME: one for all targets with "
                 "this NAME (default: 0)"),
    "alpha": ("[CAMERA=]world|mask", "whether transparent pixels show the world (default) or are ignored"),
    "weight": ("[CAMERA=]W", "weight of the targets, or of one (default: 1)"),
    "frame": ("[CAMERA=]N", "frame of targets that are movies (default: the scene's current one)"),
}  # fmt: skip


def add_arguments(fit: argparse.ArgumentParser) -> None:
    """Add the options of targets to a command."""
    for option, (metavar, text) in OPTIONS.items():
        fit.add_argument(f"--{option}", action="append", default=[], metavar=metavar, help=text)


def has_targets(arguments: argparse.Namespace) -> bool:
    """Whether the arguments name targets.

    Raises
    ------
    Problem
        If they do not, but have an option that describes one; names it.
    """
    if arguments.target or arguments.silhouette or arguments.cameras:
        return True
    for option in OPTIONS:
        texts = getattr(arguments, option.replace("-", "_"))
        if texts:
            raise Problem(f"--{option} '{texts[0]}': there is no target that it belongs to; name one by --target, "
                          "--cameras or --silhouette")  # fmt: skip
    return False


def pictures(arguments: argparse.Namespace) -> list[Picture]:
    """Return the targets of the arguments, for the open scene.

    Raises
    ------
    Problem
        For a wrong option; names it.
    """
    imported = [one for text in arguments.cameras for one in _imported(text)]
    there = [one for one in imported if one.image.is_file()]
    targets, masks = by_camera("--target", arguments.target), by_camera("--mask", arguments.mask)
    targets = {**{one.camera.name: str(one.image) for one in there}, **targets}
    outlines = by_camera("--silhouette", arguments.silhouette)
    if not targets and not outlines:
        raise Problem(f"--cameras '{arguments.cameras[0]}': none of its pictures is there; put them beside the "
                      "calibration, or name them by --target")  # fmt: skip
    if outlines and not arguments.silhouette_of:
        raise Problem("--silhouette: name the objects or collections that it shows by --silhouette-of NAME")
    if arguments.silhouette_of and not outlines:
        raise Problem(f"--silhouette-of '{arguments.silhouette_of[0]}': there is no --silhouette CAMERA=FILE")
    for camera in masks:
        if camera not in targets:
            raise Problem(f"--mask '{camera}={masks[camera]}': camera '{camera}' has no --target")
    views = _each("--view", arguments.view, targets, str, AUTO)
    gains = _each("--exposure", arguments.exposure, targets, _gain, (1.0, ""))
    alphas = _each("--alpha", arguments.alpha, targets, _alpha, OVER_WORLD)
    everywhere = {**targets, **outlines}
    weights = _each("--weight", arguments.weight, everywhere, _weight, 1.0)
    frames: dict[str, int | None] = _each("--frame", arguments.frame, everywhere, _frame, None)
    frames = {**frames, **{one.camera.name: one.frame for one in there if frames[one.camera.name] is None}}
    out = [
        Picture(camera, path, masks.get(camera, ""), views[camera], weights[camera], *gains[camera], alphas[camera],
                frame=frames[camera]) for camera, path in targets.items()
    ]  # fmt: skip
    of = tuple(arguments.silhouette_of)
    return out + [Picture(camera, path, weight=weights[camera], frame=frames[camera], silhouette_of=of)
                  for camera, path in outlines.items()]  # fmt: skip


def _imported(text: str) -> list[Imported]:
    """Add the cameras of a calibration; clips may have a step: clip:NAME:STEP."""
    name, _, step = text.rpartition(":")
    if text.startswith(CLIP) and name.startswith(CLIP) and step.isdecimal():
        return add_calibration(bpy.context.scene, name, int(step))
    return add_calibration(bpy.context.scene, text)


def by_camera(option: str, texts: Sequence[str], what: str = "FILE") -> dict[str, str]:
    """Split texts of the form CAMERA=FILE; names of cameras and of files may contain "="."""
    cameras = sorted((ob.name for ob in bpy.context.scene.objects if ob.type == "CAMERA"), key=len, reverse=True)
    out: dict[str, str] = {}
    for text in texts:
        named = next((name for name in cameras if text.startswith(f"{name}=")), text.partition("=")[0])
        camera, path = named, text[len(named) + 1 :]
        if not camera or not path:
            raise Problem(f"{option} '{text}': must have the form CAMERA={what}")
        if camera in out:
            raise Problem(f"{option} '{text}': camera '{camera}' already has a {option.removeprefix('--')}")
        out[camera] = path
    return out


def _each(option: str, texts: Sequence[str], targets: Mapping[str, str], read: Callable[[str], T], default: Any
          ) -> dict[str, T]:  # fmt: skip
    """Return the value of each target; one without a camera is that of all others."""
    name = option.removeprefix("--").upper()

    def value(text: str, shown: str) -> T:
        try:
            return read(text)
        except ValueError as error:
            raise Problem(f"{option} '{shown}': {error}") from None

    general = [text for text in texts if "=" not in text]
    if len(general) > 1:
        raise Problem(f"{option} '{general[1]}': {option} '{general[0]}' is given too; name a camera, as CAMERA={name}")
    own = by_camera(option, [text for text in texts if "=" in text], name)
    for camera, text in own.items():
        if camera not in targets:
            raise Problem(f"{option} '{camera}={text}': camera '{camera}' has no --target")
    others = value(general[0], general[0]) if general else default
    return {camera: value(own[camera], f"{camera}={own[camera]}") if camera in own else others for camera in targets}


def _gain(text: str) -> tuple[float | str, str]:
    word, _, name = text.partition(":")
    if word.lower() in FOUND:
        return FOUND[word.lower()], name
    try:
        stops = float(text)
    except ValueError:
        stops = float("nan")
    if not abs(stops) <= MOST_STOPS:
        raise ValueError(f"must be a number of stops from -{MOST_STOPS:g} to {MOST_STOPS:g}, fit, balance, fit:NAME or "
                         "balance:NAME")  # fmt: skip
    return 2.0**stops, ""


def _alpha(text: str) -> str:
    if text.lower() not in (OVER_WORLD, AS_MASK):
        raise ValueError(f"must be {OVER_WORLD} or {AS_MASK}")
    return text.lower()


def _frame(text: str) -> int:
    if not text.isdecimal():
        raise ValueError("must be a whole number, the frame of a movie")
    return int(text)


def _weight(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise ValueError("must be a number above 0")
    return value
