"""Derivatives of other things in scenes with fields: right, or named by the plan as missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Field, Material, PointLight, Renderer, Scene, SunLight, World, plan
from edgegrad.expression import Coordinates, VectorMath
from tests.support.fields.splines import Floats, exact_sphere, sampled
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.small_scenes import camera, matte, rectangle


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def glow(*color: float) -> Material:
    """An emitter."""
    return Material(np.zeros(3), np.array(color))


def over_a_field(shift: float, material: Material | None = None, **others: Any) -> Scene:
    """A glowing sheet that covers a part of a sphere, and shines on it."""
    sheet = rectangle((0.3 + shift, 0.1, 0.9), (0.35, 0.1, 0.0), (0.0, 0.4, 0.1), "lamp")
    return Scene(**({"camera": camera(size=16), "meshes": {"sheet": sheet},
                     "materials": {"lamp": glow(3.0, 2.0, 1.0), "clay": material or matte(0.6, 0.4, 0.3)},
                     "fields": {"ball": exact_sphere(0.7, 20)}, "world": World(np.array([0.2, 0.3, 0.4]))} | others))


def moved(path: str, scene: Scene, tangent: Floats) -> tuple[Scene, Mapping[str, Floats]]:
    """A scene with a tangent of one parameter."""
    return scene, {path: tangent}


@pytest.mark.parametrize("depth", [2, 4])
@pytest.mark.parametrize(
    "path", ["materials.clay.base_color", "materials.lamp.emission", "world.color", "lights.sun.strength",
             "materials.clay.roughness"])
def test_values(path: str, depth: int) -> None:
    """Colours, strengths and roughness have no boundary terms: fields lack nothing of them."""
    rough = Material(np.array([0.6, 0.4, 0.3]), kind="PRINCIPLED", metallic=0.5, roughness=0.4)

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        scene = over_a_field(0.0, replace(rough), lights={"sun": SunLight(np.array([0.3, -0.5, -1.0]), strength=1.0)})
        value = np.asarray(edgegrad.parameters.get(scene, path), float)
        edgegrad.parameters.put(scene, path, value + theta)
        return scene, {path: np.ones_like(value)}

    check_agreement(at, max_depth=depth, eps=0.1, seeds=8)
    scene = at(0.0)[0]
    assert not any("field" in sentence for sentence in plan(scene, [path], max_depth=depth).missing)
    check_transpose(lambda _: scene, [path], spp=8, max_depth=depth)


def test_vertices_over_a_field() -> None:
    """A glowing sheet in front of a field that scatters no light: its edges are all that moves."""
    direction = np.tile([1.0, 0.0, 0.0], (4, 1))
    black = matte(0.0, 0.0, 0.0)

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return over_a_field(theta, black), {"meshes.sheet.vertices": direction}

    check_agreement(at, max_depth=1, eps=0.05, seeds=8)
    check_equal_bits(lambda t: over_a_field(t), ["meshes.sheet.vertices"], spp=4, max_depth=3)
    check_transpose(lambda t: over_a_field(t), ["meshes.sheet.vertices"], spp=8, max_depth=3)


def test_vertices_behind_a_field() -> None:
    """A sheet behind a field: rays to its edges meet the field."""
    direction = np.tile([1.0, 0.3, 0.0], (4, 1))

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        sheet = rectangle((0.55 + theta, 0.3 * theta, -0.9), (0.5, 0.0, 0.2), (0.0, 0.5, 0.0), "lamp")
        return (over_a_field(0.0, matte(0.0, 0.0, 0.0), meshes={"sheet": sheet}),
                {"meshes.sheet.vertices": direction})

    check_agreement(at, max_depth=1, eps=0.05, seeds=8)


def test_a_lamp_that_moves_over_a_lit_field() -> None:
    """A sheet that shines on a convex field: no field stands between it and what it lights."""
    direction = np.tile([1.0, 0.0, 0.0], (4, 1))

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        sheet = rectangle((0.3 + theta, 0.2, 1.5), (0.35, 0.1, 0.0), (0.0, 0.4, 0.1), "lamp")
        sheet.visible_to = frozenset(["diffuse"])
        return (over_a_field(0.0, meshes={"sheet": sheet}, world=World(np.zeros(3))),
                {"meshes.sheet.vertices": direction})

    check_agreement(at, max_depth=2, eps=0.05, seeds=8)


def waves(size: int = 24, **others: Any) -> Field:
    """A wavy plane that fills the picture and hides nothing of itself."""
    return sampled(lambda p: p[..., 2] - 0.06 * np.sin(4.0 * p[..., 0] + 1.0) * np.cos(3.0 * p[..., 1]),
                   (size, size, 12), lower=(-2.0, -2.0, -0.5), upper=(2.0, 2.0, 0.5), **others)


@pytest.mark.parametrize("kind", ["matte", "glossy", "textured", "mirror"])
def test_the_camera_over_waves(kind: str) -> None:
    """Points slide over the surface and its normals turn: a field without outlines in the picture."""
    material = {
        "matte": matte(0.7, 0.6, 0.5),
        "glossy": Material(np.array([0.9, 0.8, 0.7]), kind="PRINCIPLED", metallic=1.0, roughness=0.4),
        "textured": Material(textures={"base_color": VectorMath("ADD", VectorMath(
            "SCALE", Coordinates("POSITION"), scale=0.3), (0.5, 0.5, 0.5))}),
        "mirror": Material(np.ones(3), kind="GLOSSY", roughness=0.0),
    }[kind]
    world, images = World(np.zeros(3)), {}  # an even environment would show how waves hide it from each other
    if kind == "mirror":
        v, u = np.meshgrid(np.linspace(0, np.pi, 64), np.linspace(0, 2 * np.pi, 128), indexing="ij")
        pixels = np.stack([1.0 + 0.5 * np.cos(u), 1.0 + 0.5 * np.sin(u), 1.0 + 0.5 * np.cos(v)], axis=-1)
        images, world = {"sky": edgegrad.Image(pixels.astype(np.float32))}, World(np.ones(3), image="sky")

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        seen_by = camera((0.2 + theta, -0.3 + 0.5 * theta, 2.5), (0.2 + theta, -0.3 + 0.5 * theta, 0.0), 16)
        tangent = np.zeros((4, 4))
        tangent[:2, 3] = 1.0, 0.5
        lamp = PointLight(np.array([0.5, 0.4, 2.0]), power=100.0)
        scene = Scene(seen_by, materials={"clay": material}, fields={"waves": waves()}, world=world, images=images,
                      lights={} if kind == "mirror" else {"lamp": lamp})
        return scene, {"camera.to_world": tangent}

    check_agreement(at, max_depth=2, eps=0.05, seeds=8)
    check_transpose(lambda t: at(t)[0], ["camera.to_world"], spp=8, max_depth=2)


def test_the_plan_names_fields() -> None:
    """Their cells, and no shadows as missing."""
    scene = over_a_field(0.0, lights={"lamp": PointLight(np.array([1.0, 1.0, 2.0]))})
    for path in ("meshes.sheet.vertices", "camera.to_world", "lights.lamp.position", "world.rotation"):
        assert not any("shadow" in sentence and "field" in sentence for sentence in
                       plan(scene, [path], max_depth=2).missing)
    assert "1 distance field of 4,913 cells" in str(plan(scene))


def test_mirrors_and_fields() -> None:
    """A mirror over a field that it shows: see also test_fields_in_mirrors.py."""
    mirror = Material(np.ones(3), kind="GLOSSY", roughness=0.0)
    scene = over_a_field(0.0, mirror)
    found = Renderer(scene).render_backward(np.ones((16, 16, 3)), ["meshes.sheet.vertices"], spp=4, max_depth=3)
    assert np.all(np.isfinite(found["meshes.sheet.vertices"]))


def test_fields_do_not_break_other_derivatives() -> None:
    """All parameters that have derivatives, in one call."""
    scene = over_a_field(0.0, lights={"lamp": PointLight(np.array([1.0, 1.0, 2.0]), radius=0.1)})
    paths = ["meshes.sheet.vertices", "camera.to_world", "lights.lamp.position", "lights.lamp.radius", "world.color",
             "materials.clay.base_color", "world.rotation"]
    found = Renderer(scene).render_backward(np.ones((16, 16, 3)), paths, spp=4, max_depth=4)
    assert all(np.all(np.isfinite(found[path])) for path in paths)
    check_equal_bits(lambda _: scene, paths, spp=2, max_depth=4)
