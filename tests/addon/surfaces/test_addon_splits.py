"""Meshes with split sharp edges have the numbers that Blender gives their vertices and edges."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

from edgegrad_addon.export.geometry.normals import as_rendered
from edgegrad_addon.export.geometry.splits import SPLITS, split

pytestmark = pytest.mark.usefixtures("lit_scene")


def body(shape: str) -> Any:
    """A mesh with flat faces and sharp edges among others."""
    add = {"cube": bpy.ops.mesh.primitive_cube_add, "monkey": bpy.ops.mesh.primitive_monkey_add,
           "grid": bpy.ops.mesh.primitive_grid_add}[shape]  # fmt: skip
    add()
    mesh = bpy.context.object.data
    generator = np.random.default_rng(1)
    mesh.polygons.foreach_set("use_smooth", generator.random(len(mesh.polygons)) < 0.8)
    edges = mesh.attributes.get("sharp_edge") or mesh.attributes.new("sharp_edge", "BOOLEAN", "EDGE")
    edges.data.foreach_set("value", generator.random(len(mesh.edges)) < 0.3)
    return mesh


def numbers(data: Any, name: str, width: int = 1) -> Any:
    out = np.empty((len(data), width), np.int32)
    data.foreach_get(name, out.ravel())
    return out[:, 0] if width == 1 else out


@pytest.mark.parametrize("shape", ["cube", "monkey", "grid"])
def test_splits_have_blenders_numbers(shape: str) -> None:
    mesh = body(shape)
    found = split(mesh)
    blenders = mesh.copy()
    blenders.split_faces()
    assert found.vertices == len(blenders.vertices) > len(mesh.vertices)
    np.testing.assert_array_equal(found.corners, numbers(blenders.loops, "vertex_index"))
    np.testing.assert_array_equal(found.edges, numbers(blenders.edges, "vertices", 2))
    before, after = (numbers(one.loops, "edge_index") for one in (mesh, blenders))
    np.testing.assert_array_equal(found.origin[after], before)


@pytest.mark.skipif(not SPLITS, reason="Cycles has normals of corners from Blender 5.1 on")
def test_meshes_are_split_for_normals_of_corners_only() -> None:
    mesh = body("monkey")
    assert as_rendered(mesh).vertices > len(mesh.vertices)
    mesh.attributes["sharp_edge"].data.foreach_set("value", np.zeros(len(mesh.edges), bool))
    assert as_rendered(mesh).vertices == len(mesh.vertices)  # flat faces alone need no normals of corners
    mesh.polygons.foreach_set("use_smooth", np.zeros(len(mesh.polygons), bool))
    mesh.attributes["sharp_edge"].data.foreach_set("value", np.arange(len(mesh.edges)) % 2 == 0)
    assert as_rendered(mesh).vertices == len(mesh.vertices)
