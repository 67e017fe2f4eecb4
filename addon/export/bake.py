"""Baking of node outputs to images.

A node that no expression can represent is baked by Cycles. The bake works on a copy of the object in a temporary scene,
so Blender's data stay unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

import edgegrad

from .materials import BakedOutput
from .nodes import by_identifier, group_output

MARGIN = 8  # pixels around each UV island that repeat its border
SAMPLES = 4  # per pixel; bakes evaluate textures without lighting, so their only noise is that of antialiasing
UV_NAME = "Edgegrad bake"


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


class ObjectBaker:
    """A copy of an evaluated object with a new UV map, on which materials can be baked.

    Attributes
    ----------
    uv
        (c, 2) position in the baked images of each corner of Blender's mesh.
    """

    def __init__(self, keep: Temporary, evaluated: Any, depsgraph: Any, matrix: NDArray[np.float64],
                 resolution: int) -> None:  # fmt: skip
        self._keep = keep
        self._resolution = resolution
        self._scene = keep(bpy.data.scenes.new("Edgegrad bake"))
        self._scene.render.engine = "CYCLES"
        cycles = self._scene.cycles
        cycles.device, cycles.samples = "CPU", SAMPLES
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        self._mesh = keep(bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True,
                                                          depsgraph=depsgraph))  # fmt: skip
        self._object = keep(bpy.data.objects.new(evaluated.name, self._mesh))
        self._object.matrix_world = Matrix(matrix.tolist())  # a list would be read as columns
        self._object.color, self._object.pass_index = evaluated.color, evaluated.pass_index
        self._scene.collection.objects.link(self._object)
        self._scene.view_layers[0].objects.active = self._object
        self._object.select_set(True, view_layer=self._scene.view_layers[0])
        self._slots = [slot.material for slot in evaluated.material_slots]
        while len(self._mesh.materials) < max(1, len(self._slots)):
            self._mesh.materials.append(None)
        self.uv = self._unwrap()

    def _unwrap(self) -> NDArray[np.float32]:
        active = next((layer.name for layer in self._mesh.uv_layers if layer.active_render), None)
        layer = self._mesh.uv_layers.new(name=UV_NAME, do_init=False)
        if layer is None:
            raise BakeError("it already has the largest number of UV maps that a mesh can have; remove one")
        name = layer.name
        self._mesh.uv_layers.active = layer
        with self._context():
            bpy.ops.object.mode_set(mode="EDIT")
            try:
                with bpy.context.temp_override(edit_object=self._object, objects_in_mode=[self._object],
                                               objects_in_mode_unique_data=[self._object]):  # fmt: skip
                    bpy.ops.mesh.reveal()
                    bpy.ops.mesh.select_all(action="SELECT")
                    # smart_project takes margins as fractions of the image.
                    bpy.ops.uv.smart_project(island_margin=MARGIN / self._resolution, scale_to_bounds=False)
            finally:
                bpy.ops.object.mode_set(mode="OBJECT")
        layer = self._mesh.uv_layers[name]
        if active is not None:  # nodes without a map's name must keep reading the user's map
            self._mesh.uv_layers[active].active_render = True
        uv = np.empty((len(self._mesh.loops), 2), np.float32)
        layer.uv.foreach_get("vector", uv.ravel())
        return uv

    @contextmanager
    def _context(self) -> Iterator[None]:
        layer = self._scene.view_layers[0]
        with bpy.context.temp_override(scene=self._scene, view_layer=layer, object=self._object,
                                       active_object=self._object, selected_objects=[self._object],
                                       selected_editable_objects=[self._object]):  # fmt: skip
            yield

    def bake(self, material: Any, baked: BakedOutput) -> edgegrad.Image:
        """Bake the output of one node on this object to an image.

        Raises
        ------
        BakeError
            If Blender cannot bake it.
        """
        size = self._resolution
        with temporary() as keep:
            for k, slot in enumerate(self._slots or [None]):
                chosen = slot is not None and slot.original == material
                image = keep(bpy.data.images.new("Edgegrad bake", *(size, size) if chosen else (4, 4), alpha=True,
                                                 float_buffer=True, is_data=True))  # fmt: skip
                if chosen:
                    wired = keep(material.copy())
                    _wire(wired, baked, keep)
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


def _wire(material: Any, baked: BakedOutput, keep: Temporary) -> None:
    """Connect one output of a node to the surface of a copied material; groups around the node are copied too."""
    tree, around = material.node_tree, []
    for name in baked.groups:
        node = tree.nodes[name]
        node.node_tree = keep(node.node_tree.copy())
        around.append((tree, node))
        tree = node.node_tree
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
