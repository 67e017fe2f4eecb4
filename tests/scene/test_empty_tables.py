"""Scenes without meshes, edges, materials or attributes: kernels may read tables for inactive lanes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, Mesh, Renderer, Scene
from edgegrad import expression as e
from edgegrad.scene.light import Light
from tests.support.apart import apart
from tests.support.small_scenes import camera, need, rectangle

SEEN = frozenset(("camera", "diffuse", "glossy", "transmission", "shadow"))
TURNED = np.array([[0.8, 0.0, 0.6, 0.1], [0.0, 1.0, 0.0, 0.2], [-0.6, 0.0, 0.8, 0.3], [0.0, 0.0, 0.0, 1.0]])
LIGHTS: Mapping[str, Light] = {
    "ball": edgegrad.PointLight(np.array([0.2, 0.1, 0.0]), radius=0.4, sphere=True, visible_to=SEEN),
    "disk": edgegrad.PointLight(np.array([0.2, 0.1, 0.0]), radius=0.4, visible_to=SEEN),
    "spot": edgegrad.SpotLight(np.array([0.2, 0.1, 0.0]), np.array([0.1, 0.0, 1.0]), radius=0.3, visible_to=SEEN),
    "square": edgegrad.AreaLight(TURNED, visible_to=SEEN),
    "ellipse": edgegrad.AreaLight(TURNED, shape="ELLIPSE", visible_to=SEEN),
    "sun": edgegrad.SunLight(np.array([0.1, 0.0, 1.0]), angle=0.3, visible_to=SEEN),
    "point": edgegrad.PointLight(np.array([0.2, 0.1, 0.0])),
}


# What no mesh has.
UNUSED = {
    "mirror": Material(kind="GLOSSY", roughness=0.0),
    "brushed": Material(kind="GLOSSY", anisotropy=0.5),
    "glass": Material(kind="GLASS", roughness=0.0, textures={"normal": e.Attribute("map")}),
    "lamp": Material(emission=np.ones(3), textures={"emission": e.ImageTexture("image", e.Attribute("UVMap"))}),
}
IMAGES = {"image": edgegrad.Image(np.full((2, 3, 3), 0.5, np.float32))}


def differentiate_without_meshes(name: str, kind: str, sky: bool) -> None:
    scene = Scene(replace(camera(), kind=kind), lights={name: LIGHTS[name]})
    if sky:
        scene.world = edgegrad.World(np.ones(3), image="image")
        scene.materials, scene.images = UNUSED, IMAGES
    moving = "direction" if name == "sun" else "to_world" if name in ("square", "ellipse") else "position"
    for path in (f"lights.{name}.{moving}", "camera.to_world"):
        for depth in (1, 3):
            adjoint = np.ones((32, 32, 3), np.float32)
            gradient = Renderer(scene).render_backward(adjoint, [path], spp=4, max_depth=depth)[path]
            assert np.isfinite(gradient).all()
            picture = Renderer(scene).render_forward({path: np.ones(gradient.shape)}, spp=4, max_depth=depth)
            np.testing.assert_allclose(picture.sum(), gradient.sum(), rtol=1e-3, atol=1e-3)


def differentiate_all_lights() -> None:
    for name in LIGHTS:
        for kind in ("PERSPECTIVE", "ORTHOGRAPHIC"):
            for sky in (False, True):
                differentiate_without_meshes(name, kind, sky)


def test_moving_lights_and_cameras_of_a_scene_without_meshes() -> None:
    need("native")
    apart(differentiate_all_lights)


def brushed(anisotropy: float, textured: bool = False) -> Scene:
    """Glossy sheet whose UV map is turned, under a lamp; beside it a sheet with a texture of positions."""
    sheet = rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0), "metal")
    turned = sheet.vertices[:, :2] @ np.array([[0.8, 0.6], [-0.6, 0.8]])
    sheet.attributes = {"UVMap": turned[sheet.faces].astype(np.float32)}
    other = Material(np.full(3, 0.5))
    if textured:
        other.textures = {"base_color": e.Coordinates("POSITION")}
    return Scene(
        camera((0.4, 0.3, 4.0)),
        {"sheet": sheet, "wall": rectangle((0, 0, -1), (2, 0, 0), (0, 2, 0), "plain")},
        {"metal": Material(np.full(3, 0.8), kind="GLOSSY", roughness=0.5, anisotropy=anisotropy), "plain": other},
        {"lamp": edgegrad.PointLight(np.array([0.5, 0.3, 2.0]), 50.0)},
    )


def differentiate_anisotropy(textured: bool) -> None:
    path = "materials.metal.anisotropy"
    ramp = np.linspace(0.0, 1.0, 32, dtype=np.float32)[None, :, None] * np.ones((32, 1, 3), np.float32)
    found = Renderer(brushed(0.0, textured)).render_backward(ramp, [path], spp=64, max_depth=2)[path]
    h = 0.02
    high, low = (Renderer(brushed(a, textured)).render(spp=64, max_depth=2) for a in (h, -h))
    # Pictures at the two values have the same random numbers, and their light is a point.
    expected = float(np.sum(ramp * (high.astype(np.float64) - low)) / (2.0 * h))
    assert abs(expected) > 1.0
    np.testing.assert_allclose(found, expected, rtol=0.02)


@pytest.mark.parametrize("textured", [False, True])
def test_anisotropy_has_its_tangents_where_it_is_zero(textured: bool) -> None:
    need("native")
    apart(differentiate_anisotropy, textured)


def smooth_sheet(smoothing: object) -> Scene:
    numbers = None if smoothing is None else np.asarray(smoothing, np.int32)
    sheet = Mesh(
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0.6], [-1, 1, 0.6]], float),
        np.array([[0, 1, 2], [0, 2, 3]], np.int32), ("clay",), smoothing=numbers,
    )
    return Scene(camera(), {"sheet": sheet}, {"clay": Material(np.full(3, 0.7))},
                 {"sun": edgegrad.SunLight(np.array([0.2, 0.1, -1.0]))})


def test_smoothing_that_names_no_normal_is_flat() -> None:
    flat, none = smooth_sheet(None), smooth_sheet(np.full((2, 3), -1))
    np.testing.assert_array_equal(Renderer(none).render(spp=4), Renderer(flat).render(spp=4))
    path = "meshes.sheet.vertices"
    adjoint = np.ones((32, 32, 3), np.float32)
    found, expected = (Renderer(s).render_backward(adjoint, [path], spp=4)[path] for s in (none, flat))
    np.testing.assert_array_equal(found, expected)


def test_numbers_of_shading_normals_take_no_memory() -> None:
    large = 2_000_000_000
    named = np.array([[0, large, 7], [0, 7, -1]])
    few, many = smooth_sheet([[0, 2, 1], [0, 1, -1]]), smooth_sheet(named)
    tables = edgegrad.tables.tables.flatten(many)
    assert tables.mesh_first_normal[-1] == 3
    np.testing.assert_array_equal(Renderer(many).render(spp=4), Renderer(few).render(spp=4))
    np.testing.assert_array_equal(many.meshes["sheet"].smoothing, named)
    many.meshes["sheet"].instances = np.stack([np.eye(4), np.diag([1.0, -1.0, 1.0, 1.0])])
    assert edgegrad.tables.tables.flatten(many).mesh_first_normal[-1] == 3
