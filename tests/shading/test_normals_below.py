"""Normals that point below the surface, whose gloss has a normal that is bent back: its derivatives are differences.

The plane is seen at one point, in sunlight without size or in a mirror, so that pictures have no noise.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, expression
from edgegrad.expression.numbers import numbers, with_numbers
from tests.support.small_scenes import need, pixel_at, rectangle

need("native")

VIEW = np.array([0.5, -0.3, 0.6]) / np.linalg.norm([0.5, -0.3, 0.6])
SUN = np.array([-0.7, 0.5, 0.25]) / np.linalg.norm([-0.7, 0.5, 0.25])
BELOW = np.array([-0.7, 0.4, -0.3])  # as a map in tangent space; with the strength 0.8, z is -0.04
PLACE = np.array([0.1, 0.2, 0.0])
COLOR = np.array([0.8, 0.5, 0.2])
MATERIALS = {
    "glossy": Material(COLOR, kind="GLOSSY", roughness=0.6),
    "anisotropic": Material(COLOR, kind="GLOSSY", roughness=0.6, anisotropy=0.5, anisotropy_rotation=0.1),
    "metal": Material(COLOR, metallic=1.0, roughness=0.6, anisotropy=0.5, anisotropy_rotation=0.1),
    "layers": Material(COLOR, roughness=0.6, coat_weight=0.5, coat_roughness=0.5, sheen_weight=0.2),
    "glass": Material(COLOR, kind="GLASS", roughness=0.7),
    "refraction": Material(COLOR, kind="REFRACTION", roughness=0.7),
    "translucent": Material(COLOR, kind="TRANSLUCENT"),
    "mirror": Material(COLOR, kind="GLOSSY", roughness=0.0),
    "clear": Material(COLOR, kind="GLASS", roughness=0.0),
}
# Smooth glass reflects or refracts at random: the number of samples that do so changes in whole steps.
OPTIONS: dict[str, Any] = {"spp": 65536, "max_depth": 3, "seed": 1}
SCALARS = ["normal_strength", "roughness", "anisotropy_rotation"]


def place_of_sun(name: str) -> np.ndarray:
    """Translucent surfaces are lit from behind, against their normal, and refracting ones along the view."""
    return {"refraction": -VIEW, "translucent": -SUN}.get(name, SUN)


def scene(name: str, view: np.ndarray = VIEW, bend: np.ndarray = BELOW) -> edgegrad.Scene:
    material = replace(MATERIALS[name], normal_strength=0.8,
                       textures={"normal": expression.Combine(*(float(c) for c in 0.5 + 0.5 * bend))})  # fmt: skip
    plane = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "bent")
    plane.attributes = {"UVMap": (plane.vertices[plane.faces][..., :2] + 1.0) / 2.0}
    camera = pixel_at(PLACE + 5.0 * view, PLACE, (0, 0, 1))
    if name not in ("mirror", "clear"):
        return edgegrad.Scene(camera, {"plane": plane}, {"bent": material},
                              {"sun": edgegrad.SunLight(-place_of_sun(name))})  # fmt: skip
    x, y = np.meshgrid(np.linspace(0, 2 * np.pi, 64, endpoint=False), np.linspace(0, np.pi, 32))
    sky = 1.5 + np.stack([np.sin(x), np.cos(x) * np.sin(y), np.cos(y)], axis=-1).astype(np.float32)
    return edgegrad.Scene(camera, {"plane": plane}, {"bent": material}, {}, edgegrad.World(np.ones(3), image="sky"),
                          {"sky": edgegrad.Image(sky)})  # fmt: skip


def picture(made: edgegrad.Scene) -> np.ndarray:
    return edgegrad.Renderer(made).render(**OPTIONS)[0, 0].astype(float)


def changed(made: edgegrad.Scene, path: str, change: Any) -> edgegrad.Scene:
    group, name, *rest = path.split(".")
    items = dict(getattr(made, group))
    if rest == ["textures", "normal"]:
        material = items[name]
        normal = material.textures["normal"]
        items[name] = replace(material, textures={"normal": with_numbers(normal, numbers(normal) + change)})
    else:
        items[name] = replace(items[name], **{rest[0]: getattr(items[name], rest[0]) + change})
    return replace(made, **{group: items})


def tangent(path: str) -> Any:
    """A direction in which the parameter changes."""
    if path.endswith("vertices"):
        return np.random.default_rng(1).normal(size=(4, 3)) * 0.3
    if path.endswith("direction"):
        return np.array([0.2, -0.3, 0.5])
    if path.endswith("textures.normal"):
        return np.array([0.3, -0.5, 0.4, 0.0])
    return 1.0


def paths(name: str) -> list[str]:
    scalars = [key for key in SCALARS if getattr(MATERIALS[name], key) != 0.0]
    if name == "translucent":
        scalars.remove("roughness")
    fields = [f"materials.bent.{key}" for key in scalars] + ["materials.bent.textures.normal", "meshes.plane.vertices"]
    return fields if name in ("mirror", "clear") else [*fields, "lights.sun.direction"]


CASES = [(name, path) for name in MATERIALS for path in paths(name)]


@pytest.mark.parametrize(("name", "path"), CASES)
def test_derivatives_are_differences(name: str, path: str) -> None:
    made = scene(name)
    along, step = tangent(path), 1.6e-2 if name == "clear" else 4e-3
    pictures = [picture(changed(made, path, sign * step * along)) for sign in (1, -1)]
    assert min(p.min() for p in pictures) > 1e-3  # dark if the normal were not bent
    difference = (pictures[0] - pictures[1]) / (2 * step)
    renderer = edgegrad.Renderer(made)
    found = renderer.render_forward({path: along}, **OPTIONS)
    scale = max(float(np.abs(difference).max()), 0.02 * float(picture(made).max()))
    np.testing.assert_allclose(found[0, 0], difference, atol=2e-2 * scale)
    adjoint = np.array([[[0.3, 1.0, -0.5]]], np.float32)
    gradient = renderer.render_backward(adjoint, [path], **OPTIONS)[path]
    assert float(np.sum(gradient * along)) == pytest.approx(float(np.sum(adjoint * found)), rel=1e-4, abs=1e-5 * scale)


@pytest.mark.parametrize("path", ["materials.bent.textures.normal", "meshes.plane.vertices"])
def test_normals_that_lean_to_the_side_have_derivatives(path: str) -> None:
    """The root of the bent normal's equation changes its sign where the normal leans neither to the view nor away."""
    made = scene("glossy", view=np.array([0.0, -0.6, 0.8]), bend=np.array([-0.9, 0.0, 0.4]))
    along, step = tangent(path), 4e-3
    pictures = [picture(changed(made, path, sign * step * along)) for sign in (1, -1)]
    difference = (pictures[0] - pictures[1]) / (2 * step)
    found = edgegrad.Renderer(made).render_forward({path: along}, **OPTIONS)
    np.testing.assert_allclose(found[0, 0], difference, atol=1e-2 * float(np.abs(difference).max()))


