"""Baking of node outputs to images.

A node that no expression can represent is baked by Cycles. The bake works on a copy of the object in a temporary scene,
so Blender's data stay unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

import edgegrad

from ..geometry.attributes import CLOSED_SPHERE, around_sphere
from ..materials.material import BakedOutput
from ..nodes.constants import Place, Values
from ..nodes.links import by_identifier, group_output
from .trees import Trees, insert
from .unwrap import widened

MARGIN = 2  # pixels around each UV island that repeat its border: interpolation reads one of them
SAMPLES = 4  # per pixel; bakes evaluate textures without lighting, so their only noise is that of antialiasing
OCCLUSION_SAMPLES = 32  # the same of Ambient Occlusion, which is noisy
UV_NAME, ZERO_NAME, SPHERE_NAME = "Edgegrad bake", "Edgegrad none", "Edgegrad sphere"
OUTSIDE = -1.0  # coordinate of faces that are not baked


class BakeError(Exception):
    """Raised if a bake fails; its text is the reason."""


@dataclass
class Temporary:
    """Blender's data that are removed at the end, also after an error."""

    data: list[Any] = field(default_factory=list)
    found: list[Callable[[], Any]] = field(default_factory=list)

    def later(self, find: Callable[[], Any]) -> None:
        """Register data that Blender will create; `find` returns them at the end, or None."""
        self.found.append(find)

    def __call__(self, new: Any) -> Any:
        """Register new data, and return them."""
        self.data.append(new)
        return new

    def remove(self) -> None:
        """Remove all registered data in reverse order of their creation."""
        self.data = [one for find in self.found if (one := find()) is not None] + self.data
        self.found = []
        while self.data:
            bpy.data.batch_remove([self.data.pop()])


@contextmanager
def temporary() -> Iterator[Temporary]:
    """Provide data that exist only within the block."""
    held = Temporary()
    try:
        yield held
    finally:
        held.remove()


def new_scene() -> Any:
    """An empty scene at the frame of the exported one, which decides the frames of movies and image sequences."""
    out, source = bpy.data.scenes.new("Edgegrad bake"), bpy.context.scene
    out.frame_current, out.frame_subframe = source.frame_current, source.frame_subframe
    return out


@dataclass
class CopiedObject:
    """What bakes need of an instance, which Blender's iterator invalidates.

    Attributes
    ----------
    mesh
        Copy of its evaluated mesh, which may be one that only its instancer has.
    matrix
        Rows of its transform to world space.
    color, index
        Colour and pass index of the object.
    """

    mesh: Any
    matrix: list[tuple[float, ...]]
    color: tuple[float, ...]
    index: int

    @staticmethod
    def of(keep: Temporary, instance: Any) -> CopiedObject:
        """Copy an instance while the iterator is at it; `keep` owns the mesh."""
        ob = instance.object
        matrix, color, index = [tuple(row) for row in instance.matrix_world], tuple(ob.color), ob.pass_index
        return CopiedObject(keep(ob.data.copy()), matrix, color, index)


