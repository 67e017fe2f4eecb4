"""The parameters of a fit in Blender's terms, and the places where their values are read and written."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad.scene import parameters as values

from .export import Export
from .export.nodes.images import name_of_codes
from .export.surroundings.directed_lamps import LIGHT
from .problem import Problem
from .write_back.destinations import Destination, LightPower, MaterialValue, PixelsOf, VerticesOf
from .write_back.held import Held
from .write_back.image_pixels import exported_image, find_image
from .write_back.values import check_light, check_material, find_material
from .write_back.vertices import MovedByModifiers, check_vertices


@dataclass
class Names:
    """Names of the objects, materials and lights whose values a fit may change.

    Attributes
    ----------
    vertices
        Names of mesh objects.
    base_color, emission
        Names of materials.
    power
        Names of light objects; the parameter is the power, or the strength of a sun.
    image
        Names of images; the parameter is all their pixels.
    """

    vertices: tuple[str, ...] = ()
    base_color: tuple[str, ...] = ()
    emission: tuple[str, ...] = ()
    power: tuple[str, ...] = ()
    image: tuple[str, ...] = ()

    def check_objects(self, scene: Any, in_place: bool) -> None:
        """Raise `Problem` for objects whose vertices, in renders of the scene, cannot be fitted."""
        for name in dict.fromkeys(self.vertices):
            ob = bpy.data.objects.get(name)
            if ob is None:
                raise Problem(f"object '{name}': there is no such object")
            check_vertices(ob, scene, in_place)

    def with_controls(self, scene: Any, in_place: bool, animated: bool) -> tuple[Names, tuple[str, ...]]:
        """Return the names without the objects whose vertices are fitted under their modifiers, and these objects.

        If properties are fitted too (`animated`), which may move the same vertices, all objects without shape keys are
        fitted so.
        """
        controls = []
        for name in dict.fromkeys(self.vertices):
            try:
                replace(self, vertices=(name,)).check_objects(scene, in_place)
            except MovedByModifiers:
                controls.append(name)
            else:
                if animated and bpy.data.objects[name].data.shape_keys is None:
                    controls.append(name)
        return replace(self, vertices=tuple(name for name in self.vertices if name not in controls)), tuple(controls)

    def paths(self, export: Export, may_be_empty: bool = False) -> list[str]:
        """Return the parameter paths in the exported scene; there may be none if `may_be_empty`.

        Raises
        ------
        Problem
            If the scene has no such object, material or light, or if its value cannot be written.
        """
        out = [self._mesh_path(name, export) for name in self.vertices]
        for fieldname, names in (("base_color", self.base_color), ("emission", self.emission)):
            for name in names:
                if name not in export.materials:
                    problem = _among("no object that is rendered uses it", export.materials)
                    raise Problem(f"material '{name}': {problem}")
                check_material(export.materials[name], name, fieldname)
                # `caustics.drop_caustics` replaces the colours of metal and glass by expressions.
                if fieldname in getattr(export.scene.materials[name], "textures", ()):
                    raise Problem(f"material '{name}': its {fieldname.replace('_', ' ')} is not one value in the "
                                  "picture while caustics are off; switch them on in the render settings")
                out.append(f"materials.{name}.{fieldname}")
        for name in self.power:
            light = export.scene.lights.get(name)
            if any(source.object == name and source.part == LIGHT for source in export.meshes.values()):
                raise Problem(f"light '{name}': its nodes make it shine differently in different directions, so its "
                              "power can't be fitted; unlink them, or fit another light")
            if light is None:
                raise Problem(f"light '{name}': {_among('no light of this name is rendered', export.lights)}")
            check_light(bpy.data.objects.get(name), name)
            out.append(f"lights.{name}.{'strength' if isinstance(light, edgegrad.SunLight) else 'power'}")
        out += [f"images.{exported_image(name, export.scene.images)}.pixels" for name in self.image]
        if not out and not may_be_empty:
            raise Problem("no parameter is chosen; choose at least one, such as the vertices of an object")
        return list(dict.fromkeys(out))

    @staticmethod
    def _mesh_path(name: str, export: Export) -> str:
        exported = [key for key, source in export.meshes.items() if name in source.objects]
        if not exported:
            raise Problem(f"object '{name}': isn't rendered (hidden, without faces, or outside the view layer); show "
                          "it in renders, or leave it out")
        if any(export.meshes[key].part for key in exported):
            raise Problem(f"object '{name}': has hair, which would not follow its vertices; switch its hair off")
        if export.meshes[exported[0]].displaced:
            raise Problem(f"object '{name}': its material displaces its vertices, so they can't be fitted; "
                          "set the displacement of the material to bump only")
        if len(exported) > 1 or export.meshes[exported[0]].instance:
            raise Problem(f"object '{name}': is instanced; the vertices of instances can't be fitted in this version; "
                          "make its instances real")
        return f"meshes.{exported[0]}.vertices"


def destination(export: Export, path: str, in_place: bool) -> Destination:
    """Return where the value of a parameter goes in Blender's data."""
    collection, name, fieldname = values.split(path)
    if collection == "meshes":
        source = export.meshes[name]
        # Transform from Blender's object space to the space of the exported vertices, which may have a transform.
        matrix = np.linalg.inv(export.scene.meshes[name].transform) @ source.matrix
        return VerticesOf.of(bpy.data.objects[source.object], matrix, in_place)
    if collection == "materials":
        reading = export.materials[name]
        return MaterialValue(Held.of("materials", find_material(name)), reading, fieldname, unit(export, path))
    if collection == "images":
        image = find_image(name)
        codes = image is None
        if codes:
            image = next(one for one in bpy.data.images if name_of_codes(one.name_full) == name)
        return PixelsOf(Held.of("images", image), codes)
    return LightPower(Held.of("objects", bpy.data.objects[name]), unit(export, path))


def write(export: Export, path: str, before: Any, after: Any, in_place: bool) -> None:
    """Write the value `after` of a parameter into Blender's data; `before` is its value at the export."""
    found = destination(export, path, in_place)
    found.check()
    found.write(before, after)


def unit(export: Export, path: str) -> float:
    """Value in the exported scene of one unit in Blender: emitted light is multiplied by the film exposure."""
    collection, _, fieldname = values.split(path)
    emits = collection == "lights" or fieldname == "emission"
    return export.settings.exposure if emits else 1.0


def _among(problem: str, known: Any) -> str:
    names = ", ".join(f"'{name}'" for name in known) or "none"
    return f"{problem} (known: {names})"