def test_jumps_are_named() -> None:
    """Where normals begin to point away from the viewer and below the surface, gloss ends with a jump."""
    def named(name: str, blue: float, image: bool = False) -> bool:
        made = scene(name, bend=np.array([0.3, 0.2, 2.0 * blue - 1.0]))
        if image:
            normal = expression.ImageTexture("map", expression.Attribute("UVMap"))
            material = replace(made.materials["bent"], textures={"normal": normal})
            pixels = np.full((2, 2, 3), 0.5, np.float32) + np.array([0.0, 0.0, blue - 0.5], np.float32)
            made = replace(made, materials={"bent": material}, images={"map": edgegrad.Image(pixels)})
        return any("below the surface" in words for words in edgegrad.plan(made, ["meshes.plane.vertices"]).missing)

    for image in (False, True):
        assert named("glossy", 0.4, image) and not named("glossy", 0.6, image)
    assert named("translucent", 0.4) and named("clear", 0.4)
    bump = expression.Bump(expression.Channel(expression.Attribute("UVMap"), 0))
    for normal, below in ((bump, False), (expression.Coordinates("INCOMING"), True)):
        made = scene("layers")
        material = replace(made.materials["bent"], normal_space="WORLD", textures={"normal": normal})
        words = edgegrad.plan(replace(made, materials={"bent": material}), ["meshes.plane.vertices"]).missing
        assert any("below the surface" in line for line in words) == below


def test_the_plan_follows_changes_of_a_map() -> None:
    """What is known of an image is kept with the renderer's tables as long as the image does not change."""
    made = scene("glossy", bend=np.array([0.3, 0.2, 1.0]))
    normal = expression.ImageTexture("map", expression.Attribute("UVMap"))
    made.materials["bent"].textures = {"normal": normal}
    made.images = {"map": edgegrad.Image(np.full((2, 2, 3), 0.6, np.float32))}
    renderer = edgegrad.Renderer(made)
    for blue, below in ((0.6, False), (0.3, True), (0.7, False)):
        made.images["map"].pixels[..., 2] = blue
        renderer.update(["images.map.pixels"])
        for roughness in (0.4, 0.5):
            made.materials["bent"].roughness = roughness
            renderer.update(["materials.bent.roughness"])
            words = edgegrad.plan(renderer, ["meshes.plane.vertices"]).missing
            assert any("below the surface" in line for line in words) == below
