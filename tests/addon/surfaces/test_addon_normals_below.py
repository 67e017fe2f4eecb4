"""Normals that point below the surface, beside Cycles: each closure has its own normal and its own shadowing there."""

# ruff: noqa: E402  (the imports below need bpy)

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="Blender's Python module isn't installed")

import edgegrad
from tests.support.block_statistics import block_sums
from tests.support.scenes import blender_scenes as bs

UP, ASIDE = (0.5, 0.5, 1.0, 1.0), (0.9, 0.3, 0.7, 1.0)
ANISOTROPIC, PRINCIPLED = "ShaderNodeBsdfAnisotropic", "ShaderNodeBsdfPrincipled"
SHADERS: dict[str, tuple[str, dict[str, Any]]] = {
    "diffuse": ("ShaderNodeBsdfDiffuse", {}),
    "rough diffuse": ("ShaderNodeBsdfDiffuse", {"Roughness": 0.7}),
    "translucent": ("ShaderNodeBsdfTranslucent", {}),
    "sheen": ("ShaderNodeBsdfSheen", {"Roughness": 0.5}),
    "velvet": ("ShaderNodeBsdfSheen", {"Roughness": 0.5}),
    "glossy": (ANISOTROPIC, {"Roughness": 0.4}),
    "beckmann": (ANISOTROPIC, {"Roughness": 0.4}),
    "anisotropic": (ANISOTROPIC, {"Roughness": 0.4, "Anisotropy": 0.6, "Rotation": 0.15}),
    "mirror": (ANISOTROPIC, {"Roughness": 0.0}),
    "glass": ("ShaderNodeBsdfGlass", {"Roughness": 0.3}),
    "smooth glass": ("ShaderNodeBsdfGlass", {"Roughness": 0.0}),
    "refraction": ("ShaderNodeBsdfRefraction", {"Roughness": 0.3}),
    "metal": (PRINCIPLED, {"Metallic": 1.0, "Roughness": 0.4, "Anisotropic": 0.8, "Anisotropic Rotation": 0.15}),
    "transmission": (PRINCIPLED, {"Transmission Weight": 1.0, "Roughness": 0.3}),
    "principled": (PRINCIPLED, {}),
    "coat": (PRINCIPLED, {"Coat Weight": 1.0, "Coat Roughness": 0.3}),
    "principled sheen": (PRINCIPLED, {"Sheen Weight": 1.0}),
}
DISTRIBUTIONS = {"velvet": "ASHIKHMIN", "beckmann": "BECKMANN"}
# Gloss over a diffuse base: in light that Cycles finds by scattered rays alone, it is too bright there by its own
# sampling, which the export names.
LAYERED = {"principled", "coat", "principled sheen"}
SMOOTH = ["glossy", "translucent", "velvet", "mirror", "glass"]
SAMPLES, SEEDS = 128, 3


def ball(shader: str, color: tuple[float, ...], light: str, faces: str) -> Any:
    """A ball whose normals are all the same, above a floor, in the sun or under a sky.

    Its faces are flat, smooth, or smooth with light that is dimmed at grazing angles.
    """
    scene = bs.empty(48)
    cycles = scene.cycles
    cycles.samples, cycles.max_bounces = SAMPLES, 3
    cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 3
    cycles.blur_glossy = cycles.sample_clamp_indirect = 0.0
    bs.camera((0.0, -4.0, 1.0), (1.35, 0.0, 0.0))
    if light == "sky":
        bs.world((0.6, 0.6, 0.7))
    else:
        bs.light("SUN", rotation=(0.6, 0.3, 0.0), energy=2.0)
    node, inputs = SHADERS[shader]
    made = bs.material("M", (0.7, 0.6, 0.5), node, **inputs)
    if shader in DISTRIBUTIONS:
        bs.shader(made).distribution = DISTRIBUTIONS[shader]
    tree = made.node_tree
    bent = tree.nodes.new("ShaderNodeNormalMap")
    bent.space, bent.inputs["Color"].default_value = "WORLD", color
    tree.links.new(bent.outputs[0], bs.shader(made).inputs["Normal"])
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    if faces != "flat":
        bpy.ops.object.shade_smooth()
        bs.offset_shadow_rays(bpy.context.object, 0.0)
    if faces == "dimmed":
        bs.offset_shading(bpy.context.object, 0.3)
    bpy.context.object.data.materials.append(made)
    bs.add("Floor", bs.plane("Floor", 20.0, bs.material("Floor")), (0.0, 0.0, -1.0))
    return scene


def compare(scene: Any, folder: Path) -> tuple[float, float]:
    """Root mean square of the differences of blocks, and what noise explains of it, as parts of the picture's mean."""
    made = bs.export()
    renderer, settings = edgegrad.Renderer(made.scene), made.settings
    ours = [renderer.render(spp=SAMPLES, max_depth=settings.max_depth, bounces=settings.bounces, seed=seed)
            for seed in range(SEEDS)]  # fmt: skip
    theirs = []
    for seed in range(SEEDS):
        scene.cycles.seed = seed
        theirs.append(bs.cycles(folder)[..., :3])
    blocks = [block_sums(np.array(pictures, np.float64), 8) / 64.0 for pictures in (ours, theirs)]
    scale = float(np.mean(theirs))
    difference = blocks[0].mean(axis=0) - blocks[1].mean(axis=0)
    variance = sum(float(np.mean(np.var(b, axis=0, ddof=1))) for b in blocks) / SEEDS
    return float(np.sqrt(np.mean(difference**2))) / scale, float(np.sqrt(variance)) / scale


CASES = [(shader, "sun", "flat") for shader in SHADERS]
CASES += [(shader, "sky", "flat") for shader in SHADERS if shader not in LAYERED]
CASES += [(shader, light, "smooth") for shader in SMOOTH for light in ("sky", "sun")]
CASES += [("mirror", "sky", "dimmed"), ("glossy", "sky", "dimmed"), ("principled", "sun", "dimmed")]


@pytest.mark.slow
@pytest.mark.parametrize("color", [UP, ASIDE], ids=["up", "aside"])
@pytest.mark.parametrize(("shader", "light", "faces"), CASES)
def test_shading_is_that_of_cycles(shader: str, light: str, faces: str, color: Any, tmp_path: Path) -> None:
    difference, noise = compare(ball(shader, color, light, faces), tmp_path)
    # Shadow rays at the terminator of smooth meshes start in slightly other places.
    assert difference < 2.0 * noise + (0.01 if faces != "flat" and light == "sun" else 0.001)


@pytest.mark.parametrize("into", ["up", "aside"])
def test_shadow_rays_start_on_the_side_that_custom_normals_face(into: str, tmp_path: Path) -> None:
    """Custom normals that point into faces: with a terminator offset, shadow rays start below these faces."""
    scene = ball("diffuse", UP, "sun", "smooth")
    ob = next(one for one in bpy.data.objects if one.type == "MESH" and one.name != "Floor")
    bs.offset_shadow_rays(ob, 0.1)
    tree = ob.data.materials[0].node_tree
    tree.links.remove(bs.shader(ob.data.materials[0]).inputs["Normal"].links[0])
    lean = np.array([0.0, 0.0, 9.0] if into == "up" else [1.5, 0.0, 0.0])
    normals = np.array([vertex.normal for vertex in ob.data.vertices]) + lean
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    ob.data.normals_split_custom_set_from_vertices(normals.tolist())
    difference, noise = compare(scene, tmp_path)
    assert difference < 2.0 * noise + 0.01