class ObjectBaker:
    """A copy of an object in a scene of its own, with a UV map for the images that materials are baked to.

    The map has the faces of these materials only. Each of them covers texels of its own, however small it is.

    Parameters
    ----------
    keep
        Owns what is made.
    copied
        The object.
    slots
        Full name of the material of each slot.
    materials
        Full names of the materials to bake.
    resolution
        Width and height of the images, pixels.
    occluders
        Mesh of what Ambient Occlusion sees beside the object, in world space; None: nothing.

    Attributes
    ----------
    uv
        (c, 2) position in the baked images of each corner of Blender's mesh.
    """

    def __init__(self, keep: Temporary, copied: CopiedObject, slots: tuple[str, ...], materials: Collection[str],
                 resolution: int, occluders: Any = None) -> None:  # fmt: skip
        self._resolution = resolution
        self._slots = slots
        self._mesh = copied.mesh
        self._scene = keep(new_scene())
        self._scene.render.engine = "CYCLES"
        cycles = self._scene.cycles
        cycles.device, cycles.samples = "CPU", SAMPLES if occluders is None else OCCLUSION_SAMPLES
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        self._object = keep(bpy.data.objects.new("Edgegrad bake", self._mesh))
        self._object.matrix_world = Matrix(copied.matrix)  # a list would be read as columns
        self._object.color, self._object.pass_index = copied.color, copied.index
        self._scene.collection.objects.link(self._object)
        if occluders is not None:
            self._scene.collection.objects.link(keep(bpy.data.objects.new("Edgegrad bake", keep(occluders))))
        self._scene.view_layers[0].objects.active = self._object
        self._object.select_set(True, view_layer=self._scene.view_layers[0])
        while len(self._mesh.materials) < max(1, len(slots)):
            self._mesh.materials.append(None)
        self.uv = self._unwrap([k for k, slot in enumerate(slots) if slot in materials])

    def _unwrap(self, slots: list[int]) -> NDArray[np.float32]:
        """Lay the faces of these slots out in a new UV map."""
        mesh = self._mesh
        active = next((layer.name for layer in mesh.uv_layers if layer.active_render), None)
        layer = mesh.uv_layers.new(name=UV_NAME, do_init=False)
        if layer is None:
            raise BakeError("it already has the largest number of UV maps that a mesh can have; remove one")
        name = layer.name
        mesh.uv_layers.active = layer
        chosen = self._chosen(slots)
        # Margins are fractions of the image.
        margin = MARGIN / self._resolution
        self._edit(slots, lambda: bpy.ops.uv.smart_project(island_margin=margin, scale_to_bounds=False))
        uv = self._read(name)
        uv[~chosen] = OUTSIDE
        wide = widened(uv, chosen, self._loops("vertex_index", len(mesh.loops)), self._sizes(), self._resolution)
        if wide is not None:
            mesh.uv_layers[name].uv.foreach_set("vector", wide.ravel())
            self._edit(slots, lambda: bpy.ops.uv.pack_islands(rotate=False, margin_method="FRACTION", margin=margin,
                                                              shape_method="AABB"))  # fmt: skip
            uv = self._read(name)
            uv[~chosen] = OUTSIDE
        mesh.uv_layers[name].uv.foreach_set("vector", uv.ravel())
        self._unmapped = active is None
        if self._unmapped and self._read_zero():
            active = ZERO_NAME
        if active is not None:  # nodes without a map's name must keep reading the user's map
            mesh.uv_layers[active].active_render = True
        return uv

    def _read_zero(self) -> bool:
        """Add what Cycles reads on a mesh without a UV map: coordinates 0, and tangents around a sphere."""
        mesh = self._mesh
        vertices, sizes = self._loops("vertex_index", len(mesh.loops)), self._sizes()
        across = around_sphere(mesh)[vertices]
        # A face between u = 1 and u = 0 goes on beyond 1.
        face = np.repeat(np.arange(len(sizes)), sizes)
        high = np.zeros(len(sizes), np.float32)
        np.maximum.at(high, face, across[:, 0])
        across[:, 0] += CLOSED_SPHERE & (high[face] - across[:, 0] > 0.5)
        for name, uv in ((SPHERE_NAME, across), (ZERO_NAME, np.zeros_like(across))):
            layer = mesh.uv_layers.new(name=name, do_init=False)
            if layer is None:
                return False
            layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())
        return True

    def _read(self, layer: str) -> NDArray[np.float32]:
        uv = np.empty((len(self._mesh.loops), 2), np.float32)
        self._mesh.uv_layers[layer].uv.foreach_get("vector", uv.ravel())
        return uv

    def _loops(self, field: str, count: int) -> NDArray[np.int32]:
        out = np.empty(count, np.int32)
        self._mesh.loops.foreach_get(field, out)
        return out

    def _sizes(self) -> NDArray[np.int32]:
        out = np.empty(len(self._mesh.polygons), np.int32)
        self._mesh.polygons.foreach_get("loop_total", out)
        return out

    def _chosen(self, slots: list[int]) -> NDArray[np.bool_]:
        """(c,) whether each corner belongs to a face of these slots. Cycles uses the last slot for larger indices."""
        slot = np.empty(len(self._mesh.polygons), np.int32)
        self._mesh.polygons.foreach_get("material_index", slot)
        slot = np.clip(slot, 0, max(0, len(self._slots) - 1)).astype(np.int32)
        self._mesh.polygons.foreach_set("material_index", slot)
        return np.repeat(np.isin(slot, slots), self._sizes())

    def _edit(self, slots: list[int], act: Callable[[], Any]) -> None:
        """Run an operator on the faces of these slots."""
        with self._context():
            bpy.ops.object.mode_set(mode="EDIT")
            try:
                with bpy.context.temp_override(edit_object=self._object, objects_in_mode=[self._object],
                                               objects_in_mode_unique_data=[self._object]):  # fmt: skip
                    bpy.ops.mesh.reveal(select=False)
                    bpy.ops.mesh.select_all(action="DESELECT")
                    for slot in slots:
                        self._object.active_material_index = slot
                        bpy.ops.object.material_slot_select()
                    act()
            finally:
                bpy.ops.object.mode_set(mode="OBJECT")

    @contextmanager
    def _context(self) -> Iterator[None]:
        layer = self._scene.view_layers[0]
        with bpy.context.temp_override(scene=self._scene, view_layer=layer, object=self._object,
                                       active_object=self._object, selected_objects=[self._object],
                                       selected_editable_objects=[self._object]):  # fmt: skip
            yield

    def bake(self, material: Any, baked: BakedOutput, constants: Mapping[Place, Values]) -> edgegrad.Image:
        """Bake the output of one node on this object to an image, with constants of the rendered object.

        Raises
        ------
        BakeError
            If Blender cannot bake it.
        """
        size = self._resolution
        with temporary() as keep:
            for k, slot in enumerate(self._slots):
                chosen = slot == material.name_full
                image = keep(bpy.data.images.new("Edgegrad bake", *(size, size) if chosen else (4, 4), alpha=True,
                                                 float_buffer=True, is_data=True))  # fmt: skip
                if chosen:
                    wired = keep(material.copy())
                    _wire(wired, baked, constants, self._unmapped, keep)
                    target = image
                else:
                    wired = keep(bpy.data.materials.new("Edgegrad bake"))
                    if wired.node_tree is None:
                        wired.use_nodes = True
                _take_image(wired, image)
                self._mesh.materials[k] = wired
            try:
                with self._context():
                    bpy.ops.object.bake(type="NORMAL" if baked.normal else "EMIT", normal_space="TANGENT",
                                        margin=MARGIN, margin_type="EXTEND", use_clear=True, uv_layer=UV_NAME,
                                        target="IMAGE_TEXTURES", save_mode="INTERNAL",
                                        use_selected_to_active=False)  # fmt: skip
            except RuntimeError as error:
                raise BakeError(str(error).strip().splitlines()[-1]) from None
            finally:
                for k in range(len(self._mesh.materials)):
                    self._mesh.materials[k] = None
            pixels = np.empty(size * size * 4, np.float32)
            target.pixels.foreach_get(pixels)
        return edgegrad.Image(_filled(pixels.reshape(size, size, 4)[::-1]))


