"""Reading of targets: the pictures of a request become `edgegrad.Target`s of the exported scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import images
from edgegrad.fitting.targets import EXPOSURE, camera_for

from ..export import Export
from ..problem import Problem
from ..view_transforms import AUTO, view_of
from .calibrated_cameras import lens_of
from .frames import Stored, stored_datablock, stored_file


@dataclass
class Picture:
    """A target.

    Attributes
    ----------
    camera, image
        Name of the camera, and file of the picture or movie.
    mask
        File of the mask, whose black pixels are ignored; empty: none.
    view
        View transform that is undone in the picture (`view_transforms.view_of`).
    weight
        Weight among the targets.
    gain, shared
        Factor by which the picture is brighter than the scene, or how it is found (`edgegrad.Target`).
    alpha
        Meaning of the picture's alpha (`edgegrad.Target`).
    silhouette_of
        Names of objects or collections whose silhouette the picture is; empty: it is a picture.
    datablock
        Name of an image datablock, which replaces the file; empty: the file.
    frame
        Frame of a movie or sequence; None: the scene's current frame.
    time
        Frame of the timeline that the picture shows, in a fit of frames; None: the scene's current frame.
    """

    camera: str
    image: str
    mask: str = ""
    view: str = AUTO
    weight: float = 1.0
    gain: float | str = 1.0
    shared: str = ""
    alpha: str = "world"
    silhouette_of: tuple[str, ...] = ()
    datablock: str = ""
    frame: int | None = None
    time: int | None = None

    @property
    def name(self) -> str:
        """What the picture is called in messages."""
        return self.datablock or self.image


def read_picture(scene: Any, picture: Picture, camera: Any, view: edgegrad.Camera,
                 export: Export) -> tuple[edgegrad.Target, list[str]]:  # fmt: skip
    """Read a target of a camera object and its exported view, without the distortion of a calibrated lens.

    Returns
    -------
    The target, and notes for the user.

    Raises
    ------
    Problem, ValueError
        If something can't be read, or sizes do not fit; one sentence that names it.
    """
    frame = scene.frame_current if picture.frame is None else picture.frame
    if picture.datablock:
        stored = stored_datablock(picture.datablock, frame)
    elif not picture.image.strip():
        raise Problem(f"target of camera '{camera.name}': has no picture; choose one")
    else:
        stored = stored_file(absolute(picture.image), frame)
    where = f"target '{picture.name}' of camera '{picture.camera}'"
    notes: list[str] = []
    objects: list[str] | None = None
    image: NDArray[Any]
    weight: NDArray[Any] | None = None
    if picture.silhouette_of:
        image = _mask_of(stored)[..., None]
        objects = silhouette_objects(export, picture.silhouette_of)
    else:
        found, notes = _read_light(scene, picture, stored)
        image, weight = found.image, found.weight
    camera_for(where, view, image.shape[:2])
    if picture.mask:
        chosen = images.read_mask(absolute(picture.mask))
        high, wide = chosen.shape
        if not images.same_aspect(chosen.shape, image.shape):
            raise Problem(f"mask '{picture.mask}': is {wide} x {high} pixels, of another aspect than its picture of "
                          f"{image.shape[1]} x {image.shape[0]}; crop it alike")
        chosen = images.resample(chosen, (image.shape[0], image.shape[1]))
        weight = chosen if weight is None else weight * chosen
    lens = lens_of(camera)
    if lens is not None:
        image, weight = lens.of_size(image.shape[0], image.shape[1]).undistort(image, weight)
    if objects is not None:
        return edgegrad.Target(image[..., 0], view, weight, picture.weight, objects=objects), notes
    return edgegrad.Target(image, view, weight, picture.weight, picture.alpha, picture.gain, picture.shared), notes


def _read_light(scene: Any, picture: Picture, stored: Stored) -> tuple[images.TargetPicture, list[str]]:
    if stored.file is not None:
        transform, note = view_of(scene, stored.file, picture.view)
        return images.read_target(stored.file, transform), [note] if note else []
    assert stored.values is not None
    if stored.linear:
        return images.TargetPicture(np.asarray(stored.values, np.float32)), []
    transform = images.ViewTransform()
    if picture.view.upper() != AUTO:
        transform = view_of(scene, Path("codes.png"), picture.view)[0] or transform
    return images.target_of_codes(f"image '{picture.name}'", stored.values, transform), []


def _mask_of(stored: Stored) -> NDArray[Any]:
    if stored.file is not None:
        return images.read_mask(stored.file)
    assert stored.values is not None
    return images.mask_of(stored.values)


def silhouette_objects(export: Export, names: Sequence[str]) -> list[str]:
    """Return the names in the exported scene of objects, and of all objects of collections.

    Raises
    ------
    Problem
        If nothing of a name is rendered, or if an exported mesh is shared with an object that is not named.
    """
    chosen: set[str] = set()
    for name in names:
        collection = bpy.data.collections.get(name)
        members = {ob.name for ob in collection.all_objects} if collection else set()
        members = {name} if name in bpy.data.objects else members
        if not members:
            raise Problem(f"silhouette of '{name}': there is no such object, and no collection with objects")
        chosen |= members
    out = []
    for key, source in export.meshes.items():
        # What an instancer makes belongs to the instancer; a mesh that several objects share belongs to all of them.
        owners = set(source.objects) if source.holder in source.objects else {source.holder}
        if not owners & chosen:
            continue
        for other in sorted(owners - chosen):
            raise Problem(f"object '{other}': is rendered as one mesh with an object of the silhouette, but is not in "
                          "it; add it to the silhouette, or make its mesh single-user")
        out.append(key)
    if not out:
        raise Problem(f"silhouette of '{names[0]}': nothing of it is rendered (hidden, without faces, or outside the "
                      "view layer)")  # fmt: skip
    return out


def gain_note(picture: Picture, gain: NDArray[np.float64]) -> str:
    """Return a sentence on a gain that a fit has found, in stops as cameras have them."""
    if picture.gain == EXPOSURE:
        found = f"exposure {np.log2(gain[0]):+.2f} stops"
    else:
        found = "exposure of the channels " + ", ".join(f"{stops:+.2f}" for stops in np.log2(gain)) + " stops"
    return f"target '{picture.name}' of camera '{picture.camera}': found {found}"


def absolute(path: str) -> Path:
    """Resolve a path; // at the beginning means the folder of the .blend, as everywhere in Blender."""
    if not path.strip():
        raise Problem("a target has no picture; choose one")
    return Path(bpy.path.abspath(path))
