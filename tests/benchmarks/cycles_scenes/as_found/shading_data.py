"""How meshes are shaded where their data is mixed: flat beside smooth, turned faces, all domains of attributes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .. import stage
from ..case import case
from .habits import small


def _patched(name: str, material: Any, every: int = 3, segments: int = 10) -> Any:
    """A coarse ball of which every third face is flat."""
    ball = stage.sphere(name, material, radius=0.5, segments=segments)
    for face in ball.polygons:
        face.use_smooth = face.index % every != 0
    return ball


@case("Bodies that are partly flat: glass, metal, bump, normal maps, mirrored and uneven copies", bounces=6, samples=96)
def partly_flat() -> None:
    """Faces that someone set to Shade Flat."""
    small()

    def bumped(tree: Any) -> Any:
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 8.0})
        bump = stage.node(tree, "ShaderNodeBump", {"Height": noise.outputs[0], "Distance": 0.1})
        return stage.node(tree, "ShaderNodeBsdfPrincipled", {"Normal": bump, "Roughness": 0.3})

    def mapped(tree: Any) -> Any:
        place = stage.node(tree, "ShaderNodeTexCoord").outputs["UV"]
        wave = stage.node(tree, "ShaderNodeTexWave", {"Vector": place, "Scale": 3.0})
        color = stage.node(tree, "ShaderNodeCombineColor", {0: wave.outputs[1], 1: 0.5, 2: 0.9})
        normal = stage.node(tree, "ShaderNodeNormalMap", {"Color": color, "Strength": 0.7})
        return stage.node(tree, "ShaderNodeBsdfDiffuse", {"Normal": normal, "Color": (0.2, 0.5, 0.7)})

    def shown(tree: Any) -> Any:
        return stage.node(tree, "ShaderNodeEmission", {
            "Color": stage.node(tree, "ShaderNodeTexCoord").outputs["Normal"], "Strength": 0.5})  # fmt: skip

    made = [stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.0, "IOR": 1.3}),
            stage.principled("Metal", (0.8, 0.6, 0.3), Metallic=1.0, Roughness=0.2),
            *(stage.material(one.__name__, one) for one in (bumped, mapped, shown))]  # fmt: skip
    for k, one in enumerate(made):
        stage.add(one.name, _patched(one.name, one), (-1.9 + 0.95 * k, 0.6, 0.5), (0.2, 0.1, 0.3 * k), 0.85)
    again = _patched("Again", stage.principled("Clay", (0.7, 0.3, 0.2), Roughness=0.5))
    for k, scale in enumerate(((0.6, 0.6, 0.6), (-0.6, 0.6, 0.6), (0.4, 0.9, 0.6))):
        stage.add(f"Again {k}", again, (-1.3 + 1.2 * k, -0.6, 0.45), (0.2, 0.1, 0.4), scale)
    sharp = _patched("Sharp", made[1])
    for edge in sharp.edges:
        edge.use_edge_sharp = edge.index % 7 == 0
    stage.add("Sharp", sharp, (2.1, -0.5, 0.45), (0.2, 0.1, 0.4), 0.8)


@case("Faces that are turned inside out here and there, doubled faces, slivers, corners of two materials", bounces=4)
def turned_faces() -> None:
    """Meshes that were knitted together by hand."""
    small()
    paint = [stage.principled("Paint", (0.7, 0.2, 0.1), Roughness=0.3), stage.diffuse("Other", (0.2, 0.4, 0.7)),
             stage.simple("Glass", "ShaderNodeBsdfGlass", {"Roughness": 0.0, "IOR": 1.2})]  # fmt: skip
    for k, smooth in enumerate((False, True, True)):
        ball = stage.sphere(f"Turned {k}", paint[2 if k == 2 else 0], paint[1], radius=0.5, segments=14, smooth=smooth)
        for face in ball.polygons:
            if face.index % 5 == 0:
                face.flip()
            face.material_index = int(face.index % 4 == 0 and k != 2)
        ball.update()
        stage.add(f"Turned {k}", ball, (-1.4 + 1.3 * k, 0.5, 0.5))
    points, faces = [], []
    for j in range(6):
        for i in range(6):
            points.append((0.25 * i + 0.12 * (j % 2), 0.25 * j, 0.2 * math.sin(i + 0.7 * j)))
    for j in range(5):
        for i in range(5):
            a = 6 * j + i
            faces.append((a, a + 1, a + 7, a + 6))
    points += [(1.5, 0.3, 0.3), (1.5, 0.3001, 0.3), (1.9, 0.3, 0.6)]
    faces += [(36, 37, 38), (36, 38, 37)]
    cloth = stage.mesh("Cloth", points, faces, paint[0], paint[1])
    cloth.polygons.foreach_set("use_smooth", [True] * len(faces))
    for face in cloth.polygons:
        face.material_index = face.index % 2
    stage.add("Cloth", cloth, (-0.9, -1.4, 0.3))


@case("Attributes of all domains and types as colours, and layers whose names clash", bounces=2)
def attribute_domains() -> None:
    """What geometry nodes, importers and sculpting leave on a mesh."""
    small()

    def by(name: str, output: str) -> Any:
        def shader(tree: Any) -> Any:
            read = stage.node(tree, "ShaderNodeAttribute", attribute_name=name)
            return stage.node(tree, "ShaderNodeEmission", {"Color": read.outputs[output], "Strength": 0.6})

        return stage.material(f"{name} {output}", shader)

    kinds = (
        ("FLOAT", "FACE", "Fac"),
        ("INT", "POINT", "Fac"),
        ("BOOLEAN", "FACE", "Fac"),
        ("FLOAT2", "CORNER", "Vector"),
        ("FLOAT_VECTOR", "FACE", "Color"),
        ("FLOAT", "EDGE", "Fac"),
        ("INT8", "FACE", "Fac"),
        ("BYTE_COLOR", "POINT", "Alpha"),
        ("FLOAT_COLOR", "FACE", "Color"),
        ("INT", "CORNER", "Color"),
    )
    generator = np.random.default_rng(5)
    for k, (kind, domain, output) in enumerate(kinds):
        name = f"{kind} {domain}"
        grid = stage.grid(name, by(name, output), size=0.85, cells=3)
        layer = grid.attributes.new(name, kind, domain)
        for value in layer.data:
            drawn = generator.uniform(0.1, 0.9, 4)
            if kind in ("FLOAT", "INT", "INT8", "BOOLEAN"):
                value.value = {"FLOAT": float(drawn[0]), "BOOLEAN": bool(drawn[0] > 0.5)}.get(kind, int(3 * drawn[0]))
            elif "COLOR" in kind:
                value.color = drawn
            else:
                value.vector = drawn[: len(value.vector)]
        stage.add(name, grid, (-1.9 + 0.95 * (k % 5), 1.0 * (k // 5) - 0.5, 0.05), (0.3, 0, 0))


@case("Normals by modifiers: Normal Edit, Bevel with hardened normals, Edge Split, Data Transfer, Mirror, Triangulate",
      bounces=3, samples=64)  # fmt: skip
def normal_modifiers() -> None:
    """Game assets and hard surfaces."""
    small()
    metal = stage.principled("Metal", (0.7, 0.7, 0.75), Metallic=1.0, Roughness=0.25)
    leaf = stage.principled("Leaf", (0.2, 0.6, 0.2), Roughness=0.6)
    source = stage.add("Source", stage.sphere("Source", metal, radius=0.6, segments=24), (9, 9, 9))

    def body(name: str, place: Any, mesh: Any, kind: str, **settings: Any) -> None:
        ob = stage.add(name, mesh, place, (0.1, 0.2, 0.4))
        modifier = ob.modifiers.new(kind, kind)
        for key, value in settings.items():
            setattr(modifier, key, value)

    def smooth_cube(name: str) -> Any:
        made = stage.cube(name, metal, size=0.75)
        made.polygons.foreach_set("use_smooth", [True] * len(made.polygons))
        return made

    body("Edit", (-1.8, 0.6, 0.5), stage.grid("Edit", leaf, size=0.9, cells=4), "NORMAL_EDIT", mode="RADIAL",
         offset=(0.0, 0.0, -0.5))  # fmt: skip
    body("Bevel", (-0.6, 0.6, 0.5), smooth_cube("Bevel"), "BEVEL", width=0.1, segments=2, harden_normals=True)
    body("Split", (0.6, 0.6, 0.5), stage.cylinder("Split", metal, radius=0.4, depth=0.8, segments=9), "EDGE_SPLIT",
         split_angle=0.6)  # fmt: skip
    body("Transfer", (1.8, 0.6, 0.5), smooth_cube("Transfer"), "DATA_TRANSFER", object=source, use_loop_data=True,
         data_types_loops={"CUSTOM_NORMAL"}, loop_mapping="POLYINTERP_NEAREST")  # fmt: skip
    body("Triangles", (-1.2, -0.7, 0.5), _patched("Triangles", leaf), "TRIANGULATE", keep_custom_normals=True)
    body("Mirror", (0.0, -0.7, 0.5), _patched("Mirror", leaf, segments=8), "MIRROR", use_axis=(True, False, False),
         use_bisect_axis=(True, False, False))  # fmt: skip
    body("Subdivided", (1.3, -0.7, 0.5), _patched("Subdivided", metal, segments=6), "SUBSURF", render_levels=1)
