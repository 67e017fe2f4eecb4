"""Normals of surfaces with a displacement, beside Cycles: bump of any displacement, and bump beside moved vertices."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.benchmarks.cycles_scenes import stage
from tests.support.scenes import blender_scenes as bs

Vector = Callable[[Any], Any]


def node(tree: Any, kind: str, inputs: Any = None, **settings: Any) -> Any:
    return stage.node(tree, f"ShaderNode{kind}", inputs, **settings)


def waves(tree: Any, kind: str = "Wave") -> Any:
    place = node(tree, "TexCoord").outputs["Object"]
    return node(tree, f"Tex{kind}", {"Vector": place, "Scale": 0.6} | ({"Detail": 0.0} if kind == "Noise" else {}))


def height(tree: Any, space: str = "OBJECT", **inputs: Any) -> Any:
    return node(tree, "Displacement", {"Height": waves(tree), "Scale": 0.1, **inputs}, space=space)


def vector(space: str) -> Vector:
    return lambda tree: node(tree, "VectorDisplacement", {
        "Vector": waves(tree, "Noise").outputs["Color"], "Midlevel": 0.5, "Scale": 0.8}, space=space)  # fmt: skip


def summed(tree: Any) -> Any:
    more = node(tree, "Displacement", {"Height": waves(tree, "Noise"), "Scale": 0.5}, space="WORLD")
    return node(tree, "VectorMath", {0: height(tree), 1: more}, operation="ADD")


def aside(space: str) -> Vector:
    """Along a given normal, whose part along the surface's normal counts."""
    return lambda tree: height(tree, space, Normal=node(tree, "CombineXYZ", {0: 0.5, 1: 0.3, 2: 0.8}), Scale=0.3)


def body(displacement: Vector, method: str, smooth: bool, scale: Any) -> None:
    made = stage.diffuse("M", (0.7, 0.7, 0.7))
    made.displacement_method = method
    tree = made.node_tree
    tree.links.new(displacement(tree).outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    ball = stage.sphere("Ball", made, radius=1.0, segments=24, smooth=smooth)
    stage.add("Ball", ball, rotation=(0.4, 0.3, 0.2), scale=scale)


def difference(tmp_path: Path) -> tuple[float, list[str]]:
    """Mean difference of both pictures, relative to the mean of Cycles' picture, and the warnings."""
    bpy.context.scene.cycles.samples = 64
    bs.camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0))
    stage.lamp("SUN", "Lamp", 3.0, (2.0, -1.0, 5.0), (0.0, 0.0, 0.0), angle=0.0)
    export = bs.export()
    ours = edgegrad.Renderer(export.scene).render(spp=64, max_depth=2)
    theirs = bs.cycles(tmp_path)[..., :3]
    return float(np.abs(ours - theirs).mean() / theirs.mean()), export.report.lines


@pytest.mark.parametrize("scale", [(1, 1, 1), (1.2, 0.7, 0.9)], ids=["even", "uneven"])
@pytest.mark.parametrize(
    "displacement", [vector("OBJECT"), vector("WORLD"), vector("TANGENT"), summed, aside("OBJECT"), aside("WORLD")],
    ids=["object", "world", "tangent", "sum", "given normal", "given normal of the world"])  # fmt: skip
def test_bump_of_displacement_is_that_of_cycles(displacement: Vector, scale: Any, tmp_path: Path) -> None:
    bs.empty(32)
    body(displacement, "BUMP", True, scale)
    found, lines = difference(tmp_path)
    assert found < 0.012 and lines == []


@pytest.mark.parametrize("displacement", [height, aside("OBJECT"), vector("TANGENT")],
                         ids=["normal", "given normal", "tangent"])  # fmt: skip
def test_flat_faces_with_bump_beside_displacement_are_smooth(displacement: Vector, tmp_path: Path) -> None:
    """Cycles bends the normals of the vertices, as before displacement."""
    bs.empty(32)
    body(displacement, "BOTH", False, (1, 1, 1))
    found, _ = difference(tmp_path)
    assert found < 0.012


@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_vertices_move_along_a_given_normal(space: str, tmp_path: Path) -> None:
    bs.empty(32)
    body(aside(space), "DISPLACEMENT", True, (1.2, 0.7, 0.9))
    found, lines = difference(tmp_path)
    assert found < 0.012 and lines == []
