"""Replaces an object of an exported scene by a distance field, and makes the result an object of Blender."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import FieldSteps, distance_fields

from ..export import Export
from ..export.scene import NO_MATERIAL
from ..problem import Problem
from ..write_back.held import Held
from ..write_back.new_object import check_object, make_object
from . import start_shapes
from .fitted_values import FittedValues, fit_values
from .plain_material import plain_material

SHAPE, BALL = "SHAPE", "BALL"
# Cells around the box of a shape, into which it may grow.
ROOM = 4
# Iterations between two meshes for the viewport.
PREVIEW_EVERY = 5


@dataclass(frozen=True)
class FieldRequest:
    """An object to fit as a distance field.

    Attributes
    ----------
    object
        Its name: an object with a surface, or an empty that shows a cube, the box of the field.
    resolution
        Number of cells along the longest side.
    start
        "SHAPE": the fit begins with the object's shape; "BALL": with a ball in its box, as for empties.
    values
        Fields of its material that are fitted too, where they vary (`fitted_values.WORDS`).
    """

    object: str
    resolution: int = 64
    start: str = SHAPE
    values: tuple[str, ...] = ()


@dataclass
class Replacement:
    """A field in an exported scene, in place of an object.

    Attributes
    ----------
    object
        Name of Blender's object at the beginning.
    held
        The object.
    start
        The field at the start.
    steps
        How the fit changes it.
    fitted
        Values of its material that are fitted too; None: there are none.
    notes
        Sentences on what the field lacks of the object.
    newest
        The newest mesh for the viewport, while `live`; None: there is none yet.
    live
        Whether such meshes are made while the fit runs.
    """

    object: str
    held: Held
    start: edgegrad.Field
    steps: FieldSteps
    fitted: FittedValues | None = None
    notes: list[str] = field(default_factory=list)
    live: bool = False
    newest: edgegrad.Mesh | None = None

    @property
    def path(self) -> str:
        """Path of the coefficients in the exported scene."""
        return f"fields.{self.object}.values"

    @property
    def attributes(self) -> dict[str, str]:
        """Paths of the fitted attributes in the exported scene -> their names."""
        names = () if self.fitted is None else self.fitted.grids
        return {f"fields.{self.object}.attributes.{name}": name for name in names}

    def take(self, values: Mapping[str, Any]) -> None:
        """Take the fitted attributes over from the values of a fit, for the objects that are made from now on."""
        found = {name: np.asarray(values[path]) for path, name in self.attributes.items()}
        self.start = replace(self.start, attributes=found)

    def tell(self, step: edgegrad.FitStep) -> None:
        """Make a mesh for the viewport every few iterations. The thread of the fit calls it."""
        if self.live and (step.iteration - 1) % PREVIEW_EVERY == 0:
            # A field may be without a surface for a step.
            with contextlib.suppress(ValueError):
                self.newest = self.mesh(step.values[self.path])

    def mesh(self, values: NDArray[Any]) -> edgegrad.Mesh:
        """Return the surface of the field with these coefficients, in world space."""
        return distance_fields.to_mesh(replace(self.start, values=np.asarray(values)), open_border=True,
                                       most_memory=start_shapes.MOST_MEMORY)  # fmt: skip

    def check(self) -> None:
        """Raise `Problem` unless the object can be replaced as it is now (`write_back.destinations.Destination`)."""
        check_object(self.held.get())

    def write(self, before: NDArray[Any], after: NDArray[Any]) -> None:
        """Make a new object from the fitted coefficients; keep and hide the old one."""
        surface = self.mesh(after)
        make_object(self.held.get(), surface.vertices, surface.faces, *self._painted(surface))

    def entry(self, before: NDArray[Any], after: NDArray[Any]) -> dict[str, Any]:
        """Return the surface in world space, from which an object can be made later."""
        surface = self.mesh(after)
        layers, material = self._painted(surface)
        return {"surface": self.held.name_now, "points": np.round(surface.vertices, 9).tolist(),
                "triangles": surface.faces.tolist(),
                "layers": {name: np.round(values, 6).tolist() for name, values in layers.items()},
                "material": material}

    def _painted(self, surface: edgegrad.Mesh) -> tuple[dict[str, NDArray[Any]], str | None]:
        """Return the fitted values at the vertices of a surface, and the material that they replace."""
        if self.fitted is None:
            return {}, None
        layers = dict[str, NDArray[Any]]()
        for name, corners in surface.attributes.items():
            layers[name] = np.zeros((len(surface.vertices), corners.shape[2]))
            layers[name][surface.faces] = corners
        return layers, self.fitted.material


def replace_by_field(scene: Any, export: Export, request: FieldRequest) -> Replacement:
    """Replace the object in the exported scene by a field, or add the field of an empty's box.

    Parameters
    ----------
    scene
        Blender's scene.
    export
        Its export, which is changed.
    request
        The object and the options.

    Raises
    ------
    Problem
        If there is no such object, or if it cannot be a field.
    """
    name = request.object
    where = f"object '{name}'"
    ob = scene.objects.get(name)
    if ob is None:
        raise Problem(f"{where}: there is no such object in scene '{scene.name}'; name one of its objects")
    if ob.library is not None or ob.override_library is not None:
        raise Problem(f"{where}: is linked from another file, so it can't be replaced; make it local first")
    check_object(ob)
    notes: list[str] = []
    exported: str | None = None
    if ob.type == "EMPTY" and ob.instance_type != "COLLECTION":
        export.scene.materials = {**export.scene.materials}
        export.scene.materials.setdefault(NO_MATERIAL, edgegrad.Material())
        box = start_shapes.box_of_empty(ob)
        found = start_shapes.ball_in(box, request.resolution, NO_MATERIAL, where)
    else:
        key = _exported_as(ob, export)
        mesh = export.scene.meshes[key]
        exported, material, notes = _material(export.scene, mesh, where)
        if request.start == BALL:
            box = start_shapes.box_around(mesh)
            found = start_shapes.ball_in(box, request.resolution, material, where)
        else:
            found, more = start_shapes.shape_of(mesh, request.resolution, where)
            notes += more
            found = start_shapes.with_room(replace(found, material=material), ROOM)
            start_shapes.check_memory(found.cells, where)
        found = replace(found, visible_to=mesh.visible_to)
        export.scene.meshes = {one: other for one, other in export.scene.meshes.items() if one != key}
        del export.meshes[key]
    fitted = None
    if request.values:
        found, fitted = fit_values(export, found, exported, request.values, where)
    if ob.animation_data is not None or ob.constraints:
        notes.append(f"{where}: its animation and its constraints are not carried over to the new object, which stays "
                     "where the old one is at this frame")  # fmt: skip
    if name in export.scene.meshes:
        raise Problem(f"{where}: another mesh is exported under its name; rename the object")
    export.scene.fields = {**export.scene.fields, name: found}
    count, needed = " x ".join(str(n) for n in found.cells), start_shapes.needed_memory(found.cells)
    notes.append(f"{where}: is fitted as a field of {count} cells, which needs up to about {needed / 1e9:.2g} GB")
    from_ball = request.start == BALL or ob.type == "EMPTY"
    coarser = start_shapes.coarser_grids(found) if from_ball else 0
    steps = FieldSteps(coarser=coarser, most_memory=start_shapes.MOST_MEMORY)
    return Replacement(name, Held.of("objects", ob), found, steps, fitted, notes)


def _exported_as(ob: Any, export: Export) -> str:
    """Return the name of the object's mesh in the exported scene."""
    where = f"object '{ob.name}'"
    exported = [key for key, source in export.meshes.items() if ob.name in source.objects]
    if not exported:
        raise Problem(f"{where}: has no surface that is rendered (hidden, without faces, or outside the view layer); "
                      "show it in renders, or use an empty that shows a cube")  # fmt: skip
    if any(export.meshes[key].part for key in exported):
        raise Problem(f"{where}: has hair, which would not follow its surface; switch its hair off")
    (first, *others), source = exported, export.meshes[exported[0]]
    several = others or len(source.objects) > 1 or not export.scene.meshes[first].is_single
    if several or (source.instance and source.holder != ob.name_full):
        raise Problem(f"{where}: is instanced or shares its mesh, so a field can't replace it alone; make its "
                      "instances real and its mesh single-user")  # fmt: skip
    return first


def _material(scene: edgegrad.Scene, mesh: edgegrad.Mesh, where: str) -> tuple[str, str, list[str]]:
    """Return the name of the mesh's material, the one of the field, and notes on what it lacks of the mesh's."""
    notes = []
    names = list(mesh.materials)
    if mesh.face_material is not None and len(names) > 1:
        corners = mesh.vertices[mesh.faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        of_slot = np.bincount(mesh.face_material, area, len(names))
        used = [names[k] for k in np.argsort(-of_slot, kind="stable") if of_slot[k] > 0.0] or names[:1]
        if len(set(used)) > 1:
            notes.append(f"{where}: a field has one material; the fit uses '{used[0]}', and the new object all of them")
        names = used
    found, lacks = plain_material(scene, names[0])
    return names[0], found, [*notes, *(f"{where}: while it is a field, its material '{names[0]}' is simplified: {one}"
                             for one in lacks)]  # fmt: skip
