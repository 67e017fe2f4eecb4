"""Baking of the materials of an export: which materials are baked on which meshes, and the use of the images."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

import edgegrad

from ..exported import Export, Source
from ..geometry.attributes import BAKED_UV, TANGENT, tangents
from ..geometry.group import Group
from ..geometry.meshes import PlacedMeshes
from ..materials.material import MaterialReading
from ..nodes.constants import on_object
from ..nodes.images import Images
from . import cache
from .bake import BakeError, CopiedObject, ObjectBaker, Temporary, temporary
from .cache import KeptBake
from .occluders import MOST_TRIANGLES, Occluders, sees_others
from .size import bake_size


def bake_materials(out: Export, meshes: PlacedMeshes, images: Images, depsgraph: Any, resolution: int) -> None:
    """Bake the outputs that the materials need, on each mesh separately.

    If a material is baked on several meshes, each mesh except the first uses a copy of it, "NAME (OBJECT)". If a bake
    fails, the values of the sockets are used, with a warning.

    Parameters
    ----------
    resolution
        Largest width and height of the images, pixels; 0: nothing is baked.
    """
    taken: set[str] = set()
    groups = list(meshes.groups())
    for group in groups:
        used = [group.slots[k] for k in np.unique(np.clip(group.arrays.slots, 0, len(group.slots) - 1))]
        needed = {name: out.materials[name] for name in used if out.materials[name].baked}
        if not needed or resolution <= 0:
            continue
        size = bake_size(group, set(needed), out.scene.camera, resolution)
        found = _bake_on(group, groups, needed, images, depsgraph, size, out)
        for name, pictures in found.items():
            new = name if name not in taken else f"{name} ({group.sources[0].object})"
            number = 1
            while new in taken or (new != name and new in out.materials):
                number += 1
                new = f"{name} ({group.sources[0].object} {number})"
            taken.add(new)
            out.baked[new] = needed[name].with_images(pictures, new)
            group.slots = tuple(new if slot == name else slot for slot in group.slots)
    for name, reading in out.materials.items():
        if not reading.baked:
            continue
        if resolution <= 0:
            out.report.warn(f"material '{name}'", "isn't baked; the sockets' own values are used")
        out.materials[name] = reading.with_images({}, name)
    out.materials |= out.baked


def _bake_on(group: Group, groups: Sequence[Group], needed: dict[str, MaterialReading], images: Images,
             depsgraph: Any, resolution: int, out: Export) -> dict[str, dict[str, str]]:  # fmt: skip
    """Bake these materials on one mesh; map the stand-in images of each to names of images in the scene."""
    source = group.sources[0]
    found: dict[str, dict[str, str]] = {name: {} for name in needed}
    try:
        bake = _kept_or_baked(group, groups, needed, depsgraph, resolution, out)
    except (BakeError, RuntimeError) as error:
        for name in needed:
            _failed(out, name, source.object, error)
        return found
    uv = np.ascontiguousarray(bake.uv[group.arrays.corners])
    group.attributes[BAKED_UV] = uv
    for (name, baked), image in bake.images.items():
        stand_in = needed[name].stand_in(baked)
        picture = f"{stand_in} on {source.object}"
        number = 1
        while picture in images.found:  # of another mesh of the same object
            number += 1
            picture = f"{stand_in} on {source.object} {number}"
        images.found[picture] = edgegrad.Image(image.pixels)
        found[name][stand_in] = picture
        if baked.normal:
            group.attributes[BAKED_UV + TANGENT] = tangents(group.arrays, uv)
    return found


def _kept_or_baked(group: Group, groups: Sequence[Group], needed: dict[str, MaterialReading], depsgraph: Any,
                   resolution: int, out: Export) -> KeptBake:  # fmt: skip
    """Bake these materials on a mesh, unless nothing has changed since the last time."""
    source = group.sources[0]
    outputs = [(name, baked) for name, reading in needed.items() for baked in reading.baked]
    materials = {name: _material(name) for name in needed}
    around = _occluders(group, groups, materials, out)
    own = {name: values[0] for name, values in group.own.items()}
    constants = {name: on_object(reading.constants, own) for name, reading in needed.items()}
    with temporary() as keep:
        copied = _copied(keep, source, depsgraph)
        if len(copied.mesh.loops) != group.corner_count:
            raise BakeError("its mesh differs from the rendered one")
        key = cache.key_of_bake(copied, group.slots, materials, outputs, resolution,
                                b"" if around is None else around.key(), constants)  # fmt: skip
        known = cache.kept(key, cache.KeptBake)
        if known is not None:
            return known
        baker = ObjectBaker(keep, copied, group.slots, needed, resolution, None if around is None else around.mesh())
        made = KeptBake(baker.uv, {})
        for name, baked in outputs:
            try:
                made.images[name, baked] = baker.bake(materials[name], baked, constants[name])
            except BakeError as error:
                _failed(out, name, source.object, error, baked.node)
    if len(made.images) == len(outputs):
        cache.keep(key, made)
    return made


def _occluders(group: Group, groups: Sequence[Group], materials: dict[str, Any], out: Export) -> Occluders | None:
    """Find what the bake of these materials must see around the first object of a group; None: nothing."""
    seeing = {name: one for name, one in materials.items() if sees_others([one])}
    if not seeing:
        return None
    found = Occluders(groups, group)
    for name in seeing:
        if found.count > MOST_TRIANGLES:
            out.report.warn(f"material '{name}'", "Ambient Occlusion is baked where its object is alone, since all "
                            f"others have {found.count} triangles")  # fmt: skip
        if len(group.sources) > 1:
            out.report.warn(f"material '{name}'", f"Ambient Occlusion of the {len(group.sources)} instances of object "
                            f"'{group.sources[0].object}' is that of the first one")  # fmt: skip
    return found if found.count <= MOST_TRIANGLES else None


def _copied(keep: Temporary, source: Source, depsgraph: Any) -> CopiedObject:
    """Find the first instance of a group again, and copy it."""
    for instance in depsgraph.object_instances:
        ob = instance.object
        holder = instance.parent if instance.is_instance else ob
        if (ob.original.name == source.object and holder.original.name_full == source.holder
                and instance.is_instance == source.instance and ob.type == "MESH"
                and np.array_equal(instance.matrix_world, source.matrix)):  # fmt: skip
            return CopiedObject.of(keep, instance)
    raise BakeError("Blender no longer evaluates it")


def _material(name: str) -> Any:
    """Find a material by its full name, which has the file of linked materials."""
    return next(material for material in bpy.data.materials if material.name_full == name)


def _failed(out: Export, material: str, ob: str, error: Exception, node: str = "") -> None:
    what = f"node '{node}'" if node else "it"
    out.report.warn(f"material '{material}'", f"{what} can't be baked on object '{ob}' ({error}); "
                    "the sockets' own values are used")  # fmt: skip
