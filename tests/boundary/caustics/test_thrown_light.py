"""Light that narrow lobes, which are no perfect mirrors, throw on other surfaces, against central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import edgegrad
from edgegrad import AreaLight, Image, Material, Mesh, PointLight, Renderer, Scene, SunLight, World
from edgegrad.scene.light import Light
from tests.support.block_statistics import check_noticed
from tests.support.picture_differences import agreement, check_agreement, check_equal_bits, check_transpose
from tests.support.rich_scene import pose, turn
from tests.support.scenes.box_under_lights import DOWN
from tests.support.shapes import ball
from tests.support.small_scenes import Make, along, camera, matte, mesh_drifts, moved, need, rectangle

DARK = matte(0.0, 0.0, 0.0)
LIGHTS: dict[str, Callable[[float], Light]] = {
    "rectangle": lambda t: AreaLight(pose(turn(0.2, 0.0, 0.1) @ DOWN, 1.0 + t, 1.8, 0.3 + t / 2),
                                     np.array([0.8 + t, 0.6]), "RECTANGLE", 30.0),
    "disk": lambda t: PointLight(np.array([1.0 + t, 1.8, 0.3]), 60.0, 0.4 + 0.3 * t, False),
    "sphere": lambda t: PointLight(np.array([1.0 + t, 1.8, 0.3]), 60.0, 0.4 + 0.3 * t, True),
    "sun": lambda t: SunLight(np.array([-0.6 + t, -1.0, -0.2]), 2.0, 0.3 + 0.2 * t),
}  # fmt: skip
FIELDS = {"rectangle": ["to_world", "size"], "disk": ["position", "radius"], "sphere": ["position", "radius"],
          "sun": ["direction", "angle"]}  # fmt: skip


def metal(roughness: float) -> Material:
    return Material(kind="GLOSSY", base_color=np.array([0.9, 0.8, 0.6]), roughness=roughness)


def coated(roughness: float) -> Material:
    return Material(kind="PRINCIPLED", base_color=np.array([0.3, 0.2, 0.1]), roughness=0.7, coat_weight=1.0,
                    coat_roughness=roughness, coat_ior=2.0)  # fmt: skip


def under_ball(body: Material, light: Light, floor: Material | None = None) -> Scene:
    """A ball above a floor, most of it beside the picture."""
    vertices, faces = ball(3, 0.4)
    made = Mesh(vertices + np.array([-0.5, 0.45, 0.0]), faces, ("body",), smoothing=faces)
    scene = Scene(camera((0.3, 2.5, 1.5), (0.3, 0.0, 0.0), 16, 0.5),
                  {"floor": rectangle((0, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"), "ball": made},
                  {"floor": floor or matte(0.6, 0.5, 0.4), "body": body})  # fmt: skip
    scene.lights = {"lamp": light}
    return scene


def by_panel(body: Material) -> Scene:
    """A floor, a panel that shows a lamp to it, and a card before the lamp. A screen hides both from the floor."""
    scene = Scene(camera((1.0, 2.5, 0.6), (1.0, 0.0, 0.0), 16, 0.4),
                  {"floor": rectangle((1, 0, 0), (0, 0, 1.5), (1.0, 0, 0), "floor"),
                   "panel": rectangle((-0.9, 0.6, 0), (0, 0, -0.7), (0.0, 0.6, 0), "body"),
                   "screen": rectangle((0.3, 1.05, 0), (0, 0.6, 0), (0, 0, 1.5), "dark"),
                   "card": rectangle((-0.4, 0.75, 0.0), (0.0, 0.12, 0.02), (0, 0, 0.1), "dark")},
                  {"floor": matte(0.6, 0.5, 0.4), "body": body, "dark": DARK})  # fmt: skip
    place = pose(turn(0.0, np.pi / 2, 0.0), 0.0, 1.0, 0.1)
    scene.lights = {"lamp": AreaLight(place, np.array([0.3, 0.3]), "RECTANGLE", 30.0)}
    return scene


def under_sky(body: Material, *, image: bool) -> Scene:
    """The floor and the panel under a roof, so that much of the floor's light comes from the sky by the panel."""
    scene = by_panel(body)
    scene.lights = {}
    scene.meshes["roof"] = rectangle((1.3, 2.8, 0), (0, 0, 4.0), (2.0, 0.05, 0), "dark")
    scene.world = World(np.ones(3), 3.0)
    if image:
        sky = np.random.default_rng(0).uniform(0.2, 1.0, (16, 32, 3)).astype(np.float32)
        sky[5:8] *= 6.0
        scene.images = {"sky": Image(sky)}
        scene.world = World(np.ones(3), 3.0, image="sky")
    return scene


def with_wall(body: Material) -> Scene:
    """A wall which the panel lights, and which lights the floor."""
    scene = by_panel(body)
    del scene.meshes["screen"], scene.meshes["card"]
    scene.meshes["wall"] = rectangle((1.9, 0.75, 0), (0, 0, 1.5), (0, 0.75, 0), "wall")
    scene.materials["wall"] = matte(0.9, 0.9, 0.9)
    return scene


