"""True displacement: the vertices of meshes are moved by the displacement of their materials, as Cycles does.

Displacement nodes are translated to expressions of vectors in world space. They read the axes of the object from
attributes, which only the meshes have on which the expressions are evaluated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import Scene, World, _native
from edgegrad import expression as e
from edgegrad.expression import Expression, nodes_of
from edgegrad.geometry.labels import summed
from edgegrad.tables.materials import COLUMNS, WIDTH
from edgegrad.tables.textures.program import compile_textures

from ...problem import Report
from ..nodes.camera_view import CameraView
from ..nodes.expressions import Reader, Unreadable
from ..nodes.images import Images
from ..nodes.links import by_identifier, feed
from ..nodes.read_displacement import AXES
from .attributes import OBJECT, VERTEX_NORMAL
from .group import Group
from .mesh import MeshArrays
from .normals import face_normals, shading_normals, unit, usable

# Whether the bump beside a displacement starts from the normals of vertices also on flat faces.
BUMP_IS_SMOOTH = bpy.app.version >= (5, 0, 0)

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]


def moves_vertices(material: Any) -> bool:
    """Whether Cycles moves the vertices of meshes with this material, if it has a displacement."""
    return material.displacement_method in ("DISPLACEMENT", "BOTH")


@dataclass(frozen=True)
class Displacement:
    """Displacement of a material.

    Attributes
    ----------
    vector
        Its expression, in world space.
    images
        That the expression reads.
    bump
        Whether the material also has the displacement as bump, which starts from the normals before displacement.
    """

    vector: Expression
    images: Mapping[str, edgegrad.Image]
    bump: bool

    def attributes(self) -> set[str]:
        """Names of the attributes that must be read from meshes."""
        names = {n.name for n in nodes_of(self.vector) if isinstance(n, e.Attribute)} - set(AXES)
        return names | {VERTEX_NORMAL}


def read_displacement(material: Any, images: Images, report: Report, view: CameraView) -> Displacement | None:
    """Read the displacement of a material that moves vertices; None: there is none.

    Parameters
    ----------
    images
        Those of the export; images that only displacement reads are none of its scene.
    """
    if material is None or material.node_tree is None or not moves_vertices(material):
        return None
    output = material.node_tree.get_output_node("CYCLES")
    if output is None or by_identifier(output.inputs, "Displacement") is None:
        return None
    found = feed(by_identifier(output.inputs, "Displacement"))
    if found.output is None:
        return None
    where = f"material '{material.name}'"
    own = Images(coded=images.coded, limit=images.limit)
    reader = Reader(own, None, material.pass_index, view, moves=True)
    try:
        value = reader.value(by_identifier(output.inputs, "Displacement"))
    except Unreadable as error:
        report.warn(where, f"its displacement is left out, since {error} can't be read")
        return None
    for note in reader.notes:
        report.warn(where, note)
    if not isinstance(value, Expression):
        value = e.Combine(*(value[:3] if isinstance(value, tuple) else (value,) * 3))
    return Displacement(value, own.found, material.displacement_method == "BOTH")


def displace(groups: list[Group], displacements: Mapping[str, Displacement], needed: Mapping[str, set[str]],
             report: Report) -> None:  # fmt: skip
    """Move the vertices of meshes, and drop the attributes that only displacement needs.

    Parameters
    ----------
    needed
        Attributes that the materials read.
    """
    for group in groups:
        slots = [displacements.get(name) for name in group.slots]
        # Cycles does not displace hair and points.
        if not any(slots) or group.corner_count == 0:
            continue
        where = f"object '{group.sources[0].object}'"
        linear = group.sources[0].matrix[:3, :3]
        if abs(np.linalg.det(linear)) < 1e-30:
            report.warn(where, "is scaled to nothing, so its displacement is left out")
            continue
        if any(one is not None and one.bump for one in slots) and _uneven(linear):
            report.warn(where, "is scaled unevenly, so that the bump beside its displacement differs a little")
        _displace(group, slots)
        if group.terminator.geometry > 0.0 and _turns_faces(group.arrays):
            report.warn(where, "has smooth faces that its displacement turns by more than a right angle from their "
                        "normals; their shadows at grazing light start elsewhere than in Cycles; set its 'Geometry "
                        "Offset' of shadow terminators to 0")  # fmt: skip
        for source in group.sources:
            source.displaced = True
        kept = set().union(*(needed[name] for name in group.slots))
        group.attributes = {name: value for name, value in group.attributes.items() if name in kept}
        if OBJECT in group.attributes:
            group.attributes[OBJECT] = group.arrays.positions[group.arrays.faces]


def _turns_faces(arrays: MeshArrays) -> bool:
    """Whether smooth faces have normals that point below them."""
    normals = shading_normals(arrays.positions, arrays.faces, arrays.smoothing, arrays.normals)
    cosine = np.einsum("fck,fk->fc", normals, face_normals(arrays.positions, arrays.faces))
    return bool((cosine < 0.0).any())


def _displace(group: Group, slots: list[Displacement | None]) -> None:
    arrays, matrix = group.arrays, group.sources[0].matrix
    slot = np.clip(arrays.slots, 0, len(slots) - 1)
    moving = np.array([one is not None for one in slots])
    # The first face of a vertex whose material has a displacement decides where the vertex goes.
    flat = np.flatnonzero(np.repeat(moving[slot], 3))
    vertex, first = np.unique(arrays.faces.reshape(-1)[flat], return_index=True)
    corner = flat[first]
    offset = np.zeros((len(vertex), 3))
    normal = _displacing_normals(group)
    for k, one in enumerate(slots):
        chosen = slot[corner // 3] == k
        if one is not None and chosen.any():
            offset[chosen] = _evaluated(one, group, corner[chosen], normal)
    own = offset @ np.linalg.inv(matrix[:3, :3]).T
    own[~np.isfinite(own).all(axis=1)] = 0.0
    positions = arrays.positions.copy()
    positions[vertex] += own.astype(np.float32)
    recomputed = np.array([one is not None and not one.bump for one in slots])[slot]
    if BUMP_IS_SMOOTH:
        bumped = np.array([one is not None and one.bump for one in slots])[slot]
        arrays = _smoothed(group, bumped)
    normals = _moved_normals(positions, arrays, recomputed)
    group.arrays = replace(arrays, positions=positions, normals=normals, exact=False)


def _displacing_normals(group: Group) -> F64:
    """(m, 3, 3) unit normal at each corner of the triangles: Cycles displaces as if all faces were smooth.

    Flat faces of meshes with normals of corners have vertices of their own.
    """
    arrays, given = group.arrays, group.attributes.get(VERTEX_NORMAL)
    of_corners = arrays.smoothing is not None and not _of_vertices(arrays)
    if given is None or of_corners:
        return shading_normals(arrays.positions, arrays.faces, arrays.smoothing, arrays.normals)
    return unit(given.astype(np.float64))


def _smoothed(group: Group, bumped: NDArray[np.bool_]) -> MeshArrays:
    """The arrays of a group whose flat faces among the `bumped` ones have the normals of the vertices.

    Cycles starts the bump beside a displacement from these, unless flat faces have vertices of their own, as in meshes
    with normals of corners. Its shadow rays of such faces do not start elsewhere, as those of smooth faces may.
    """
    arrays = group.arrays
    given, smoothing, normals = group.attributes.get(VERTEX_NORMAL), arrays.smoothing, arrays.normals
    if given is None or not bumped.any():
        return arrays
    if smoothing is None or normals is None:
        group.terminator = group.terminator._replace(geometry=0.0)
        smoothing, normals = np.full_like(arrays.faces, -1), np.zeros_like(arrays.positions)
        normals[arrays.faces] = given
    elif not _of_vertices(arrays):
        return arrays
    flat = bumped & (smoothing < 0).all(axis=1)
    smoothing = smoothing.copy()
    smoothing[flat] = arrays.faces[flat]
    return replace(arrays, smoothing=smoothing, normals=normals)


def _uneven(linear: F64) -> bool:
    """Whether a transform is more than a rotation with a uniform scale."""
    sizes = np.linalg.svd(linear, compute_uv=False)
    return bool(sizes[0] - sizes[-1] > 1e-4 * sizes[0])


def _moved_normals(positions: F32, arrays: MeshArrays, recomputed: NDArray[np.bool_]) -> F32 | None:
    """(k, 3) normals of displaced meshes, as Cycles computes them: sums of the unit normals of faces.

    Normals of corners, where a mesh has sharp edges, change as much as those of their vertices do.

    Parameters
    ----------
    recomputed
        (m,) faces whose material has no bump beside its displacement. The others keep their normals.
    """
    normals, smoothing = arrays.normals, arrays.smoothing
    if smoothing is None or normals is None:
        return None
    count, faces = len(positions), arrays.faces
    of_corners = not _of_vertices(arrays)
    if of_corners:
        recomputed = np.ones_like(recomputed)
    elif not recomputed.any():
        return normals
    out = normals.astype(np.float64)
    smooth = (smoothing >= 0) & recomputed[:, None]
    group, vertex = smoothing[smooth], faces[smooth]
    after = _vertex_normals(positions, faces[recomputed], count)
    if of_corners:
        before = _vertex_normals(arrays.positions, faces, count)
        out[group] = unit(unit(out[group]) + after[vertex] - before[vertex])
    else:
        out[group] = after[vertex]
    return usable(out.astype(np.float32))


def _of_vertices(arrays: MeshArrays) -> bool:
    """Whether each vertex has one normal, which its smooth faces have."""
    smoothing, normals = arrays.smoothing, arrays.normals
    if smoothing is None or normals is None or len(normals) != len(arrays.positions):
        return False
    return bool(((smoothing < 0) | (smoothing == arrays.faces)).all())


def _vertex_normals(positions: F32, faces: I32, count: int) -> F64:
    """(count, 3) normalised sums of the unit normals of faces at vertices."""
    flat = np.repeat(face_normals(positions, faces), 3, axis=0)
    return unit(summed(faces.reshape(-1), flat, count))


def _evaluated(one: Displacement, group: Group, corner: NDArray[np.intp], normal: F64) -> F64:
    """(n, 3) displacement in world space at corners of faces, numbered over all faces."""
    arrays, matrix = group.arrays, np.asarray(group.sources[0].matrix, np.float64)
    face, at = corner // 3, corner % 3
    linear, inverse = matrix[:3, :3], np.linalg.inv(matrix[:3, :3])
    values = {AXES[k]: np.tile(linear[:, k], (len(corner), 1)) for k in range(3)}
    read = {n.name for n in nodes_of(one.vector) if isinstance(n, e.Attribute)}
    # One triangle for each point, all of whose corners have the point's values.
    attributes = {name: value[face, at] for name, value in group.attributes.items()} | values
    every = {name: np.repeat(np.asarray(value, np.float32)[:, None], 3, axis=1) for name, value in attributes.items()
             if name in read}  # fmt: skip
    box = arrays.positions @ linear.T.astype(np.float32) + matrix[:3, 3].astype(np.float32)
    vertices = np.stack([box.min(axis=0), box.max(axis=0), box.max(axis=0)]).astype(np.float64)
    mesh = edgegrad.Mesh(vertices, np.tile(np.arange(3, dtype=np.int32), (len(corner), 1)), ("m",), attributes=every)
    material = edgegrad.Material(textures={"emission": one.vector})
    scene = Scene(edgegrad.Camera(np.eye(4)), {"m": mesh}, {"m": material}, {}, World(), dict(one.images))
    where = _Points(len(corner))
    where.position[:] = box[arrays.faces[face, at]]
    where.normal[:] = where.view[:] = unit(normal[face, at] @ inverse)
    where.true_normal[:] = unit(face_normals(arrays.positions, arrays.faces)[face] @ inverse)
    rows = np.zeros((len(corner), WIDTH), np.float32)
    _native.evaluate_textures(compile_textures(scene), where, rows, "")
    start = COLUMNS["emission"][0]
    return rows[:, start : start + 3].astype(np.float64)


class _Points:
    """Points at which texture programs run: on the first corner of each face."""

    def __init__(self, count: int) -> None:
        self.face: I32 = np.arange(count, dtype=np.int32)
        self.ray_kind, self.backside, self.program = (np.zeros(count, np.int32) for _ in range(3))
        self.b1, self.b2 = (np.zeros(count, np.float32) for _ in range(2))
        self.position, self.normal, self.true_normal, self.view = (np.zeros((count, 3), np.float32) for _ in range(4))


def warn_about_adaptive(ob: Any, scene: Any, report: Report) -> None:
    """Warn of adaptive subdivision, which Cycles does while it renders."""
    for modifier in ob.modifiers:
        if modifier.type != "SUBSURF" or not modifier.show_render:
            continue
        # A setting of the modifier from Blender 5.0 on, and of the object, as an experimental feature, before.
        if hasattr(modifier, "use_adaptive_subdivision"):
            adaptive = modifier.use_adaptive_subdivision
        else:
            experimental = getattr(scene.cycles, "feature_set", "SUPPORTED") == "EXPERIMENTAL"
            adaptive = experimental and getattr(ob.cycles, "use_adaptive_subdivision", False)
        if adaptive:
            report.warn(f"object '{ob.name}', modifier '{modifier.name}'",
                        f"is subdivided adaptively by Cycles; here it has {modifier.render_levels} levels")  # fmt: skip
