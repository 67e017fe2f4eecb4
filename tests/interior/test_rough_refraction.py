"""Rough glass at the directions where it stops to transmit light, for every light with a size and at every bounce,
compared with central differences.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import expression as e
from edgegrad._check import RAYS
from edgegrad.derivatives.table_derivatives import ParameterMap, with_requested
from edgegrad.rendering import native_engine
from edgegrad.rendering.options import RenderOptions
from edgegrad.tables.tables import flatten
from tests.support.motions import camera_moves
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.scenes.gloss.rough_glass import PARAMETERS, changing, glass, sheet, under_sky
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, camera, glowing, matte, rectangle

# Kind, index, roughness, what changes.
CELLS = [
    (kind, ior, roughness, what)
    for kind in ("REFRACTION", "GLASS", "PRINCIPLED")
    for ior in (0.7, 1.1, 1.4)
    for roughness in (0.5, 0.9)
    for what in PARAMETERS
]
QUICK = [
    ("REFRACTION", 1.1, 0.9, "rotation"), ("REFRACTION", 1.4, 0.9, "ior"), ("REFRACTION", 0.7, 0.9, "ior"),
    ("GLASS", 1.1, 0.9, "camera"), ("PRINCIPLED", 1.4, 0.9, "vertices"),
]  # fmt: skip


def name_of(cell: tuple[str, float, float, str]) -> str:
    return "-".join(map(str, cell))


@pytest.fixture(autouse=True)
def engine() -> None:
    need_every_table()


@pytest.mark.parametrize("name", slow_but(map(name_of, CELLS), list(map(name_of, QUICK))))
def test_a_sheet_under_the_sky(name: str) -> None:
    kind, ior, roughness, what = name.split("-")
    moving = along(changing(lambda: under_sky(glass(kind, float(ior), float(roughness))), what), [PARAMETERS[what]])
    # Motions of the sheet change its picture by little: more samples are needed for the same relative noise.
    samples: dict[str, Any] = {"seeds": 24, "spp": 128, "reference_spp": 1024} if what == "vertices" else {
        "seeds": 8, "spp": 64, "reference_spp": 512}  # fmt: skip
    check_agreement(moving, **samples, max_depth=2)


def with_an_image(material: edgegrad.Material) -> edgegrad.Scene:
    """The sheet with an even image as its colour: narrow lobes are differentiated in material form then."""
    scene = under_sky(replace(material, textures={"base_color": e.ImageTexture("even", e.Attribute("UVMap"))}))
    return replace(scene, images={**scene.images, "even": edgegrad.Image(np.full((2, 2, 3), 0.9, np.float32))})


@pytest.mark.parametrize(("kind", "ior", "roughness"), [("REFRACTION", 1.1, 0.03), ("REFRACTION", 1.5, 0.015),
                                                       ("GLASS", 1.1, 0.02), ("GLOSSY", 1.5, 0.012)])  # fmt: skip
def test_rounding_does_not_shift_the_samples_of_narrow_lobes(kind: str, ior: float, roughness: float) -> None:
    """Scores of samples are about 1/alpha. They cancel only if rounding does not shift all samples to one side."""
    moving = along(changing(lambda: with_an_image(glass(kind, ior, roughness)), "rotation"), ["world.rotation"])
    check_agreement(moving, seeds=8, spp=256, reference_spp=512, max_depth=2)


RIMLESS = ("GLASS-1.4-0.5-camera", "REFRACTION-1.1-0.9-ior", "REFRACTION-0.7-0.9-rotation", "GLASS-1.1-0.9-rotation")


@pytest.mark.parametrize("name", slow_but(RIMLESS, ("REFRACTION-1.1-0.9-ior",)))
def test_beckmann_glass_has_no_rim(name: str) -> None:
    """Its light fades towards the directions at which it stops to transmit, so that nothing jumps there."""
    kind, ior, roughness, what = name.split("-")
    material = replace(glass(kind, float(ior), float(roughness)), distribution="BECKMANN")
    moving = along(changing(lambda: under_sky(material), what), [PARAMETERS[what]])
    check_agreement(moving, seeds=8, spp=64, reference_spp=512, max_depth=2)


def lit(light: str, kind: str = "GLASS") -> edgegrad.Scene:
    """A sheet of rough glass before a light, or before what scatters the light of one."""
    scene = under_sky(glass(kind, 1.2, 0.9))
    scene.world = edgegrad.World(np.ones(3), 0.0)
    down = np.eye(4)
    down[:3, :3], down[:3, 3] = np.diag([1.0, -1.0, -1.0]), [-0.9, -0.3, -0.8]  # shines up
    place = np.array([-0.9, -0.3, -0.8])
    lamps: dict[str, edgegrad.AreaLight | edgegrad.PointLight | edgegrad.SunLight] = {
        "rectangle": edgegrad.AreaLight(down, np.array([1.5, 1.0]), "RECTANGLE", 30.0),
        "ellipse": edgegrad.AreaLight(down, np.array([1.5, 1.0]), "ELLIPSE", 30.0),
        "sphere": edgegrad.PointLight(place, 30.0, 0.5, True),
        "disk": edgegrad.PointLight(place, 30.0, 0.5, False),
        "sun": edgegrad.SunLight(np.array([0.8, 0.3, 0.6]), 3.0, 1.2),
    }
    if light in lamps:
        scene.lights = {"lamp": lamps[light]}
    if light == "pair":
        # One light before the other, and no shadow of a wall from the nearer.
        near = edgegrad.PointLight(np.array([-0.7, -0.3, -0.5]), 8.0, 0.3, casts_shadow=False)
        scene.lights = {"lamp": lamps["rectangle"], "near": near}
        scene.meshes = {**scene.meshes, "wall": rectangle((-0.5, -0.2, -0.3), (0.15, 0, 0), (0, 0.15, 0), "wall")}
        scene.materials = {**scene.materials, "wall": matte(0.0, 0.0, 0.0)}
    if light in ("mesh", "wall"):
        lamp = rectangle((-0.9, -0.3, -0.8), (0.8, 0, 0.2), (0, 0.6, 0), "lamp")
        scene.meshes = {**scene.meshes, "lamp": lamp}
        scene.materials = {**scene.materials, "lamp": glowing(4.0, True) if light == "mesh" else matte(0.9, 0.8, 0.7)}
    if light == "wall":
        scene.lights = {"lamp": edgegrad.AreaLight(
            np.array([[1.0, 0, 0, -0.9], [0, 1, 0, -0.3], [0, 0, 1, 1.5], [0, 0, 0, 1]]), np.array([1.0, 1.0]),
            "RECTANGLE", 200.0, casts_shadow=False,
        )}  # fmt: skip
    return scene


LIT = [f"{light}, {what}" for light in ("rectangle", "ellipse", "sphere", "disk", "sun", "pair", "mesh", "wall")
       for what in ("camera", "ior", "vertices")]  # fmt: skip


@pytest.mark.parametrize("name", slow_but(LIT, ["rectangle, camera", "sphere, ior", "mesh, vertices", "wall, ior"]))
def test_lights_with_a_size(name: str) -> None:
    light, what = name.split(", ")
    moving = along(changing(lambda: lit(light), what), [PARAMETERS[what]])
    depth = 3 if light == "wall" else 2
    # The rim of the lobe moves most with the index, and few of its samples meet a flat light.
    spp = 768 if what == "ior" and light in ("rectangle", "ellipse", "pair") else 96
    check_agreement(moving, seeds=12, spp=spp, reference_spp=768, max_depth=depth)


def lamp_moves(light: str) -> tuple[Make, list[str]]:
    """A light or an emissive mesh behind the glass moves."""

    def at(theta: float) -> edgegrad.Scene:
        scene = lit(light)
        by = theta * np.array([0.5, -0.3, 0.4])
        if light == "mesh":
            scene.meshes["lamp"].vertices = scene.meshes["lamp"].vertices + by
            return scene
        lamp = scene.lights["lamp"]
        if isinstance(lamp, edgegrad.AreaLight):
            to_world = np.array(lamp.to_world)
            to_world[:3, 3] += by
            scene.lights = {"lamp": replace(lamp, to_world=to_world)}
        elif isinstance(lamp, edgegrad.SunLight):
            scene.lights = {"lamp": replace(lamp, direction=lamp.direction + by)}
        else:
            scene.lights = {"lamp": replace(lamp, position=lamp.position + by)}
        return scene

    field = {"mesh": "meshes.lamp.vertices", "rectangle": "lights.lamp.to_world", "sun": "lights.lamp.direction"}
    return at, [field.get(light, "lights.lamp.position")]


@pytest.mark.parametrize("light", slow_but(["rectangle", "sphere", "disk", "sun", "mesh"], ["sphere"]))
def test_lights_that_move(light: str) -> None:
    check_agreement(along(*lamp_moves(light)), seeds=12, spp=96, reference_spp=768, max_depth=2)


def textured(field: str) -> tuple[Make, list[str]]:
    """The sheet with an image for its index or its normals, whose texels change."""

    def at(theta: float) -> edgegrad.Scene:
        material = glass("GLASS", 1.3, 0.9)
        pixels = np.random.default_rng(2).uniform(0.35, 0.65, (4, 4, 3))
        pixels[..., 2] = 0.9
        pixels = pixels + theta * np.random.default_rng(3).normal(size=pixels.shape)
        picture = e.ImageTexture("bends", e.Attribute("UVMap"))
        material.textures = {field: picture if field == "normal" else e.Math("ADD", e.Channel(picture, 0), 0.8)}
        scene = under_sky(material)
        scene.images = {**scene.images, "bends": edgegrad.Image(pixels.astype(np.float32))}
        return scene

    return at, ["images.bends.pixels"]


@pytest.mark.parametrize("field", ["ior", "normal"])
def test_textures_that_move_it(field: str) -> None:
    check_agreement(along(*textured(field)), seeds=8, spp=64, reference_spp=512, max_depth=2)


def behind_each_other(wall: bool) -> edgegrad.Scene:
    """Two sheets of rough glass, one behind the other, under the sky, and a wall behind them."""
    scene = under_sky(glass("GLASS", 1.2, 0.8), smooth=True)
    second = sheet()
    second.vertices = 0.8 * second.vertices - np.array([0.0, 0.0, 0.7])
    scene.meshes = {**scene.meshes, "second": second}
    if wall:
        scene.meshes = {**scene.meshes, "wall": rectangle((0.0, 0.0, -1.6), (1.5, 0, 0.2), (0, 1.5, 0.1), "wall")}
        scene.materials = {**scene.materials, "wall": matte(0.8, 0.6, 0.4)}
    return scene


@pytest.mark.slow
@pytest.mark.parametrize("what", [what for what in PARAMETERS if what != "roughness"])
def test_at_later_surfaces(what: str) -> None:
    # Shadows that the sheets' far borders throw on the wall as the sky turns are noisier than all that is tested here.
    moving = along(changing(lambda: behind_each_other(what != "rotation"), what), [PARAMETERS[what]])
    check_agreement(moving, seeds=16, spp=96, reference_spp=1024, max_depth=4)


def test_seen_in_a_mirror() -> None:
    """Paths reach the glass by way of a perfect mirror, on which they slide as the camera moves."""

    def make() -> edgegrad.Scene:
        scene = under_sky(glass("REFRACTION", 1.2, 0.9))
        scene.camera = camera((0.0, -3.0, 1.0), (0.0, 0.0, 1.2), size=16, up=(0, 0, 1))
        scene.meshes = {"sheet": rectangle((0, 0, -4.2), (30, 0, 1), (0, 30, 0.5), "glass"),
                        "mirror": rectangle((0.0, 0.5, 1.5), (9.0, 0, 0), (0, 4.0, -2.6), "mirror")}  # fmt: skip
        scene.materials = {**scene.materials,
                           "mirror": edgegrad.Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0)}  # fmt: skip
        return scene

    moving = along(camera_moves(make, (0.1, 0.2, 0.1)), ["camera.to_world"])
    check_agreement(moving, seeds=8, spp=64, reference_spp=512, max_depth=3)


@pytest.mark.parametrize(("make", "paths"), [
    (lambda _: under_sky(glass("GLASS", 1.2, 0.8), smooth=True), list(PARAMETERS.values())),
    (lambda _: lit("rectangle"), ["meshes.sheet.vertices", "camera.to_world", "lights.lamp.to_world"]),
    (lambda _: under_sky(glass("PRINCIPLED", 1.2, 0.8)), ["materials.glass.ior"]),
])  # fmt: skip
def test_both_modes_take_the_same_samples(make: Make, paths: list[str]) -> None:
    check_transpose(make, paths, spp=8, seed=4, max_depth=3)
    check_equal_bits(make, paths, spp=2, seed=4, max_depth=3)


@pytest.mark.parametrize("name", native_engine.instruction_sets())
def test_instruction_sets_agree(name: str) -> None:
    scene = under_sky(glass("GLASS", 1.2, 0.8), smooth=True)
    tangent = {"camera.to_world": np.eye(4) * 0.0, "materials.glass.ior": np.array(1.0)}
    tangent["camera.to_world"][:3, 3] = [0.5, -0.3, 0.4]
    tables = with_requested(scene, flatten(scene), tangent)
    derivative = ParameterMap(scene, tables, tangent)
    wanted, velocity = derivative.requested, derivative.push_forward(tangent)
    options = RenderOptions(8, 1, 3, terms=("interior",))
    images = []
    for isa in ("scalar", name):
        engine = native_engine.Engine(tables, 2, isa)
        engine.set_edges(tables.edges())
        images.append(engine.forward(tables, velocity, wanted, options))
    assert np.mean(np.abs(images[0] - images[1]) > 1e-3 * np.abs(images[0]).max()) < 0.01


def test_the_plan_names_what_is_computed_and_what_is_not() -> None:
    scene = lit("sphere")
    told = edgegrad.plan(scene, ["materials.glass.ior"])
    words = "the directions beyond which lobes of glass scatter no light"
    assert any(words in why for why in told.terms[0].why)
    assert not any("rough glass" in sentence for sentence in told.missing)
    lamp = edgegrad.PointLight(np.array([0.0, 0.0, -1.0]), 10.0, 0.0)
    scene.lights = {"lamp": lamp}
    missing = edgegrad.plan(scene, ["materials.glass.ior"]).missing
    assert any("lines on glass beyond" in sentence and "(lamp)" in sentence for sentence in missing)
    for unmoved in ("materials.glass.roughness", "materials.glass.base_color"):
        told = edgegrad.plan(scene, [unmoved])
        assert not any("rough glass" in sentence for sentence in (*told.missing, *told.terms[0].why))


@pytest.mark.parametrize("light", ["sphere", "emission"])
def test_rims_add_nothing_to_derivatives_by_light(light: str) -> None:
    """Paths along rims see the light before the rim, and emission on it, which the interior's own paths have."""
    scene = under_sky(glass("GLASS", 1.2, 0.9))
    # The environment is beyond the rims. A part of the camera's rays pass through the lamp before they meet the sheet.
    scene.lights = {"lamp": edgegrad.PointLight(np.array([0.65, 0.25, 1.0]), 30.0, 0.2, True,
                                                  visible_to=frozenset(RAYS))}
    glassy = next(name for name, m in scene.materials.items() if getattr(m, "kind", "") == "GLASS")
    scene.materials[glassy] = edgegrad.Material(transmission=1.0, ior=1.2, roughness=0.9, emission=np.full(3, 0.2))
    path = "lights.lamp.power" if light == "sphere" else f"materials.{glassy}.emission"
    tangent = {path: np.ones(np.shape(edgegrad.parameters.get(scene, path)))}
    renderer = edgegrad.Renderer(scene)
    images = {}
    for field in ("roughness", "ior"):
        images[field] = renderer.render_forward(
            {**tangent, f"materials.{glassy}.{field}": np.zeros(())}, spp=64, max_depth=2, terms=("interior",)
        )
        rims = renderer.last_decisions is not None and any(
            d.part == "rims" and d.computed for d in renderer.last_decisions)
        assert rims == (field == "ior")
    assert images["ior"].any()
    np.testing.assert_array_equal(images["ior"], images["roughness"])
