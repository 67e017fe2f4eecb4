"""Export of the whole scene.

The export visits the evaluated instances twice. The first pass reads the materials, which say which attributes the
meshes need. The second pass reads meshes and lights. Then materials and the world are baked where needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

import edgegrad
from edgegrad.scene.placement import is_tangent, places, stretches

from ..evaluation import Evaluation, evaluate
from ..problem import Report
from .approximated.absorbing_meshes import warn_about_absorbing
from .approximated.filled_meshes import warn_about_filled
from .approximated.lit_through import warn_about_lit_through
from .bakes.baking import bake_materials
from .coincident_faces.coincident import warn_about_coincident
from .effects import append_effects, name_transparent_limit, name_world_limit
from .exported import Export, Source, unused_name
from .geometry.attributes import ObjectValues, is_of_object
from .geometry.displacement import displace, read_displacement, warn_about_adaptive
from .geometry.group import Placed
from .geometry.instancers import Instancers
from .geometry.layers import property_of
from .geometry.linking import linked, uses_linking
from .geometry.memory import Memory
from .geometry.meshes import PlacedMeshes
from .geometry.object_types import RENDERED, OtherGeometry, warn_about_type
from .geometry.visibility import is_holdout, visible_to, warn_about_visibility
from .inventory.blurred_lobes import name_filter_glossy
from .inventory.missing_layers import warn_of_missing_layers
from .inventory.naming import name_scene, name_settings
from .materials.caustics import drop_caustics
from .materials.flattened import shadow_flattened
from .materials.holdouts import hold_out
from .materials.material import read_material
from .nodes.camera_view import CameraView
from .nodes.images import Images, texture_limit
from .surroundings.backdrop import add_backdrop
from .surroundings.camera import export_camera
from .surroundings.environment import bake_world
from .surroundings.lamp_bake import bake_lamps
from .surroundings.lamp_nodes import LampEmission, read_emission
from .surroundings.lights import export_light, warn_about_limits, warn_about_translucent, warn_about_unshadowing
from .surroundings.settings import SEGMENTS_AROUND_BOUNCES, expose, name_fast_gi, read_settings
from .surroundings.world import read_world

NO_MATERIAL = "(no material)"
BAKE_RESOLUTION = 1024


def export_scene(scene: Any, cameras: Sequence[Any] = (), bake: int = BAKE_RESOLUTION, coded: bool = True) -> Export:
    """Export all objects that a render of the current frame shows, with their settings for renders.

    Parameters
    ----------
    scene
        Blender's scene.
    cameras
        Camera objects whose views are exported; empty: the active camera of the scene.
    bake
        Width and height, in pixels, of baked images (the image of an environment has half the height); 0: nothing is
        baked.
    coded
        Whether 8-bit sRGB images may be stored as code values (`Images`); False if mean colours are needed.

    Raises
    ------
    Problem
        If there is no camera, or a camera of an unsupported type.
    """
    camera = cameras[0] if cameras else None
    return evaluate(scene, lambda evaluation: export_evaluated(evaluation, cameras[1:], bake, coded), camera)


def export_evaluated(evaluation: Evaluation, more_cameras: Sequence[Any], bake: int = BAKE_RESOLUTION,
                     coded: bool = True, memory: Memory | None = None, view: edgegrad.Camera | None = None,
                     attributes: frozenset[str] = frozenset()) -> Export:  # fmt: skip
    """Export a scene that is evaluated; see `export_scene`.

    Parameters
    ----------
    memory
        Of earlier exports of the scene, which is seldom worth a second report: its warnings are not complete.
    view
        What sees the scene instead of the evaluation's camera.
    attributes
        Names of attributes (`geometry.attributes`) that all meshes get, besides those that their materials read.
    """
    scene, depsgraph = evaluation.scene, evaluation.depsgraph
    report = Report()
    cameras = (evaluation.camera, *more_cameras) if view is None else more_cameras
    views = [] if view is None else [view]
    views += [export_camera(camera.evaluated_get(depsgraph), scene, report) for camera in cameras]
    view = views[0]
    owners = [one for one in (depsgraph.view_layer, scene, scene.world) if one is not None]
    seen = CameraView.of(view, lambda name: property_of(owners, name))
    out = Export(edgegrad.Scene(camera=view), read_settings(scene), report=report, views=views)
    if evaluation.unread_layers:
        names = ", ".join(f"'{name}'" for name in evaluation.unread_layers)
        report.warn(f"scene '{scene.name}'", f"renders several view layers; only '{depsgraph.view_layer.name}', whose "
                    f"picture Blender shows, is rendered, and not {names}")  # fmt: skip
    images = Images(coded=coded, limit=texture_limit(scene))
    walk = _Walk(depsgraph, out, memory)
    # Materials are read before meshes, which need the names of the attributes. They are read outside Blender's
    # iterator, since reading may create data and thus invalidate the iterator.
    materials = walk.materials()
    for material in materials:
        out.materials[_key(material)] = read_material(material, images, report, seen, _key(material) in walk.stretched)
        if material is not None:
            name_settings(material, f"material '{material.name}'", scene, report)
    world = read_world(scene, depsgraph, images, report)
    name_scene(scene, depsgraph.view_layer, evaluation.camera, world.world, report)
    displacements = {}
    for material in materials:
        found = read_displacement(material, images, report, seen)
        if found is not None:
            displacements[_key(material)] = found
    needed = {name: reading.attributes() | attributes for name, reading in out.materials.items()}
    # Bakes and displacements are made for a mesh, not for each of its instances.
    single = {name for name, reading in out.materials.items() if reading.baked}
    single |= {name for name, found in displacements.items() if any(map(is_of_object, found.attributes()))}
    walk.meshes.framed = {name for name, reading in out.materials.items() if reading.maps_normals()}
    walk.meshes.own_space = {name for name, reading in out.materials.items() if reading.scatters} | set(displacements)
    meshes = walk.meshes_and_lights({name: names | displacements[name].attributes() if name in displacements else names
                                     for name, names in needed.items()}, single)  # fmt: skip
    displace(meshes.groups(), displacements, needed, report)
    bake_materials(out, meshes, images, depsgraph, bake)
    shadow_flattened(out, meshes)
    hold_out(out, meshes)
    if world.baked:
        bake_world(world, images, bake, report, view, widths=None if memory is None else memory.widths)
    out.scene.meshes = meshes.build(out.meshes)
    _link_lights(out)
    out.scene.world = world.value
    out.scene.materials = {}
    for name, reading in out.materials.items():
        out.scene.materials[name] = reading.value
        out.scene.materials |= reading.parts
    if world.backdrop is not None:
        add_backdrop(out, world.backdrop, images, bake, None if memory is None else memory.widths)
    out.scene.images = images.found
    titles = {name: f"light '{source.object}'" for name, source in out.lights.items()}
    titles |= {name: f"object '{source.object}'" for name, source in out.meshes.items()}
    shaders = [one for reading in out.materials.values() for one in reading.shaders()]
    warn_about_translucent(out.scene, shaders, titles, world.world, report)
    warn_about_unshadowing(out.scene, titles, report)
    warn_about_limits(out.scene, out.settings.max_depth - SEGMENTS_AROUND_BOUNCES, titles, report)
    bake_lamps(out, walk.emissions, bake)
    out.scene.lights = {**out.scene.lights, **world.suns}
    name_fast_gi(scene, out.scene, report)
    name_filter_glossy(scene, out)
    expose(out.scene, out.settings.exposure)
    drop_caustics(out.scene, out.settings, report)
    if memory is None:
        _warn_of_frames(out)
        warn_about_coincident(out)
        warn_about_absorbing(out)
        warn_about_filled(out)
        warn_about_lit_through(out)
        warn_of_missing_layers(out)
        name_transparent_limit(scene, out)
        name_world_limit(scene, int(getattr(getattr(world.world, "cycles", None), "max_bounces", 1024)), out)
        append_effects(out)
    return out


def _key(material: Any) -> str:
    return NO_MATERIAL if material is None else str(material.name_full)


class _Walk:
    """The two passes over the evaluated instances: one for materials, one for meshes and lights."""

    def __init__(self, depsgraph: Any, out: Export, memory: Memory | None) -> None:
        if memory is not None:
            memory.begin()
        self.depsgraph = depsgraph
        self.out = out
        self.linking = uses_linking(depsgraph.view_layer)
        self.meshes = PlacedMeshes(out.report, memory)
        self.others = OtherGeometry(self.meshes, out.scene.camera, depsgraph, out.report)
        self.complete = memory is None
        self.named: set[str] = set()
        self.stretched: set[str] = set()  # keys of materials on objects with a non-uniform scale
        self.emissions: dict[str, LampEmission] = {}  # by the names of the exported lights
        self.instancers = Instancers(out.report, depsgraph)

    def _instances(self) -> Any:
        """Yield (instance, object, object or instancer) for all rendered objects; each is valid until the next one."""
        for instance in self.depsgraph.object_instances:
            ob = instance.object
            yield instance, ob, instance.parent if instance.is_instance else ob

    def materials(self) -> list[Any]:
        """List all used materials, evaluated at the frame; None stands for faces without a material."""
        found: dict[str, Any] = {}
        for instance, ob, _ in self._instances():
            warn_about_type(ob, self.out.report)
            if self.others.shows(instance) or (ob.type == "MESH" and instance.show_self):
                uneven = stretches(np.array(instance.matrix_world, np.float64)[:3, :3])
                for material in self._slots(ob):
                    found[_key(material)] = material
                    if uneven:
                        self.stretched.add(_key(material))
        return [None if material is None else material.evaluated_get(self.depsgraph) for material in found.values()]

    def meshes_and_lights(self, needed: dict[str, set[str]], single: set[str]) -> PlacedMeshes:
        """Read the meshes, with the attributes that each material needs, and write the lights into the export.

        `single` has the materials whose objects do not share meshes if they read values of the object.
        """
        out = self.out
        lights: dict[str, Any] = {}
        for instance, ob, holder in self._instances():
            of_instancer = self.instancers.of(instance)
            if ob.type not in RENDERED or not (instance.show_self or instance.show_particles):
                continue
            matrix = np.array(instance.matrix_world, np.float64)
            source = Source(ob.original.name, ob.original.data.name if ob.original.data else "", matrix,
                            instance.is_instance, (ob.original.name,), holder.original.name_full)  # fmt: skip
            visible = visible_to(ob, holder, self.depsgraph.view_layer)
            if self.complete:
                self._name(ob.original)
            if ob.type == "LIGHT":
                if not instance.show_self:
                    continue
                of = ObjectValues(ob, matrix, instance.random_id, of_instancer)
                emission = read_emission(ob.data, of)
                light = export_light(ob, matrix, visible, emission, out.report)
                if light is not None:
                    name = unused_name(source, holder.original.name, lights)
                    lights[name], out.lights[name], self.emissions[name] = light, source, emission
                continue
            warn_about_visibility(ob.original, out.report)
            warn_about_adaptive(ob.original, self.depsgraph.scene, out.report)
            slots = tuple(_key(material) for material in self._slots(ob))
            held = is_holdout(holder, self.depsgraph.view_layer)
            placed = Placed(ob, source, holder.original.name, slots, visible, held, instance.random_id,
                            of_instancer, self.linking, not single.isdisjoint(slots))  # fmt: skip
            if ob.type == "MESH" and instance.show_self and self.depsgraph.view_layer.use_solid:
                self.meshes.add(placed, set().union(*(needed[slot] for slot in slots)))
            self.others.add(instance, placed, needed, out.materials)
        self.meshes.leave_out_unseen()
        out.scene.lights = lights
        return self.meshes

    def _slots(self, ob: Any) -> list[Any]:
        """Original materials of an object's slots, which may be linked to it or to its data; None: no material."""
        override = self.depsgraph.view_layer.material_override
        materials = [override or slot.material for slot in ob.material_slots] or [override]
        return [None if material is None else material.original for material in materials]

    def _name(self, ob: Any) -> None:
        """Report the settings of an object, and of the light that it is, that are named."""
        if ob.name_full in self.named:
            return
        self.named.add(ob.name_full)
        name_settings(ob, f"object '{ob.name}'", self.depsgraph.scene, self.out.report)
        if ob.type == "LIGHT":
            name_settings(ob.data, f"light '{ob.name}'", self.depsgraph.scene, self.out.report)


