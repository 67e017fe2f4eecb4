"""Normal maps against Cycles: the same light at every pixel, without noise."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.scenes import blender_scenes as bs


def sphere(smooth: bool, material: Any, scale: Any = (1.0, 1.0, 1.0)) -> Any:
    """A sphere with UV map, tilted."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=12, radius=1.0, rotation=(0.5, 0.3, 0.2), scale=scale)
    ob = bpy.context.object
    for face in ob.data.polygons:
        face.use_smooth = smooth
    ob.data.materials.append(material)
    return ob


def both(folder: Path) -> tuple[Any, Any]:
    return edgegrad.render(bs.export().scene, spp=64), bs.cycles(folder)


@pytest.mark.parametrize("strength", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("smooth", [True, False])
def test_from_inside(strength: float, smooth: bool, tmp_path: Path) -> None:
    # No terminator and no shadow is in sight: every pixel agrees. The back of the surface is seen.
    bs.empty()
    bs.camera((0.0, 0.0, 0.2))
    bs.light("POINT", location=(0.3, 0.2, 0.1), energy=100.0, color=(1.0, 0.5, 0.2))
    sphere(smooth, bs.normal_mapped(strength))
    ours, theirs = both(tmp_path)
    assert np.abs(ours - theirs).mean() < 2e-3 * theirs.mean()
    assert ours.mean() == pytest.approx(theirs.mean(), rel=3e-4)


@pytest.mark.parametrize("node", ["ShaderNodeBsdfDiffuse", "ShaderNodeBsdfGlossy", "ShaderNodeBsdfPrincipled"])
def test_from_outside(node: str, tmp_path: Path) -> None:
    bs.empty(96)
    bs.camera((0.0, 0.0, 5.0))
    bs.light("SUN", rotation=(0.3, 0.2, 0.0), energy=3.0)
    sphere(True, bs.normal_mapped(1.0, node))
    ours, theirs = both(tmp_path)
    assert np.abs(ours - theirs).mean() < 6e-3 * theirs.mean()
    assert ours.mean() == pytest.approx(theirs.mean(), rel=3e-3)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 2.5), (2.0, 0.6, 1.0), (-1.0, 1.0, 2.0)], ids=str)
@pytest.mark.parametrize("instanced", [False, True])
def test_uneven_scale(scale: tuple[float, float, float], instanced: bool, tmp_path: Path) -> None:
    # Cycles computes the frame of a normal map in the object's space, and turns its vectors as it turns normals.
    bs.empty(96)
    bs.camera((0.0, 0.0, 6.0))
    bs.light("SUN", rotation=(0.3, 0.2, 0.0), energy=3.0)
    ob = sphere(True, bs.normal_mapped(1.0))
    ob.scale = scale
    if instanced:
        bs.add("Second", ob.data, (50.0, 0.0, 0.0))
    bpy.context.view_layer.update()
    ours, theirs = both(tmp_path)
    assert np.abs(ours - theirs).mean() < 3e-3 * theirs.mean()
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)


def test_the_bend_is_seen(tmp_path: Path) -> None:
    bs.empty()
    bs.camera((0.0, 0.0, 0.2))
    bs.light("POINT", location=(0.3, 0.2, 0.1), energy=100.0)
    sphere(True, bs.normal_mapped(1.0))
    bent = edgegrad.render(bs.export().scene, spp=16)
    bs.shader(bpy.data.materials["Bent"]).inputs["Normal"].links[0].from_node.inputs["Strength"].default_value = 0.0
    assert np.abs(edgegrad.render(bs.export().scene, spp=16) - bent).mean() > 0.02 * bent.mean()
