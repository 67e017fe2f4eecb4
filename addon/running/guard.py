"""What must stay as it was while a fit runs: the objects and values that it changes, and the cameras of its targets."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import bpy
import numpy as np

from ..export.geometry.mesh import positions
from ..session import Session

MODES = {"EDIT": "Edit Mode", "SCULPT": "Sculpt Mode"}


class Guard:
    """Compares Blender's data with those at the start of a fit.

    It is made after `Session.prepare` and holds references into Blender's data, which are valid until an undo or until
    another file is opened.
    """

    def __init__(self, session: Session, scene: Any) -> None:
        self._scene, self._scene_name = scene, scene.name
        self._frame = scene.frame_current
        self._names: list[tuple[str, str, int]] = []
        self._places: list[tuple[str, Any]] = []
        self._meshes: list[tuple[str, Any]] = []
        self._values: list[tuple[str, Callable[[], Any], Any]] = []
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
        for name in request.names.power:
            self._value(f"light '{name}'", partial(getattr, scene.objects[name].data, "energy"))
        for fieldname, names in (("base_color", request.names.base_color), ("emission_color", request.names.emission)):
            for name in dict.fromkeys(names):
                self._material(session.export.materials[name], fieldname)
        for one in () if session.driver is None else session.driver.parameters:
            self._value(f"property '{one.path}'", one.read)
        self._driven = session.driver is not None

    def problem(self) -> str | None:
        """Return what has changed, in words; None: nothing that matters."""
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

    def _value(self, label: str, read: Callable[[], Any]) -> None:
        self._values.append((label, read, np.array(read())))

    def _material(self, reading: Any, fieldname: str) -> None:
        material = bpy.data.materials.get(reading.material)
        if material is None:
            return
        self._names.append(("materials", material.name, material.session_uid))
        socket = getattr(reading, fieldname)
        if socket is None:
            self._value(f"material '{material.name}'", lambda: material.diffuse_color[:])
        else:
            self._value(f"material '{material.name}'", lambda: socket.find(material).default_value[:])


def _placed(ob: Any) -> tuple[Any, ...]:
    return tuple(tuple(row) for row in ob.matrix_basis)


def _missing(scene: Any, collection: str, name: str, uid: int) -> str | None:
    word = collection.removesuffix("s")
    held = scene.objects if collection == "objects" else getattr(bpy.data, collection)
    found = held.get(name)
    if found is not None and found.session_uid == uid:
        return None
    renamed = next((one.name for one in held if one.session_uid == uid), None)
    return f"{word} '{name}' was " + ("deleted" if renamed is None else f"renamed to '{renamed}'")
