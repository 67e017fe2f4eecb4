"""Write results into Blender: vertices into the original mesh, values into the sockets and lights they come from."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .evaluation import Evaluation, evaluate_alone
from .export.geometry.mesh import corner_vertices, positions
from .export.materials.material import MaterialReading
from .export.surroundings.lights import power_factor
from .problem import Problem

KEY_NAME = "Edgegrad"
F64 = NDArray[np.float64]


class MovedByModifiers(Problem):
    """Raised for an object whose modifiers move its vertices or change its topology."""


def check_vertices(ob: Any, scene: Any, in_place: bool) -> None:
    """Raise `Problem` unless the vertices of the object, in renders of the scene, are those of its own mesh.

    A fit moves the rendered vertices, and writes them into the mesh. Therefore a modifier that moves vertices or
    changes the topology is refused by name. Other modifiers are allowed.
    """
    where = f"object '{ob.name}'"
    if ob.type != "MESH":
        raise Problem(f"{where}: is a {ob.type.lower()}; only the vertices of meshes can be fitted "
                      "(convert it to a mesh first)")  # fmt: skip
    if ob.mode == "EDIT":
        raise Problem(f"{where}: is in edit mode; leave it first")
    mesh = ob.data
    if mesh.library is not None or ob.library is not None or mesh.override_library is not None:
        raise Problem(f"{where}: its mesh '{mesh.name}' is linked from another file and can't be written; "
                      "make it local first")  # fmt: skip
    sharing = [other.name for other in bpy.data.objects if other.data is mesh and other != ob]
    if sharing:
        raise Problem(f"{where}: its mesh '{mesh.name}' is shared with object '{sharing[0]}', which would change too; "
                      "make it single-user first")  # fmt: skip
    keys = mesh.shape_keys
    if keys is not None and ob.show_only_shape_key:
        raise Problem(f"{where}: shows only its active shape key; switch 'Shape Key Lock' off first")
    if keys is not None and not keys.use_relative and not in_place:
        raise Problem(f"{where}: its shape keys are absolute, so no shape key can be added; write in place instead")
    if abs(np.linalg.det(np.array(ob.matrix_world, np.float64)[:3, :3])) < 1e-30:
        raise Problem(f"{where}: is scaled to zero, so its vertices can't be written back; apply or change its scale")
    _check_modifiers(ob, scene)


def _check_modifiers(ob: Any, scene: Any) -> None:
    """Refuse, by name, the first modifier that moves vertices or changes the topology."""
    where = f"object '{ob.name}'"
    active = [modifier for modifier in ob.modifiers if modifier.show_render]
    full = _rendered(ob, scene)
    if active:
        try:
            for modifier in active:
                modifier.show_render = False
            before = plain = _rendered(ob, scene)
            if not _same(plain, full):
                for modifier in active:
                    modifier.show_render = True
                    after = _rendered(ob, scene)
                    if not np.array_equal(before[1], after[1]) or len(before[0]) != len(after[0]):
                        raise MovedByModifiers(
                            f"{where}: its modifier '{modifier.name}' changes the topology, so its vertices "
                            "can't be fitted; apply it, or switch it off in renders")  # fmt: skip
                    if not _same(before, after):
                        raise MovedByModifiers(
                            f"{where}: its modifier '{modifier.name}' moves vertices, so they can't be "
                            "fitted; apply it, or switch it off in renders")  # fmt: skip
                    before = after
        finally:
            for modifier in active:
                modifier.show_render = True
    base = positions(ob.data), corner_vertices(ob.data)
    if len(full[0]) != len(base[0]) or not np.array_equal(full[1], base[1]):
        raise Problem(f"{where}: its evaluated mesh has another topology than the mesh '{ob.data.name}'")
    if ob.data.shape_keys is None and not np.array_equal(full[0], base[0], equal_nan=True):
        raise Problem(f"{where}: its vertices are moved by something other than modifiers (its parent?), "
                      "so they can't be fitted")  # fmt: skip


def _rendered(ob: Any, scene: Any) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Positions of the vertices in renders, and the vertex of each face corner."""

    def read(evaluation: Evaluation) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        mesh = ob.evaluated_get(evaluation.depsgraph).data
        return positions(mesh), corner_vertices(mesh)

    return evaluate_alone(ob, scene, read)


def _same(a: tuple[Any, Any], b: tuple[Any, Any]) -> bool:
    return np.array_equal(a[0], b[0], equal_nan=True) and np.array_equal(a[1], b[1])


