"""The alpha of attributes, beside Cycles: 1 where a layer has none or does not exist."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs


@pytest.mark.parametrize(("kind", "alpha"), [(None, 1.0), ("FLOAT_VECTOR", 1.0), ("FLOAT_COLOR", 0.25)])
def test_alpha_of_attributes(kind: str | None, alpha: float, tmp_path: Path) -> None:
    scene = bs.empty(16)
    scene.cycles.samples = 4
    bs.camera((0.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    made = bs.material("M", node="ShaderNodeEmission")
    mesh = bs.plane("Plane", 4.0, made)
    if kind is not None:
        layer = mesh.attributes.new("tone", kind, "POINT")
        name, value = ("color", (0.1, 0.2, 0.3, 0.25)) if kind == "FLOAT_COLOR" else ("vector", (0.1, 0.2, 0.3))
        layer.data.foreach_set(name, np.tile(np.float32(value), len(layer.data)))
    bs.add("Plane", mesh)
    read = made.node_tree.nodes.new("ShaderNodeAttribute")
    read.attribute_name = "tone"
    made.node_tree.links.new(read.outputs["Alpha"], bs.shader(made).inputs["Color"])
    export = bs.export()
    ours = edgegrad.Renderer(export.scene).render(spp=4, max_depth=1)
    assert np.allclose(ours, alpha, atol=1e-4)
    assert np.allclose(bs.cycles(tmp_path)[..., :3], alpha, atol=1e-3)
    assert not export.report.lines
