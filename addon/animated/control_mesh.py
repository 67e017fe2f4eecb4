"""The vertices of a mesh under its modifiers: the linear map from them to the exported vertices.

Most stacks of modifiers (Subdivision, Mirror, Array, Armature, Hook …) are affine maps, and local ones: an exported
vertex depends on few vertices of the mesh. Their map is found by moving many vertices at once, which are so far from
each other that no exported vertex depends on two of them (Curtis, Powell & Reid 1974). A last evaluation moves them by
different lengths, which tells the vertex that an exported one depends on. The map is checked by random moves.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad.geometry.labels import summed
from edgegrad.scene.changes import StructureChange

from ..export.geometry.mesh import positions
from ..problem import Problem
from ..write_back.held import Held

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

# Distances, in faces, at which vertices move at once: those of Subdivision need 3.
REACHES = (1, 3, 4)
# Length of the moves, relative to the mesh; large ones have small rounding errors, and affine maps have no others.
MOVE = 4.0
# Curvature above which a map is not affine, and error of the map of a random move above which it is wrong.
MOST_CURVATURE, MOST_ERROR = 1e-4, 1e-3
SMALL, CHECKED = 0.02, 0.1  # random moves, relative to the mesh
# Entries below this are rounding.
LEAST_WEIGHT = 2e-6


@dataclass(frozen=True)
class LinearMap:
    """Blocks (e, 3, 3) of a sparse matrix: exported vertex `row` depends on vertex `column` of the mesh."""

    rows: I64
    columns: I64
    blocks: F64
    count: int

    def push(self, move: F64, rows: int) -> F64:
        """(rows, 3) moves of the exported vertices."""
        return summed(self.rows, np.einsum("eij,ej->ei", self.blocks, move[self.columns]), rows)

    def pull(self, gradient: F64) -> F64:
        """(count, 3) gradient by the vertices of the mesh."""
        return summed(self.columns, np.einsum("eij,ei->ej", self.blocks, gradient[self.rows]), self.count)


class ControlMesh:
    """The vertices of an object's mesh.

    Attributes
    ----------
    path
        Name of the variable.
    object
        The object.
    map
        To the exported vertices; None: not found yet.
    exported, exported_faces
        The exported vertices at the values of the map, and the triangles between them.
    """

    def __init__(self, name: str) -> None:
        self.object = bpy.data.objects[name]
        self._held = Held.of("objects", self.object)
        self.path = f'objects["{bpy.utils.escape_identifier(name)}"].data.vertices'
        self.map: LinearMap | None = None
        self.exported: F64 = np.zeros((0, 3))
        self.exported_faces = np.zeros((0, 3), np.int32)
        where = f"object '{name}'"
        mesh = self.object.data
        if mesh.shape_keys is not None:
            raise Problem(f"{where}: has shape keys and modifiers that move its vertices; fit the values of its shape "
                          "keys, or apply them or the modifiers first")  # fmt: skip
        self.pinned = self._on_mirrors()

    def renew(self) -> None:
        """Find the object again, after a change of its name or an undo; raise `Problem` if it was removed."""
        self.object = self._held.get()

    def read(self) -> F64:
        """(n, 3) positions in the space of the object."""
        return positions(self.object.data).astype(np.float64)

    def write(self, points: F64) -> None:
        """Set the positions, so that Blender evaluates all that depends on them."""
        mesh = self.object.data
        flat = np.ascontiguousarray(points, np.float32)
        if np.array_equal(flat, positions(mesh)):
            return
        mesh.attributes["position"].data.foreach_set("vector", flat.ravel())
        mesh.vertices[0].co = flat[0]  # an assignment to a vertex makes Blender update bounds and normals
        mesh.update()

    def faces(self) -> NDArray[np.int32]:
        """(m, 3) triangles of the mesh."""
        mesh = self.object.data
        mesh.calc_loop_triangles()
        out = np.empty((len(mesh.loop_triangles), 3), np.int32)
        mesh.loop_triangles.foreach_get("vertices", out.ravel())
        if not len(out):
            raise Problem(f"object '{self.object.name}': has no faces, so its vertices can't be fitted")
        return out

    def find(self, evaluated: Callable[[], F64], shape: Callable[[], F64]) -> None:
        """Find the map to the exported vertices, which `evaluated` returns.

        `shape` returns those of the object, whose number may change.

        Raises
        ------
        Problem
            If there is no such map; names the modifier and the cure.
        """
        base = self.read()
        try:
            self._refuse_curved(base, evaluated, shape)
            start = self._at(base, evaluated)
            extent = _extent(base)
            rng = np.random.default_rng(1)
            move = CHECKED * extent * rng.uniform(-1.0, 1.0, base.shape) * ~self.pinned
            moved = self._at(base + move, evaluated) - start
            error = np.inf
            for reach in REACHES:
                found = self._probed(base, start, extent, reach, evaluated)
                if found is None:
                    continue
                error = float(np.linalg.norm(found.push(move, len(start)) - moved) / np.linalg.norm(moved))
                if error < MOST_ERROR:
                    self.map, self.exported = found, start
                    return
            raise Problem(f"object '{self.object.name}': its vertices can't be fitted under {_names(self._active())}, "
                          "since each moves too much of what is rendered; apply that modifier, or switch it off in "
                          "renders")  # fmt: skip
        except StructureChange as change:
            raise Problem(f"object '{self.object.name}': its vertices can't be fitted under {_names(self._active())}, "
                          f"since {change} with them; apply that modifier, or switch it off in renders") from None
        finally:
            self.write(base)

    # ---- checks ----
    def _refuse_curved(self, base: F64, evaluated: Callable[[], F64], shape: Callable[[], F64]) -> None:
        """Refuse stacks that are not affine, and name the modifiers that alone are not."""
        if self._curvature(base, evaluated) < MOST_CURVATURE:
            return
        active = self._active()
        guilty = []
        for one in active:
            try:
                for other in active:
                    other.show_render = other == one
                if self._curvature(base, shape) >= MOST_CURVATURE:
                    guilty.append(one)
            finally:
                for other in active:
                    other.show_render = True
        raise Problem(f"object '{self.object.name}': its vertices can't be fitted under {_names(guilty or active)}, "
                      "which does not move what is rendered in proportion to them; apply that modifier, switch it "
                      "off in renders, or fit its properties instead")  # fmt: skip

    def _curvature(self, base: F64, evaluated: Callable[[], F64]) -> float:
        rng = np.random.default_rng(0)
        move = SMALL * _extent(base) * rng.uniform(-1.0, 1.0, base.shape) * ~self.pinned
        zero, one, two = (self._at(base + k * move, evaluated) for k in range(3))
        if one.shape != zero.shape or two.shape != zero.shape:
            return np.inf
        scale = float(np.linalg.norm(two - zero))
        return float(np.linalg.norm(two - 2.0 * one + zero)) / scale if scale > 0.0 else np.inf

    def _active(self) -> list[Any]:
        return [one for one in self.object.modifiers if one.show_render]

    def _on_mirrors(self) -> NDArray[np.bool_]:
        """(n, 3) coordinates that Mirror modifiers keep: of vertices on the plane where they merge."""
        points = self.read()
        out = np.zeros(points.shape, bool)
        for one in self._active():
            if one.type == "MIRROR" and one.use_mirror_merge and one.mirror_object is None:
                for axis in range(3):
                    if one.use_axis[axis]:
                        out[:, axis] |= np.abs(points[:, axis]) <= one.merge_threshold
        return out

    # ---- probing ----
    def _at(self, points: F64, evaluated: Callable[[], F64]) -> F64:
        self.write(points)
        return evaluated()

    def _probed(self, base: F64, start: F64, extent: float, reach: int,
                evaluated: Callable[[], F64]) -> LinearMap | None:  # fmt: skip
        """Find the map; None if vertices that moved at once have moved one exported vertex."""
        parts: list[tuple[I64, I64, F64]] = []
        h = MOVE * extent
        for members in _colors(self.object.data, reach):
            lengths = np.zeros(len(base))
            lengths[members] = 1.0
            responses = []
            for axis in range(3):
                move = np.zeros_like(base)
                move[:, axis] = h * lengths * ~self.pinned[:, axis]
                responses.append((self._at(base + move, evaluated) - start) / h)
            block = np.stack(responses, axis=2)  # (rows, 3, 3): by the axes of the mesh
            touched = np.flatnonzero(np.abs(block).max(axis=(1, 2)) > LEAST_WEIGHT)
            if not len(touched):
                continue
            which = np.zeros(len(touched), np.int64)
            if len(members) > 1:
                number = 1.0 + np.arange(1, len(members) + 1) / len(members)
                lengths[members] = number
                told = np.zeros((len(start), 3, 3))
                for axis in range(3):
                    if axis < 2 and not self.pinned[members].any():
                        continue  # one axis tells the vertex
                    move = np.zeros_like(base)
                    move[:, axis] = h * lengths * ~self.pinned[:, axis]
                    told[:, :, axis] = (self._at(base + move, evaluated) - start) / h
                used = np.abs(told[touched]).sum(axis=1, keepdims=True) > 0.0
                a, b = block[touched] * used, told[touched]
                squares = np.einsum("eij,eij->e", a, a)
                ratio = np.einsum("eij,eij->e", a, b) / np.where(squares > 0.0, squares, 1.0)
                which = np.rint((ratio - 1.0) * len(members)).astype(np.int64) - 1
                off = np.abs(ratio - 1.0 - (which + 1) / len(members)) * len(members)
                strong = np.sqrt(squares) > 1e-4
                if ((off > 0.2) | (which < 0) | (which >= len(members)))[strong].any():
                    return None
                good = (off <= 0.3) & (which >= 0) & (which < len(members))
                touched, which = touched[good], which[good]
            parts.append((touched, np.asarray(members)[which], block[touched]))
        if not parts:
            return None
        rows, columns, blocks = (np.concatenate(one) for one in zip(*parts, strict=True))
        return LinearMap(rows, columns, blocks, len(base))


def _extent(points: F64) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0


def _names(modifiers: list[Any]) -> str:
    names = ", ".join(f"'{one.name}'" for one in modifiers) or "its modifiers"
    return f"modifier {names}" if modifiers else names


def _colors(mesh: Any, reach: int) -> Iterator[list[int]]:
    """Yield groups of vertices of which no two are within `reach` faces or loose edges of each other."""
    near: list[set[int]] = [set() for _ in mesh.vertices]
    for group in (*(polygon.vertices for polygon in mesh.polygons), *(edge.vertices for edge in mesh.edges)):
        for vertex in group:
            near[vertex].update(group)
    within = near
    for _ in range(reach - 1):
        within = [set().union(*(near[other] for other in one)) if one else one for one in within]
    color = np.full(len(near), -1)
    groups: list[list[int]] = []
    for vertex, others in enumerate(within):
        taken = {color[other] for other in others}
        chosen = next(k for k in range(len(groups) + 1) if k not in taken)
        if chosen == len(groups):
            groups.append([])
        color[vertex] = chosen
        groups[chosen].append(vertex)
    yield from groups
