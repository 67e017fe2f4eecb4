"""Shader inputs beyond their ranges, which only links can give, compared with Cycles."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")
if bpy.app.version < (5, 0, 0):
    pytest.skip("the nodes' sockets are named as in Blender 5.0", allow_module_level=True)

import edgegrad
from tests.support.scenes import blender_scenes as bs

LAYERS = {
    "Roughness": 0.5, "Coat Weight": 0.5, "Coat Roughness": 0.3, "Coat Tint": (0.3, 0.6, 0.8, 1.0), "Sheen Weight": 0.5,
    "Sheen Roughness": 0.4, "Metallic": 0.3, "Transmission Weight": 0.3,
}  # fmt: skip
INPUTS = ("Coat Weight", "Sheen Weight", "Alpha", "Metallic", "Transmission Weight", "Specular IOR Level", "Roughness",
          "Base Color", "Specular Tint", "Coat Tint", "Sheen Tint", "Coat Roughness", "Diffuse Roughness")  # fmt: skip


@pytest.mark.parametrize("name", INPUTS)
def test_inputs_from_below_to_beyond_their_range(name: str, tmp_path: Path) -> None:
    """Along the picture's rows an input grows from -3 to 5. A sun's light, without noise."""
    bs.empty(24)
    bs.camera((0.0, 0.0, 5.0), (0.1, 0.2, 0.0))
    bs.light("SUN", rotation=(0.5, 0.3, 0.0), energy=3.0)
    made = bs.material("Layered", (0.8, 0.5, 0.3), "ShaderNodeBsdfPrincipled", **LAYERS)
    tree = made.node_tree
    place, parts = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeSeparateXYZ")
    grows = tree.nodes.new("ShaderNodeMath")
    grows.operation = "MULTIPLY_ADD"
    grows.inputs[1].default_value, grows.inputs[2].default_value = 2.3, 3.3
    tree.links.new(place.outputs["Position"], parts.inputs[0])
    tree.links.new(parts.outputs["X"], grows.inputs[0])
    tree.links.new(grows.outputs[0], bs.shader(made).inputs[name])
    bs.add("Plane", bs.plane("Plane", 40.0, made))
    scene = bs.export().scene
    ours, theirs = edgegrad.render(scene, spp=64, max_depth=2), bs.cycles(tmp_path)
    assert theirs.mean() > 0.01
    # Which paths go through is left to chance.
    assert np.abs(ours - theirs).mean() < (2e-2 if name == "Alpha" else 5e-3) * theirs.mean()
    assert ours.min() >= 0.0