def _filled(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """(H, W, 3) colours; pixels outside the bake get the mean of the baked ones, which keeps the mean of the image."""
    color = np.nan_to_num(pixels[..., :3], posinf=0.0, neginf=0.0)
    covered = pixels[..., 3] > 0.0
    if covered.any():
        color[~covered] = color[covered].mean(axis=0)
    return np.ascontiguousarray(color)


def _take_image(material: Any, image: Any) -> None:
    nodes = material.node_tree.nodes
    node = nodes.new("ShaderNodeTexImage")
    node.image = image
    for other in nodes:
        other.select = other == node
    nodes.active = node


def _wire(
    material: Any, baked: BakedOutput, constants: Mapping[Place, Values], unmapped: bool, keep: Temporary
) -> None:  # fmt: skip
    """Connect one output of a node to the surface of a copied material; groups around the node are copied too.

    Parameters
    ----------
    unmapped
        Whether the mesh has no UV map of the user's.
    """
    trees = Trees(material, keep)
    insert(constants, trees)
    for groups, name in baked.tangents if unmapped else ():
        trees.inside(groups).nodes[name].uv_map = SPHERE_NAME
    tree, around = trees.inside(baked.groups), list(trees.around(baked.groups))
    socket = by_identifier(tree.nodes[baked.node].outputs, baked.output)
    kind = "NodeSocketVector" if baked.normal else "NodeSocketColor"
    for outer, node in reversed(around):
        inner = node.node_tree
        made = inner.interface.new_socket("Edgegrad bake", in_out="OUTPUT", socket_type=kind)
        inner.links.new(socket, by_identifier(group_output(node).inputs, made.identifier))
        socket, tree = by_identifier(node.outputs, made.identifier), outer
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse" if baked.normal else "ShaderNodeEmission")
    tree.links.new(socket, shader.inputs["Normal" if baked.normal else "Color"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    for other in tree.nodes:
        if other.type == "OUTPUT_MATERIAL":
            other.is_active_output = other == output
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
