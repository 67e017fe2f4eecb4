"""Smooth normals of unevenly scaled bodies, interpolated in object space or in the world as by Cycles."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from edgegrad.expression import Expression
from edgegrad_addon.evaluation import evaluate
from edgegrad_addon.export.geometry.memory import Memory
from edgegrad_addon.export.scene import export_evaluated
from tests.support.block_statistics import block_sums
from tests.support.scenes import blender_scenes as bs

FLAT, ASIDE = (0.5, 0.5, 1.0, 1.0), (0.55, 0.6, 1.0, 1.0)


def ball(color: tuple[float, ...], strength: float, scale: tuple[float, ...]) -> Any:
    """A coarse smooth ball with a normal map of one color, in the sun; returns its material."""
    made = bare_ball(scale)
    bent = made.node_tree.nodes.new("ShaderNodeNormalMap")
    bent.inputs["Strength"].default_value, bent.inputs["Color"].default_value = strength, color
    made.node_tree.links.new(bent.outputs[0], bs.shader(made).inputs["Normal"])
    return made


def bare_ball(scale: tuple[float, ...], kind: str = "ShaderNodeBsdfAnisotropic") -> Any:
    """A coarse smooth ball in the sun; returns its material."""
    scene = bs.empty(64)
    scene.cycles.samples, scene.cycles.max_bounces = 64, 0
    bs.camera((0.0, -5.0, 1.0), (1.37, 0.0, 0.0))
    bs.light("SUN", rotation=(0.6, 0.3, 0.0), energy=2.0)
    made = bs.material("M", (0.7, 0.6, 0.5), kind, Roughness=0.3)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=10, ring_count=6)
    bpy.context.object.scale = scale
    bpy.ops.object.shade_smooth()
    bs.offset_shadow_rays(bpy.context.object, 0.0)
    bpy.context.object.data.materials.append(made)
    return made


def displace(made: Any, method: str = "BUMP", scale: float = 0.2) -> None:
    """Displace a material by noise."""
    nodes, links = made.node_tree.nodes, made.node_tree.links
    made.displacement_method = method
    noise, node = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeDisplacement")
    node.inputs["Scale"].default_value = scale
    links.new(noise.outputs[0], node.inputs["Height"])
    links.new(node.outputs[0], made.node_tree.get_output_node("CYCLES").inputs["Displacement"])


def difference(folder: Path) -> float:
    """Root mean square of the differences of blocks, as a part of the picture's mean."""
    made = bs.export()
    ours = edgegrad.Renderer(made.scene).render(spp=64, max_depth=made.settings.max_depth)
    theirs = bs.cycles(folder)[..., :3]
    apart = block_sums(np.array([ours - theirs], np.float64), 8) / 64.0
    return float(np.sqrt(np.mean(apart**2)) / theirs.mean())


@pytest.mark.parametrize(("color", "strength"), [(FLAT, 1.0), (ASIDE, 0.0), (ASIDE, 1.0)])
def test_flat_normal_maps_interpolate_normals_in_object_space(color: Any, strength: float, tmp_path: Path) -> None:
    ball(color, strength, (1.0, 0.25, 1.6))
    assert difference(tmp_path) < 0.04


@pytest.mark.parametrize("color", [FLAT, ASIDE, None])
@pytest.mark.parametrize("scale", [(1.2, 1.2, 1.2), (1.0, 0.4, 1.6)])
def test_normal_maps_take_the_place_of_bump_by_displacement(color: Any, scale: Any, tmp_path: Path) -> None:
    made = ball(color or FLAT, 1.0, scale)
    if color is None:
        made.node_tree.nodes.remove(next(n for n in made.node_tree.nodes if n.type == "NORMAL_MAP"))
    displace(made)
    assert difference(tmp_path) < 0.04


def test_normal_maps_where_uv_maps_are_squeezed(tmp_path: Path) -> None:
    """Rings of faces have the UV coordinates of their upper edge, as extruded ones do.

    The signs of bitangents differ between the corners of such a face, and are interpolated.
    """
    ball((0.5, 0.85, 0.85, 1.0), 1.0, (1.0, 1.0, 1.0))
    data = bpy.context.object.data
    for face in data.polygons:
        heights = {k: data.vertices[data.loops[k].vertex_index].co.z for k in face.loop_indices}
        if -0.1 < max(heights.values()) < 0.9 and len(heights) == 4:
            top = max(data.uv_layers[0].uv[k].vector.y for k in face.loop_indices)
            for k in face.loop_indices:
                data.uv_layers[0].uv[k].vector.y = top
    assert difference(tmp_path) < 0.04


def test_flat_normal_maps_without_effect_are_left_out() -> None:
    made = ball(FLAT, 1.0, (1.2, 1.2, 1.2))
    value = bs.export().scene.materials[made.name]
    assert isinstance(value, edgegrad.Material) and not any(isinstance(x, Expression) for x in value.textures.values())


def share() -> Any:
    """Add an object with the ball's mesh, outside the picture, that other rays see."""
    other = bpy.context.object.copy()
    bpy.context.scene.collection.objects.link(other)
    other.location, other.visible_diffuse = (0.0, 0.0, -40.0), False
    return other


def scatter(made: Any) -> None:
    """Let a little light scatter just below the surface of a metal."""
    for name, value in {"Metallic": 1.0, "Subsurface Weight": 0.002, "Subsurface Scale": 0.001}.items():
        bs.shader(made).inputs[name].default_value = value


@pytest.mark.parametrize("case", ["anisotropic", "shared", "scattering", "displaced"])
def test_normals_are_interpolated_in_the_space_of_cycles(case: str, tmp_path: Path) -> None:
    """Cycles places meshes in the world, except for those that are shared, displaced or scatter light inside."""
    made = bare_ball((1.0, 0.25, 1.6), "ShaderNodeBsdf" + ("Principled" if case == "scattering" else "Anisotropic"))
    if case == "anisotropic":
        bs.shader(made).inputs["Anisotropy"].default_value = 0.01
    elif case == "shared":
        share()
    elif case == "scattering":
        scatter(made)
    else:
        displace(made, "DISPLACEMENT", 0.0)
    assert difference(tmp_path) < 0.04


@pytest.mark.parametrize("scale", [(1.2, 1.2, 1.2), (1.0, 0.4, 1.6)])
def test_anisotropy_around_an_axis_beside_a_normal_map(scale: Any, tmp_path: Path) -> None:
    """The map has tangents along its UV map, and anisotropy has those around the object's axis."""
    made = ball(ASIDE, 0.8, scale)
    bs.shader(made).inputs["Anisotropy"].default_value = 0.8
    assert difference(tmp_path) < 0.04
    assert not any("anisotropy" in line for line in bs.export().report.lines)


def test_later_exports_keep_the_space_of_the_first() -> None:
    """A derivative by an object's scale compares exports with an even and an uneven scale."""
    ball(ASIDE, 1.0, (1.0, 1.0, 1.0))
    memory = Memory()
    for height in (1.0, 1.001):
        bpy.context.object.scale = (1.0, 1.0, height)
        made = evaluate(bpy.context.scene, lambda now: export_evaluated(now, [], memory=memory))
        assert np.array_equal(made.scene.meshes["Sphere"].transform, np.eye(4))
