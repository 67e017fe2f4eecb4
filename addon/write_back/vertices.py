"""Vertices that a fit may change, and their way back into the object's own mesh."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..animated.refusals import check_own
from ..evaluation import Evaluation, evaluate_alone
from ..export.geometry.mesh import corner_vertices, positions
from ..problem import Problem
from .fitted_key import points_of, set_points, write_key

F64 = NDArray[np.float64]


class MovedByModifiers(Problem):
    """Raised for an object whose modifiers move its vertices or change its topology."""


def check_vertices(ob: Any, scene: Any, in_place: bool) -> None:
    """Raise `Problem` unless the vertices of the object, in renders of the scene, are those of its own mesh.

    A fit moves the rendered vertices, and writes them into the mesh. Therefore a modifier that moves vertices or
    changes the topology is refused by name. Other modifiers are allowed.
    """
    where = f"object '{ob.name}'"
    check_editable(ob, in_place)
    if abs(np.linalg.det(np.array(ob.matrix_world, np.float64)[:3, :3])) < 1e-30:
        raise Problem(f"{where}: is scaled to zero, so its vertices can't be written back; apply or change its scale")
    _check_modifiers(ob, scene)


def check_own_mesh(ob: Any) -> None:
    """Raise `Problem` if the mesh of the object, or the object, is of another file and so can't be written."""
    where = f"object '{ob.name}'"
    check_own(where, ob.data, f"its mesh '{ob.data.name}' ")
    if ob.library is not None:
        check_own(where, ob)


def check_editable(ob: Any, in_place: bool) -> None:
    """Raise `Problem` unless new vertices can be written into the mesh of the object as it is now."""
    where = f"object '{ob.name}'"
    if ob.type != "MESH":
        raise Problem(f"{where}: is a {ob.type.lower()}; only the vertices of meshes can be fitted "
                      "(convert it to a mesh first)")  # fmt: skip
    mesh = ob.data
    if ob.mode == "EDIT" or mesh.is_editmode:
        raise Problem(f"{where}: is in edit mode; leave it first")
    if ob.mode == "SCULPT" and ob.use_dynamic_topology_sculpting:
        raise Problem(f"{where}: is sculpted with dynamic topology; leave sculpt mode first")
    check_own_mesh(ob)
    sharing = [other.name for other in bpy.data.objects if other.data is mesh and other != ob]
    if sharing:
        raise Problem(f"{where}: its mesh '{mesh.name}' is shared with object '{sharing[0]}', which would change too; "
                      "make it single-user first")  # fmt: skip
    keys = mesh.shape_keys
    if keys is not None and ob.show_only_shape_key:
        raise Problem(f"{where}: shows only its active shape key; switch 'Shape Key Lock' off first")
    if keys is not None and not keys.use_relative and not in_place:
        raise Problem(f"{where}: its shape keys are absolute, so no shape key can be added; write in place instead")


@dataclass(frozen=True)
class Topology:
    """What must stay the same of a mesh while its vertices are fitted.

    Attributes
    ----------
    vertices, corners
        Number of vertices, and a checksum of the vertices of all face corners.
    """

    vertices: int
    corners: int

    @staticmethod
    def of(mesh: Any) -> Topology:
        """Return the topology of a mesh that is not in edit mode."""
        return Topology(len(mesh.vertices), zlib.crc32(np.ascontiguousarray(corner_vertices(mesh)).tobytes()))


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


def displacement(matrix: F64, before: F64, after: F64) -> F64:
    """Return the move of vertices in the space of their object, from positions before and after a fit.

    Parameters
    ----------
    matrix
        (4, 4) transform from object space to the space of the positions.
    before, after
        (n, 3) positions.
    """
    # Transform the displacement, not the position, so that vertices that did not move keep their bits.
    return np.asarray(np.linalg.solve(matrix[:3, :3], (after - before).T).T)


def write_move(ob: Any, moved: F64, in_place: bool) -> None:
    """Apply a move (n, 3) of vertices, in the space of the object, to the object's own mesh.

    `in_place` False: the move goes into a shape key, and the old shape stays. True: the mesh itself changes, and all
    its shape keys are displaced equally, which keeps their differences.
    """
    mesh = ob.data
    if len(mesh.vertices) != len(moved):
        raise Problem(f"object '{ob.name}': its mesh has another number of vertices now")
    if in_place:
        _move(mesh, moved)
    else:
        write_key(ob, moved)
    mesh.update()


def _move(mesh: Any, moved: F64) -> None:
    # A mesh with shape keys shows their mix and ignores its own vertices. Both are updated.
    for key in mesh.shape_keys.key_blocks if mesh.shape_keys is not None else ():
        set_points(key, points_of(key) + moved)
    points = np.ascontiguousarray(positions(mesh) + moved, np.float32)
    mesh.attributes["position"].data.foreach_set("vector", points.ravel())
    mesh.vertices[0].co = points[0]  # an assignment to a vertex makes Blender update bounds and normals
