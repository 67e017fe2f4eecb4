"""What must stay as it was while a fit runs: the objects and values that it changes, and the cameras of its targets."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import bpy
import numpy as np

from ..export.geometry.mesh import positions
from ..export.surroundings.camera import PANORAMA_NUMBERS, panorama_settings, render_size
from ..session import Session
from ..write_back.image_buffer import pixels_of

MODES = {"EDIT": "Edit Mode", "SCULPT": "Sculpt Mode"}
# How much longer than a look at an image's pixels two looks must be apart.
SHARE = 50.0


class Guard:
    """Compares Blender's data with those at the start of a fit.

    It is made after `Session.prepare` and holds references into Blender's data, which are valid until an undo or until
    another file is opened.
    """

    def __init__(self, session: Session, scene: Any) -> None:
        self._scene, self._scene_name = scene, scene.name
        self._frame, self._size = scene.frame_current, render_size(scene)
        self._names: list[tuple[str, str, int]] = []
        self._places: list[tuple[str, Any]] = []
        self._meshes: list[tuple[str, Any]] = []
        self._values: list[tuple[str, Callable[[], Any], Any]] = []
        self._images: dict[str, tuple[tuple[str, ...], bytes]] = {}
        self._due = 0.0  # when pixels are looked at again
        request = session.request
        as_field = [] if request.field is None else [request.field.object]
        shaped = list(dict.fromkeys((*request.names.vertices, *as_field)))
        cameras = [picture.camera for picture in request.pictures]
        for name in dict.fromkeys((*shaped, *request.names.power, *cameras)):
            ob = scene.objects[name]
            self._names.append(("objects", name, ob.session_uid))
            if name in shaped or name in cameras:
                self._places.append((name, _placed(ob)))
        for name in (name for name in shaped if scene.objects[name].type == "MESH"):
            self._meshes.append((name, positions(scene.objects[name].data).copy()))
        for name in dict.fromkeys(cameras):
            self._value(f"the lens of camera '{name}'", partial(_lens, scene.objects[name]))
        for name in request.names.power:
            self._value(f"light '{name}'", partial(getattr, scene.objects[name].data, "energy"))
        for fieldname, word, names in (("base_color", "base color", request.names.base_color),
                                       ("emission_color", "emission", request.names.emission)):  # fmt: skip
            for name in dict.fromkeys(names):
                self._material(session.export.materials[name], fieldname, word)
        for name in dict.fromkeys(request.names.image):
            image = bpy.data.images[name]
            self._names.append(("images", name, image.session_uid))
            self._images[name] = _settings_of(image), _digest(image)
        for one in () if session.driver is None else session.driver.parameters:
            self._value(f"property '{one.path}'", one.read)
        self._driven = session.driver is not None

    def problem(self, last: bool = False) -> str | None:
        """Return what has changed, in words; None: nothing that matters.

        Pixels of images are looked at now and then, since it takes long, and if this is the `last` call of a fit.
        """
        if bpy.data.scenes.get(self._scene_name) != self._scene:
            return f"scene '{self._scene_name}' was deleted or renamed"
        for collection, name, uid in self._names:
            found = _missing(self._scene, collection, name, uid)
            if found is not None:
                return found
        for name, _ in self._meshes:
            mode = MODES.get(self._scene.objects[name].mode)
            if mode is not None:
                return f"object '{name}' was put into {mode}"
        for name, before in self._meshes:
            now = positions(self._scene.objects[name].data)
            if now.shape != before.shape or not np.array_equal(now, before, equal_nan=True):
                return f"the mesh of object '{name}' was edited"
        found = self._repainted(last)
        if found is not None:
            return found
        if self._driven and render_size(self._scene) != self._size:
            return "the size of renders was changed"
        if self._scene.frame_current != self._frame:
            # Animated things are elsewhere in this frame. Only properties are evaluated while the fit runs.
            return "the frame was changed" if self._driven else None
        for name, before in self._places:
            if _placed(self._scene.objects[name]) != before:
                return f"object '{name}' was moved"
        for label, read, before in self._values:
            try:
                now = read()
            except (ReferenceError, AttributeError, LookupError, RuntimeError):
                return f"{label} was removed"
            if not np.array_equal(now, before, equal_nan=True):
                return f"{label} was changed"
        return None

    def _repainted(self, last: bool) -> str | None:
        began = time.monotonic()
        looks = last or began >= self._due
        for name, (settings, digest) in self._images.items():
            image = bpy.data.images[name]
            if _settings_of(image) != settings or (looks and _digest(image) != digest):
                return f"image '{name}' was changed"
        if not looks:
            return None
        ended = time.monotonic()
        self._due = ended + SHARE * (ended - began)
        return None

    def _value(self, label: str, read: Callable[[], Any]) -> None:
        self._values.append((label, read, np.array(read())))

    def _material(self, reading: Any, fieldname: str, word: str) -> None:
        material = bpy.data.materials.get(reading.material)
        if material is None:
            return
        self._names.append(("materials", material.name, material.session_uid))
        socket, label = getattr(reading, fieldname), f"the {word} of material '{material.name}'"
        if socket is None:
            self._value(label, lambda: material.diffuse_color[:])
        else:
            self._value(label, lambda: socket.find(material).default_value[:])


def _settings_of(image: Any) -> tuple[str, ...]:
    """What the colors of an image depend on but its pixels."""
    return (image.source, image.alpha_mode, image.colorspace_settings.name, *map(str, image.size))


def _digest(image: Any) -> bytes:
    return hashlib.blake2b(pixels_of(image).data, digest_size=16).digest()


def _placed(ob: Any) -> tuple[Any, ...]:
    return tuple(tuple(row) for row in ob.matrix_basis)


def _lens(camera: Any) -> tuple[float, ...]:
    """Return the numbers that tell where in a picture the camera sees a point."""
    data = camera.data
    kinds = data.bl_rna.properties["type"].enum_items
    numbers = (kinds.find(data.type), data.lens, data.ortho_scale, data.shift_x, data.shift_y, data.sensor_width,
               data.sensor_height)  # fmt: skip
    if data.type != "PANO":
        return numbers
    panorama = panorama_settings(data)
    types = panorama.bl_rna.properties["panorama_type"].enum_items
    return (*numbers, types.find(panorama.panorama_type), *(getattr(panorama, name) for name in PANORAMA_NUMBERS))


def _missing(scene: Any, collection: str, name: str, uid: int) -> str | None:
    word = collection.removesuffix("s")
    held = scene.objects if collection == "objects" else getattr(bpy.data, collection)
    found = held.get(name)
    if found is not None and found.session_uid == uid:
        return None
    renamed = next((one.name for one in held if one.session_uid == uid), None)
    return f"{word} '{name}' was " + ("deleted" if renamed is None else f"renamed to '{renamed}'")