def light_moves(body: Material, kind: str, floor: Material | None = None) -> tuple[Make, list[str]]:
    return lambda t: under_ball(body, LIGHTS[kind](t), floor), [f"lights.lamp.{field}" for field in FIELDS[kind]]


def polished_and_moved() -> tuple[Make, list[str]]:
    return (lambda t: moved(under_ball(metal(0.2 - t / 2), SPHERE), t, "ball", (0.3, 0.4, 0.2)),
            ["meshes.ball.vertices", "materials.body.roughness"])


SPHERE, SUN = LIGHTS["sphere"](0.0), LIGHTS["sun"](0.0)
# Each with the depth of its paths.
CASES: dict[str, tuple[tuple[Make, list[str]], int]] = {
    **{f"{kind} moves": (light_moves(metal(0.1), kind), 3) for kind in LIGHTS},
    "ball moves: sphere": (mesh_drifts(lambda: under_ball(metal(0.1), SPHERE), "ball"), 3),
    "ball moves: sun": (mesh_drifts(lambda: under_ball(coated(0.17), SUN), "ball"), 3),
    "floor moves": (mesh_drifts(lambda: under_ball(coated(0.1), SPHERE), "floor"), 3),
    "ball moves and is polished": (polished_and_moved(), 3),
    "gloss: rectangle moves": (light_moves(metal(0.1), "rectangle", metal(0.5)), 3),
    "card moves": (mesh_drifts(lambda: by_panel(metal(0.1)), "card"), 3),
    "panel moves": (mesh_drifts(lambda: by_panel(coated(0.1)), "panel"), 3),
    "screen moves": (mesh_drifts(lambda: by_panel(coated(0.05)), "screen"), 3),
    "wall: panel moves": (mesh_drifts(lambda: with_wall(metal(0.1)), "panel"), 4),
    "even sky: panel moves": (mesh_drifts(lambda: under_sky(metal(0.1), image=False), "panel"), 3),
    "image: panel moves": (mesh_drifts(lambda: under_sky(coated(0.1), image=True), "panel"), 4),
    "image: card moves": (mesh_drifts(lambda: under_sky(metal(0.1), image=True), "card"), 4),
}
SMALL = ("card moves", "panel moves", "screen moves", "wall: panel moves", "even sky: panel moves",
         "image: panel moves", "image: card moves")  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_differences(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    spp = 512 if case in SMALL else 128
    check_agreement(along(make, paths), eps=0.1, seeds=16, spp=spp, reference_spp=8 * spp, max_depth=depth)


@pytest.mark.parametrize("case", ["sphere moves", "sun moves", "card moves", "screen moves",
                                  "even sky: panel moves"])  # fmt: skip
def test_differences_notice_missing_jumps(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    check_noticed(agreement(along(make, paths), eps=0.1, seeds=16, spp=512, reference_spp=4096, max_depth=depth,
                            terms=("interior", "primary", "shadow")))  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_modes_are_transposes(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    check_transpose(make, paths, spp=64, seed=3, max_depth=depth)


@pytest.mark.parametrize("case", ["ball moves: sphere", "image: panel moves"])
def test_same_bits_for_any_number_of_threads(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    check_equal_bits(make, paths, spp=8, max_depth=depth)


@pytest.mark.parametrize("light", ["sphere", "sun"])
def test_noise_does_not_grow_as_lobes_narrow(light: str) -> None:
    """A lobe of an alpha of 0.0025 has about the noise of a perfect mirror, and not 1/alpha times as much.

    At a fixed direction its samples would have 30 to 100 times as much.
    """
    need("native")

    def noise(roughness: float) -> float:
        scene = under_ball(metal(roughness), LIGHTS[light](0.0))
        tangent = {"meshes.ball.vertices": np.full_like(scene.meshes["ball"].vertices, 0.3)}
        renderer = Renderer(scene, engine="native")
        sums = [renderer.render_forward(tangent, spp=128, seed=seed, max_depth=3).sum(dtype=np.float64)
                for seed in range(16)]  # fmt: skip
        return float(np.std(sums, ddof=1))

    assert noise(0.05) < 5.0 * noise(0.0)


def test_plan_names_what_is_computed() -> None:
    need("native")
    said = str(edgegrad.plan(by_panel(metal(0.1)), ["meshes.panel.vertices"], max_depth=3))
    assert "the outlines of lamp in light that mirrors, smooth glass and lobes nearly as narrow (body) throw" in said
    assert "except where it comes straight from lamps or the sky" in said
    clear = by_panel(metal(0.1))
    clear.materials["dark"] = Material(kind="TRANSPARENT")
    said = str(edgegrad.plan(clear, ["meshes.panel.vertices"], max_depth=3))
    assert "except where it comes straight" not in said
