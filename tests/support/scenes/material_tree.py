"""A material in Blender whose nodes a test builds, and what is exported of it."""

from __future__ import annotations

from typing import Any

from tests.support.scenes import blender_scenes as bs


class Tree:
    """A material with one Principled node, on a cube."""

    def __init__(self, shader: Any = "ShaderNodeBsdfPrincipled", **inputs: Any) -> None:
        self.material = bs.material("M", (0.5, 0.5, 0.5), shader, **inputs)
        self.tree = self.material.node_tree
        self.shader = bs.shader(self.material)
        self.object = bs.add("Cube", bs.cube("Cube", self.material))
        self.object.data.uv_layers.new(name="UVMap")

    def node(self, kind: Any, **settings: Any) -> Any:
        node = self.tree.nodes.new("ShaderNode" + kind)
        for key, value in settings.items():
            setattr(node, key, value)
        return node

    def link(self, output: Any, to: Any) -> None:
        self.tree.links.new(output, self.shader.inputs[to] if isinstance(to, str) else to)

    def surface(self, output: Any) -> None:
        self.tree.links.new(output, self.tree.get_output_node("CYCLES").inputs["Surface"])

    def export(self) -> Any:
        self.made = bs.export(bake=32)
        self.made.scene.validate()
        return self.made.scene.materials["M"]
