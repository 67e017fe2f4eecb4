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


def vector(space: str, scale: float = 0.8) -> Vector:
    return lambda tree: node(tree, "VectorDisplacement", {
        "Vector": waves(tree, "Noise").outputs["Color"], "Midlevel": 0.5, "Scale": scale}, space=space)  # fmt: skip


def summed(tree: Any) -> Any:
    more = node(tree, "Displacement", {"Height": waves(tree, "Noise"), "Scale": 0.5}, space="WORLD")
    return node(tree, "VectorMath", {0: height(tree), 1: more}, operation="ADD")


def aside(space: str, varies: bool = True, scale: float = 0.3) -> Vector:
    """Along a given normal."""
    def along(tree: Any) -> Any:
        place = node(tree, "TexCoord").outputs["Object"] if varies else (0.0, 0.0, 0.0)
        given = node(tree, "VectorMath", {0: place, 1: (0.5, 0.3, 0.8)}, operation="ADD")
        return height(tree, space, Normal=given, Scale=scale)

    return along


def body(displacement: Vector, method: str, smooth: bool, scale: Any, shape: Any = None) -> None:
    made = stage.diffuse("M", (0.7, 0.7, 0.7))
    made.displacement_method = method
    tree = made.node_tree
    tree.links.new(displacement(tree).outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    shape = shape or stage.sphere("Ball", radius=1.0, segments=24, smooth=smooth)
    shape.materials.append(made)
    ob = stage.add("Body", shape, rotation=(0.4, 0.3, 0.2), scale=scale)
    finer = ob.modifiers.new("Finer", "SUBSURF")
    finer.subdivision_type, finer.levels, finer.render_levels = "SIMPLE", 2, 2


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
    "displacement", [vector("OBJECT"), vector("WORLD"), vector("TANGENT"), summed, aside("OBJECT"), aside("WORLD"),
                     aside("OBJECT", varies=False)],
    ids=["object", "world", "tangent", "sum", "given normal", "given normal of the world", "constant normal"],
)  # fmt: skip
def test_bump_of_displacement_is_that_of_cycles(displacement: Vector, scale: Any, tmp_path: Path) -> None:
    bs.empty(32)
    body(displacement, "BUMP", True, scale)
    found, lines = difference(tmp_path)
    assert found < 0.012 and lines == []


@pytest.mark.parametrize("displacement", [height, aside("OBJECT", scale=0.05), vector("TANGENT", 0.1)],
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
    assert difference(tmp_path)[0] < 0.012


@pytest.mark.parametrize("displacement", [lambda tree: height(tree, Scale=0.3), vector("TANGENT")],
                         ids=["normal", "tangent"])  # fmt: skip
@pytest.mark.parametrize("scale", [(0.7, 1.3, 1.0), (-1, 1, 1)], ids=["uneven", "mirrored"])
def test_flat_faces_stay_joined_when_they_are_displaced(displacement: Vector, scale: Any, tmp_path: Path) -> None:
    """Cycles displaces the vertices of flat faces along their smooth normals."""
    bs.empty(32)
    body(displacement, "DISPLACEMENT", False, scale, stage.cube("Cube", size=1.4))
    assert difference(tmp_path)[0] < 0.012
