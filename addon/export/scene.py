"""The whole scene: walks the evaluated instances once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad

from ..problem import Problem, Report
from .camera import export_camera
from .lights import export_light
from .materials import MaterialReading, read_material
from .mesh import MeshArrays, read_mesh
from .visibility import not_evaluated, rendered_objects, warn_about_modifiers
from .world import export_world

NO_MATERIAL = "(no material)"


@dataclass
class MeshSource:
    """Where an exported mesh comes from.

    Attributes
    ----------
    object, data
        Names of Blender's object and of its original mesh.
    matrix
        (4, 4) from the object's space to the world's.
    instance
        Whether it was made by an instancer.
    """

    object: str
    data: str
    matrix: NDArray[np.float64]
    instance: bool


@dataclass
class Export:
    """An exported scene and where its parts come from; keys are the scene's own."""

    scene: edgegrad.Scene
    meshes: dict[str, MeshSource] = field(default_factory=dict)
    materials: dict[str, MaterialReading] = field(default_factory=dict)
    lights: dict[str, MeshSource] = field(default_factory=dict)
    report: Report = field(default_factory=Report)


def export_scene(scene: Any, depsgraph: Any, camera: Any = None) -> Export:
    """Export what is rendered.

    Parameters
    ----------
    scene
        Blender's scene.
    depsgraph
        Its evaluated dependency graph (``context.evaluated_depsgraph_get()``); viewport settings of modifiers.
    camera
        Camera object; None: the scene's active one.

    Raises
    ------
    Problem
        If there is no camera, or it can't be rendered.
    """
    camera = camera or scene.camera
    if camera is None:
        raise Problem(f"scene '{scene.name}': has no camera; add one and make it active")
    report = Report()
    view = export_camera(camera.evaluated_get(depsgraph), scene, report)
    out = Export(edgegrad.Scene(camera=view, world=export_world(scene, report)), report=report)
    meshes: dict[str, edgegrad.Mesh] = {}
    lights: dict[str, Any] = {}
    cache: dict[int, MeshArrays] = {}
    shown = rendered_objects(depsgraph.view_layer)
    for instance in depsgraph.object_instances:
        ob = instance.object  # valid in this turn of the loop only
        if ob.type not in ("MESH", "LIGHT"):
            continue
        holder = instance.parent if instance.is_instance else ob
        if holder.original.name_full not in shown or ob.hide_render:
            continue
        if not instance.is_instance and ob.is_instancer and not ob.show_instancer_for_render:
            continue
        matrix = np.array(instance.matrix_world, np.float64)
        origin = MeshSource(ob.original.name, ob.original.data.name if ob.original.data else "", matrix,
                            instance.is_instance)  # fmt: skip
        if ob.type == "LIGHT":
            light = export_light(ob, matrix, report)
            if light is not None:
                name = _unused(origin, holder.name, lights)
                lights[name], out.lights[name] = light, origin
            continue
        mesh = _mesh(ob, matrix, cache, out)
        if mesh is not None:
            name = _unused(origin, holder.name, meshes)
            meshes[name], out.meshes[name] = mesh, origin
    for name in not_evaluated(depsgraph, shown):
        report.warn(f"object '{name}'", "is hidden in the viewport, so it isn't evaluated; it is left out")
    out.scene.meshes, out.scene.lights = meshes, lights
    out.scene.materials = {name: reading.value for name, reading in out.materials.items()}
    return out


def _mesh(ob: Any, matrix: NDArray[np.float64], cache: dict[int, MeshArrays], out: Export) -> edgegrad.Mesh | None:
    """The evaluated object's mesh in world space, its materials read on the way."""
    where = f"object '{ob.original.name}'"
    data = ob.data
    key = data.as_pointer()
    if key not in cache:
        cache[key] = read_mesh(data)
    arrays = cache[key]
    if arrays.smooth:
        out.report.warn(where, "is shaded smooth; this version renders its faces flat")
    warn_about_modifiers(ob.original, out.report)
    if not len(arrays.faces):
        out.report.warn(where, "has no faces; it is left out")
        return None
    # Slots may be linked to the object or to its data; the evaluated object knows which counts.
    names = [_material(slot.material, out) for slot in ob.material_slots] or [_material(None, out)]
    world = arrays.positions @ matrix[:3, :3].T + matrix[:3, 3]
    return edgegrad.Mesh(
        vertices=np.ascontiguousarray(world, np.float64),
        faces=arrays.faces.copy(),
        materials=tuple(names),
        face_material=np.clip(arrays.slots, 0, len(names) - 1),  # as Cycles does with indices beyond the last slot
    )


def _material(material: Any, out: Export) -> str:
    original = None if material is None else material.original
    name = NO_MATERIAL if original is None else original.name_full
    if name not in out.materials:
        out.materials[name] = read_material(original, out.report)
    return name


def _unused(origin: MeshSource, holder: str, taken: dict[str, Any]) -> str:
    """Object's own name, or "instancer/object", with a number if it is taken."""
    # The mesh of a text or curve comes as an instance of the object itself.
    base = f"{holder}/{origin.object}" if origin.instance and holder != origin.object else origin.object
    name, number = base, 1
    while name in taken:
        name, number = f"{base}#{number}", number + 1
    return name