def _warn_of_frames(out: Export) -> None:
    """Warn of emissive meshes with tangents and a non-uniform scale.

    The vertices of emissive meshes are in world space, where light is sampled, and tangents in world space cannot
    express such a scale exactly.
    """
    for name, mesh in out.scene.meshes.items():
        framed = any(is_tangent(key, values) for key, values in mesh.attributes.items())
        if framed and out.scene.emits(name) and any(stretches(place[:, :3]) for place in places(mesh)):
            out.report.warn(f"object '{out.meshes[name].object}'", "emits light and has a non-uniform scale, so its "
                            "normal maps and anisotropy are approximate; apply its scale")  # fmt: skip


def _link_lights(out: Export) -> None:
    """Set receivers and blockers of the lights; warn of meshes with light linking, which is not supported."""
    holders = {name: source.holder for name, source in out.meshes.items()}
    # Of equal names of different files, the first one counts.
    objects = {ob.name: ob for ob in reversed(list(bpy.data.objects))}
    for name, source in out.lights.items():
        light, ob = out.scene.lights[name], objects.get(source.object)
        if ob is not None:
            light.receivers = linked(ob.light_linking.receiver_collection, holders)
            light.blockers = linked(ob.light_linking.blocker_collection, holders)
    for source in out.meshes.values():
        ob = objects.get(source.object)
        linking = None if ob is None else ob.light_linking
        if linking is not None and (linking.receiver_collection or linking.blocker_collection):
            out.report.warn(f"object '{source.object}'", "its light linking is left out; only lights are linked")
