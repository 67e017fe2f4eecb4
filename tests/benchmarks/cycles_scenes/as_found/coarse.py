"""Coarse meshes shaded smooth, as engines have them: of every shader, with custom normals, under every light."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from .. import stage
from ..case import case


def _place() -> None:
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 128, 96
    stage.add("Ground", stage.plane("Ground", stage.diffuse("Ground", (0.35, 0.33, 0.3)), size=30.0))
    stage.camera((0.0, -5.5, 2.2), (0, 0, 0.6), 42.0)


def _image_sky() -> None:
    y, x = np.mgrid[0:32, 0:64] + 0.5
    sky = np.stack([0.4 + 0.3 * np.sin(x / 9), 0.5 + 0.2 * np.cos(x / 7), 0.9 - 0.6 * y / 32], -1)
    sky[5:8, 40:43] = 60.0
    sky[6:14, 5:20] = 4.0
    stage.image_world(sky)


def _shaders() -> list[Any]:
    return [
        stage.simple("Matte", "ShaderNodeBsdfDiffuse", {"Color": (0.6, 0.5, 0.4)}),
        stage.principled("Plastic", (0.2, 0.4, 0.7), Roughness=0.25),
        stage.principled("Metal", (0.9, 0.7, 0.4), Metallic=1.0, Roughness=0.3),
        stage.principled("Cloth", (0.5, 0.1, 0.2), Sheen_Weight=0.8, Roughness=0.9),
    ]


@case("Coarse smooth balls of four shaders under a low sun, and their instances of uneven scale", bounces=3, samples=64)
def coarse_in_sun() -> None:
    """Terminators of all kinds of lobes."""
    _place()
    stage.lamp("SUN", "Sun", 4.0, angle=0.01).rotation_euler = (1.1, 0.0, 0.8)
    stage.world((0.4, 0.5, 0.7), 0.4)
    for k, one in enumerate(_shaders()):
        ball = stage.sphere(one.name, one, radius=0.5, segments=10)
        stage.add(one.name, ball, (-1.8 + 1.2 * k, -0.5, 0.5))
        stage.add(f"{one.name} again", ball, (-1.6 + 1.2 * k, 1.2, 0.6), (0.3 * k, 0.4, 0.2), (0.8, -0.5, 1.2))


@case("Coarse smooth balls of four shaders under an image of a sky", bounces=3, samples=96)
def coarse_under_image() -> None:
    """Light from all sides, with a small bright sun."""
    _place()
    _image_sky()
    stage.row(_shaders(), segments=10)


@case("Coarse smooth balls beside a large area light, a glowing mesh and a bulb", bounces=3, samples=96)
def coarse_by_lamps() -> None:
    """Lights that are near and large."""
    _place()
    stage.world((0.05, 0.05, 0.05), 1.0)
    stage.lamp("AREA", "Panel", 60.0, (-3.0, 0.5, 1.0), (0, 0, 0.6), size=2.5)
    stage.lamp("POINT", "Bulb", 40.0, (1.5, -0.2, 2.0), shadow_soft_size=0.1)
    stage.add(
        "Tube",
        stage.cube("Tube", stage.emitter("Glow", (1.0, 0.7, 0.4), 12.0), size=1.0),
        (3.2, 0.8, 0.6),
        scale=(0.1, 0.1, 1.2),
    )
    stage.row(_shaders(), segments=10)


@case("Coarse smooth glass, mirrors and coats", bounces=8, samples=128)
def coarse_glass() -> None:
    """Rays of bent normals that would leave on the wrong side."""
    _place()
    _image_sky()
    stage.row(
        [
            stage.simple("Glass", "ShaderNodeBsdfGlass", {"IOR": 1.45, "Roughness": 0.1}),
            stage.simple("Mirror", "ShaderNodeBsdfGlossy", {"Roughness": 0.0}),
            stage.principled("Lacquer", (0.6, 0.05, 0.05), Coat_Weight=1.0, Coat_Roughness=0.03, Roughness=0.6),
            stage.principled("Bottle", (0.6, 0.8, 0.6), Transmission_Weight=1.0, Roughness=0.0, IOR=1.33),
        ],
        segments=12,
    )


@case(
    "Foliage of an engine: cards whose custom normals point outwards, two-sided, cut out, with light through them",
    bounces=4,
    samples=96,
)
def foliage_cards() -> None:
    """The normals of a bush, not of its leaves."""
    _place()
    stage.lamp("SUN", "Sun", 4.0, angle=0.02).rotation_euler = (0.8, 0.2, 0.5)
    stage.world((0.45, 0.55, 0.8), 0.7)
    y, x = np.mgrid[-1:1:48j, -1:1:48j]
    leaf = np.stack([0.2 + 0 * x, 0.45 + 0.1 * x, 0.1 + 0 * x, (np.abs(x) + 0.6 * np.abs(y) < 0.8) * 1.0], -1)
    picture = stage.image("Leaf", leaf)

    def cut(through: bool) -> Any:
        def shader(tree: Any) -> Any:
            found = stage.node(tree, "ShaderNodeTexImage", image=picture)
            sheet = stage.node(
                tree,
                "ShaderNodeBsdfPrincipled",
                {"Base Color": found, "Roughness": 0.7, "Alpha": found.outputs["Alpha"]},
            )
            if not through:
                return sheet
            back = stage.node(tree, "ShaderNodeBsdfTranslucent", {"Color": found})
            both = stage.node(
                tree,
                "ShaderNodeMixShader",
                {0: 0.4, 1: stage.node(tree, "ShaderNodeBsdfDiffuse", {"Color": found}), 2: back},
            )
            return stage.node(
                tree,
                "ShaderNodeMixShader",
                {0: found.outputs["Alpha"], 1: stage.node(tree, "ShaderNodeBsdfTransparent"), 2: both},
            )

        return stage.material(f"Leaf {through}", shader)

    rng = np.random.default_rng(3)
    for k, center in enumerate((-1.2, 1.2)):
        points, faces, normals, uvs = [], [], [], []
        for i in range(40):
            direction = rng.normal(size=3)
            direction /= np.linalg.norm(direction)
            direction[2] = abs(direction[2])
            across, along = np.linalg.qr(rng.normal(size=(3, 2)))[0].T
            middle = 0.7 * direction
            for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                points.append(middle + 0.25 * (u * across + v * along))
                normals.append(direction)
                uvs.append(((u + 1) / 2, (v + 1) / 2))
            faces.append(range(4 * i, 4 * i + 4))
        body = stage.mesh(f"Bush {k}", [tuple(p) for p in points], [tuple(f) for f in faces], cut(bool(k)))
        layer = body.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", np.array(uvs, np.float32).ravel())
        body.shade_smooth()
        body.normals_split_custom_set_from_vertices([tuple(n) for n in normals])
        stage.add(f"Bush {k}", body, (center, 0, 0.5))


@case("Coarse smooth bodies with normal maps and bump under a sun", bounces=3, samples=64)
def coarse_with_maps() -> None:
    """Normals that are bent twice."""
    _place()
    stage.lamp("SUN", "Sun", 4.0, angle=0.01).rotation_euler = (1.1, 0.0, -0.6)
    stage.world((0.4, 0.5, 0.7), 0.4)
    x, y = np.meshgrid(*[np.linspace(0.0, 8.0 * np.pi, 96)] * 2)
    tilt = np.stack([0.5 + 0.25 * np.sin(x), 0.5 + 0.25 * np.cos(y), np.full_like(x, 0.9)], axis=-1)
    picture = stage.image("Dents", tilt, "Non-Color")

    def mapped(metallic: float) -> Any:
        return lambda tree: stage.node(
            tree,
            "ShaderNodeBsdfPrincipled",
            {
                "Base Color": (0.6, 0.55, 0.5),
                "Metallic": metallic,
                "Roughness": 0.4,
                "Normal": stage.node(
                    tree, "ShaderNodeNormalMap", {"Color": stage.node(tree, "ShaderNodeTexImage", image=picture)}
                ),
            },
        )

    def bumped(tree: Any) -> Any:
        noise = stage.node(tree, "ShaderNodeTexNoise", {"Scale": 6.0})
        return stage.node(
            tree,
            "ShaderNodeBsdfDiffuse",
            {
                "Color": (0.5, 0.4, 0.3),
                "Normal": stage.node(tree, "ShaderNodeBump", {"Height": noise, "Strength": 0.6}),
            },
        )

    made = [
        stage.material("Matte map", mapped(0.0)),
        stage.material("Metal map", mapped(1.0)),
        stage.material("Bump", bumped),
    ]
    stage.row(made, segments=10)
    stage.add("Flat", stage.cube("Flat", made[0], size=0.8), (0.3, 1.6, 0.4), (0, 0, math.pi / 5))
