"""The surface of a field while it is fitted, as an object that is not rendered."""

from __future__ import annotations

from typing import Any

import bpy

import edgegrad

from ..write_back.new_object import fill

NAME = "Edgegrad preview"


class Preview:
    """An object with the newest surface; the old object is hidden in the viewport as long as it is there."""

    def __init__(self, context: Any, hidden: str) -> None:
        self._mesh: Any = None
        self._object: Any = None
        self._collection = context.scene.collection
        ob = context.view_layer.objects.get(hidden)
        self._hidden = None if ob is None or ob.hide_get() else ob

    def show(self, surface: edgegrad.Mesh) -> None:
        """Show this surface."""
        if self._object is None:
            self._mesh = bpy.data.meshes.new(NAME)
            self._object = bpy.data.objects.new(NAME, self._mesh)
            self._object.hide_render = self._object.hide_select = True
            self._collection.objects.link(self._object)
            if self._hidden is not None:
                self._hidden.hide_set(True)
        self._mesh.clear_geometry()
        fill(self._mesh, surface.vertices, surface.faces)

    def remove(self) -> None:
        """Remove the object, and show the old one again."""
        if self._object is None:
            return
        bpy.data.objects.remove(self._object)
        bpy.data.meshes.remove(self._mesh)
        self._object = self._mesh = None
        if self._hidden is not None:
            self._hidden.hide_set(False)