def write_vertices(ob: Any, matrix: F64, before: F64, after: F64, in_place: bool) -> None:
    """Apply the world-space displacement of vertices by a fit to the object's own mesh.

    Parameters
    ----------
    ob
        The object (original), checked by `check_vertices`.
    matrix
        (4, 4) transform from object space to world space at the export.
    before, after
        (n, 3) world-space positions at the export and after the fit.
    in_place
        False: write a new shape key of value 1, and keep the old shape. True: write the mesh itself, and displace
        all its shape keys equally, which keeps their differences.
    """
    mesh = ob.data
    if len(mesh.vertices) != len(after):
        raise Problem(f"object '{ob.name}': its mesh changed while it was fitted; nothing was written")
    # Transform the displacement, not the position, so that vertices that did not move keep their bits.
    moved = np.linalg.solve(matrix[:3, :3], (after - before).T).T
    if in_place:
        _move(mesh, moved)
    else:
        if mesh.shape_keys is None:
            ob.shape_key_add(name="Basis", from_mix=False)
        key = ob.shape_key_add(name=KEY_NAME, from_mix=False)
        key.relative_key = mesh.shape_keys.reference_key
        _set_key(key, _key(mesh.shape_keys.reference_key, len(moved)) + moved)
        key.value = 1.0
        if key.value != 1.0:
            raise Problem(f"object '{ob.name}': shape key '{key.name}' can't be switched on")
    mesh.update()


def _move(mesh: Any, moved: F64) -> None:
    # A mesh with shape keys shows their mix and ignores its own vertices. Both are updated.
    for key in mesh.shape_keys.key_blocks if mesh.shape_keys is not None else ():
        _set_key(key, _key(key, len(moved)) + moved)
    points = np.ascontiguousarray(positions(mesh) + moved, np.float32)
    mesh.attributes["position"].data.foreach_set("vector", points.ravel())
    mesh.vertices[0].co = points[0]  # an assignment to a vertex makes Blender update bounds and normals


def _key(key: Any, count: int) -> NDArray[np.float32]:
    out = np.empty((count, 3), np.float32)
    key.points.foreach_get("co", out.ravel())
    return out


def _set_key(key: Any, points: NDArray[Any]) -> None:
    key.points.foreach_set("co", np.ascontiguousarray(points, np.float32).ravel())


def check_material(reading: MaterialReading, name: str, fieldname: str) -> Any:
    """Raise `Problem` unless this field of the material can be written; return Blender's material."""
    where = f"material '{name}'"
    material = None if reading.material is None else bpy.data.materials.get(reading.material)
    if material is None:
        raise Problem(f"{where}: there is no such material to write to")
    if material.library is not None or material.override_library is not None:
        raise Problem(f"{where}: is linked from another file and can't be written; make it local first")
    label = {"base_color": "base colour", "emission": "emission"}[fieldname]
    socket = reading.base_color if fieldname == "base_color" else reading.emission_color
    if socket is None and not (fieldname == "base_color" and material.node_tree is None):
        raise Problem(f"{where}: has no node whose {label} can be written")
    if fieldname in reading.fed:
        raise Problem(f"{where}: its {label} is fed by node '{reading.fed[fieldname]}', so it can't be written; "
                      "unlink it first")  # fmt: skip
    if fieldname in reading.value.textures:
        raise Problem(f"{where}: its {label} is scaled by subsurface scattering, which depends on the view, or is "
                      "above 1, so it can't be written; set subsurface to 0 or the colour lower")  # fmt: skip
    return material


def write_material(reading: MaterialReading, name: str, fieldname: str, value: F64) -> None:
    """Write a base colour or an emission into the sockets that it was read from."""
    material = check_material(reading, name, fieldname)
    if fieldname == "base_color":
        if reading.base_color is None:
            material.diffuse_color[:3] = value
        else:
            reading.base_color.find(material).default_value[:3] = value
        return
    assert reading.emission_color is not None and reading.emission_strength is not None
    strength = reading.emission_strength.find(material)
    if not strength.default_value > 0.0:
        strength.default_value = 1.0
    reading.emission_color.find(material).default_value[:3] = value / strength.default_value


def check_light(name: str) -> Any:
    """Raise `Problem` unless the power of the light object can be written; return Blender's light."""
    ob = bpy.data.objects.get(name)
    if ob is None or ob.type != "LIGHT":
        raise Problem(f"light '{name}': there is no such light")
    if ob.data.library is not None or ob.data.override_library is not None:
        raise Problem(f"light '{name}': is linked from another file and can't be written; make it local first")
    sharing = [other.name for other in bpy.data.objects if other.data is ob.data and other != ob]
    if sharing:
        raise Problem(f"light '{name}': is shared with object '{sharing[0]}', which would change too; "
                      "make it single-user first")  # fmt: skip
    if not getattr(ob.data, "normalize", True):
        raise Problem(f"light '{name}': its power can't be fitted while its 'Normalize' option is off; switch it on")
    return ob.data


def write_power(name: str, value: float) -> None:
    """Write a fitted power, or the strength of a sun, into the light object of this name."""
    light = check_light(name)
    light.energy = value / power_factor(light)
