"""Shader nodes evaluated by Cycles: one pixel for each value of their operands. Importing needs bpy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
from numpy.typing import NDArray

from tests.support.scenes import blender_scenes as bs


class Nodes:
    """The node tree of one case. `p` and `q` are its operands: vectors that each pixel has its own value of."""

    def __init__(self, tree: Any) -> None:
        self.tree = tree
        self.p = self.node("Attribute", attribute_name="P").outputs["Vector"]
        self.q = self.node("Attribute", attribute_name="Q").outputs["Vector"]

    def node(self, kind: str, inputs: dict[Any, Any] | None = None, **settings: Any) -> Any:
        """A node; `inputs` by name or index are sockets to link or values. Those not in use are passed over."""
        made = self.tree.nodes.new(f"ShaderNode{kind}")
        for key, value in settings.items():
            setattr(made, key, value)
        named = {socket.name: socket for socket in made.inputs}
        for key, value in (inputs or {}).items():
            socket = named.get(key) if isinstance(key, str) else made.inputs[key]
            if socket is None:
                continue
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return made

    def component(self, vector: Any, index: int) -> Any:
        """One component of a vector socket."""
        return self.node("SeparateXYZ", {0: vector}).outputs[index]


# The sockets of a case: its colour or vector, and its alpha or None.
Case = Callable[[Nodes], Any]


def render_nodes(
    cases: Sequence[Case], p: NDArray[np.float64], q: NDArray[np.float64], folder: Path
) -> NDArray[np.float32]:
    """(cases, n, 4) what Cycles computes for operands p and q, (n, 3), as colour and alpha.

    Each case is a row of squares of one pixel's size, whose operands are attributes of the face.
    """
    count = len(p)
    for row, case in enumerate(cases):
        material = bpy.data.materials.new(f"case {row}")
        material.use_nodes = True
        material.node_tree.nodes.clear()
        nodes = Nodes(material.node_tree)
        found = case(nodes)
        color, alpha = found if isinstance(found, tuple) else (found, 1.0)
        nodes.node("OutputAOV", {"Color": color}, aov_name="color")
        nodes.node("OutputAOV", {"Value": alpha}, aov_name="alpha")
        nodes.node("OutputMaterial", {"Surface": nodes.node("Emission").outputs[0]})
        bs.add(f"row {row}", _squares(count, row, p, q, material))
    _camera(count, len(cases))
    return _render(folder, len(cases), count)


def _squares(count: int, row: int, p: NDArray[np.float64], q: NDArray[np.float64], material: Any) -> Any:
    mesh = bpy.data.meshes.new("row")
    x = np.arange(count)[:, None] + np.array([0.0, 1.0, 1.0, 0.0])
    y = row + np.broadcast_to([0.0, 0.0, 1.0, 1.0], x.shape)
    corners = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    mesh.from_pydata(corners.tolist(), [], np.arange(4 * count).reshape(-1, 4).tolist())
    for name, values in (("P", p), ("Q", q)):
        attribute = mesh.attributes.new(name, "FLOAT_VECTOR", "FACE")
        attribute.data.foreach_set("vector", values.astype(np.float32).ravel())
    mesh.materials.append(material)
    return mesh


def _camera(width: int, height: int) -> None:
    camera = bs.camera(location=(0.5 * width, 0.5 * height, 5.0), rotation=(0.0, 0.0, 0.0))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = max(width, height)
    camera.data.sensor_fit = "HORIZONTAL" if width >= height else "VERTICAL"


def _render(folder: Path, rows: int, count: int) -> NDArray[np.float32]:
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = count, rows, 100
    cycles = scene.cycles
    cycles.device, cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", 1, False, False
    cycles.pixel_filter_type, scene.render.film_transparent = "BOX", False
    layer = scene.view_layers[0]
    for name, kind in (("color", "COLOR"), ("alpha", "VALUE")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(folder / "nodes.exr")
    bpy.ops.render.render(write_still=True)
    parts = {part.name().split(".")[-1]: part.channels for part in OpenEXR.File(scene.render.filepath, True).parts}
    names = [("color", c) for c in "RGB"] + [("alpha", "X")]
    out = np.stack([parts[part][f"ViewLayer.{part}.{c}"].pixels for part, c in names], axis=-1)
    return np.asarray(out[::-1], np.float32)
