"""Edges in the light that mirrors and smooth glass throw on other surfaces, against central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from edgegrad import AreaLight, Material, Mesh, PointLight, Renderer, Scene
from tests.support.block_statistics import check_noticed
from tests.support.picture_differences import agreement, check_agreement, check_equal_bits, check_transpose
from tests.support.rich_scene import pose, turn
from tests.support.shapes import ball
from tests.support.small_scenes import Make, along, box, camera, glowing, matte, mesh_drifts, need, rectangle

MIRROR = Material(kind="GLOSSY", base_color=np.array([0.9, 0.8, 0.6]), roughness=0.0)
GLASS = Material(kind="GLASS", base_color=np.full(3, 0.95), roughness=0.0, ior=1.4)
CLAY = matte(0.6, 0.5, 0.4)
DARK = matte(0.0, 0.0, 0.0)


def behind_screen(**meshes: Mesh) -> Scene:
    """A floor, a mirror, and a screen between the floor and what the mirror shows to it."""
    return Scene(camera((1.0, 2.5, 0.6), (1.0, 0.0, 0.0), 16, 0.4),
                 {"floor": rectangle((1, 0, 0), (0, 0, 1.5), (1.0, 0, 0), "floor"),
                  "mirror": rectangle((-0.9, 0.6, 0), (0, 0, -0.7), (0.0, 0.6, 0), "mirror"),
                  "screen": rectangle((0.3, 1.05, 0), (0, 0.6, 0), (0, 0, 1.5), "dark"), **meshes},
                 {"floor": CLAY, "mirror": MIRROR, "dark": DARK, "glow": glowing(20.0, True),
                  "warm": glowing(40.0)})  # fmt: skip


def lamp_behind_screen() -> Scene:
    return behind_screen(lamp=rectangle((0.0, 1.0, 0.1), (0, 0.2, 0.02), (0.05, 0, 0.25), "glow"))


def card_before_lamp() -> Scene:
    """A card hides a part of the lamp from the mirror."""
    scene = lamp_behind_screen()
    scene.meshes["card"] = rectangle((-0.4, 0.75, 0.0), (0.0, 0.12, 0.02), (0, 0, 0.1), "dark")
    return scene


def table_light(scene: Scene) -> Scene:
    """The scene with a small lamp of the table that shines on the mirror."""
    place = pose(turn(0.0, np.pi / 2, 0.0), 0.0, 1.0, 0.1)
    scene.lights = {"lamp": AreaLight(place, np.array([0.3, 0.3]), "RECTANGLE", 30.0)}
    return scene


def card_before_table_light() -> Scene:
    card = rectangle((-0.4, 0.75, 0.0), (0.0, 0.12, 0.02), (0, 0, 0.1), "dark")
    return table_light(behind_screen(card=card))


def low_screen() -> Scene:
    """A screen whose lower edge has a shadow in the light of the mirror."""
    return table_light(behind_screen(screen=rectangle((0.3, 0.95, 0), (0, 0.7, 0), (0, 0, 1.5), "dark")))


def two_glows() -> Scene:
    """A body whose faces glow differently, so that its creases are seen from all sides."""
    made = box((0.0, 1.0, 0.1), (0.15, 0.15, 0.2), "glow", 0.7)
    faces = np.arange(len(made.faces))
    return behind_screen(box=Mesh(made.vertices, made.faces, ("glow", "warm"), (faces // 2 % 2).astype(np.int32)))


def lamp_over_glass() -> Scene:
    """A ball of glass under an emissive mesh; the camera sees the floor alone."""
    vertices, faces = ball(3, 0.3)
    made = Mesh(vertices + np.array([0.54, 1.2, 0.0]), faces, ("glass",), smoothing=faces)
    lamp = rectangle((0.8, 2.6, 0.1), (0.35, 0.0, 0.0), (0, 0.0, 0.3), "glow")
    return Scene(camera((0.3, 0.6, 2.2), (0.3, 0.0, -0.1), 16, 0.4),
                 {"floor": rectangle((0, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"), "ball": made, "lamp": lamp},
                 {"floor": CLAY, "glass": GLASS, "glow": glowing(6.0)})  # fmt: skip


def small_lamp_over_glass(card: tuple[float, float, float]) -> Scene:
    """A ball of glass under a small lamp, and a card in its light, before or behind the ball."""
    scene = lamp_over_glass()
    del scene.meshes["lamp"]
    scene.meshes["card"] = rectangle(card, (0.1, 0.0, 0.02), (0.0, 0.02, 0.1), "dark")
    scene.materials["dark"] = DARK
    scene.lights = {"lamp": PointLight(np.array([0.75, 2.6, 0.05]), 60.0, 0.1, True)}
    return scene


def by_a_wall() -> Scene:
    """A wall which the mirror lights, and which lights the floor."""
    return Scene(camera((1.0, 2.5, 0.6), (1.0, 0.0, 0.0), 16, 0.5),
                 {"floor": rectangle((1, 0, 0), (0, 0, 1.5), (1.5, 0, 0), "floor"),
                  "mirror": rectangle((-0.9, 0.9, 0), (0, 0, -0.6), (0.1, 0.6, 0), "mirror"),
                  "lamp": rectangle((0.2, 0.8, 0.1), (0, 0.0, 0.25), (0, 0.2, 0.0), "glow"),
                  "wall": rectangle((1.9, 0.75, 0), (0, 0, 1.5), (0, 0.75, 0), "wall")},
                 {"floor": CLAY, "mirror": MIRROR, "wall": matte(0.9, 0.9, 0.9), "glow": glowing(20.0)})  # fmt: skip


def turned(make: Callable[[], Scene], mesh: str, rate: float, growth: float = 0.0) -> tuple[Make, list[str]]:
    """A mesh turns about an axis through its middle, and grows."""

    def at(t: float) -> Scene:
        scene = make()
        body = scene.meshes[mesh]
        middle = body.vertices.mean(axis=0)
        body.vertices = middle + (1.0 + growth * t) * (body.vertices - middle) @ turn(0.0, 0.3 * rate * t, rate * t).T
        return scene

    return at, [f"meshes.{mesh}.vertices"]


# Each with the depth of its paths.
CASES: dict[str, tuple[tuple[Make, list[str]], int]] = {
    "lamp moves": (mesh_drifts(lamp_behind_screen, "lamp"), 3),
    "lamp grows": (turned(lamp_behind_screen, "lamp", 0.5, 1.0), 3),
    "card grows": (turned(card_before_lamp, "card", 0.0, 1.0), 3),
    "creases turn": (turned(two_glows, "box", 1.0), 3),
    "lamp moves over glass": (mesh_drifts(lamp_over_glass, "lamp"), 4),
    "lamp grows over glass": (turned(lamp_over_glass, "lamp", 0.0, 1.0), 4),
    "two surfaces: lamp grows": (turned(by_a_wall, "lamp", 0.0, 1.0), 4),
    "card moves before a table light": (mesh_drifts(card_before_table_light, "card"), 3),
    "screen moves": (mesh_drifts(low_screen, "screen"), 3),
    "card moves over glass": (mesh_drifts(lambda: small_lamp_over_glass((0.75, 1.8, 0.05)), "card"), 4),
    "card moves under glass": (mesh_drifts(lambda: small_lamp_over_glass((0.5, 0.4, 0.05)), "card"), 4),
}
SMALL_LIGHTS = ["card moves before a table light", "screen moves", "card moves over glass", "card moves under glass"]


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_differences(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    spp = 512 if case in SMALL_LIGHTS else 128
    check_agreement(along(make, paths), eps=0.1, seeds=16, spp=spp, reference_spp=8 * spp, max_depth=depth)


@pytest.mark.parametrize("case", ["lamp grows", "card grows", "creases turn", "two surfaces: lamp grows",
                                  "card moves before a table light", "screen moves"])  # fmt: skip
def test_differences_notice_missing_edges(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    check_noticed(agreement(along(make, paths), eps=0.1, seeds=16, spp=128, reference_spp=1024, max_depth=depth,
                            terms=("interior", "primary", "shadow")))  # fmt: skip


@pytest.mark.parametrize("case", SMALL_LIGHTS)
def test_few_samples_find_small_lights(case: str) -> None:
    """Sums of most seeds are about the same. Without beams, most find nothing. Single ones may have a rare sample."""
    need("native")
    (make, paths), depth = CASES[case]
    scene, rate = along(make, paths)(0.0)
    renderer = Renderer(scene, engine="native")
    pictures = [renderer.render_forward(rate, spp=128, seed=seed, max_depth=depth, terms=("indirect",))
                for seed in range(16)]  # fmt: skip
    sums = np.sum(pictures, axis=(1, 2, 3), dtype=np.float64)
    print(case, np.round(sums, 1))
    middle = float(np.median(sums))
    assert np.median(np.abs(sums - middle)) < 0.3 * abs(middle)


@pytest.mark.parametrize("case", CASES)
def test_modes_are_transposes(case: str) -> None:
    need("native")
    (make, paths), depth = CASES[case]
    check_transpose(make, paths, spp=256, seed=3, max_depth=depth, terms=("indirect",))


def test_same_bits_for_any_number_of_threads() -> None:
    need("native")
    (make, paths), depth = CASES["card grows"]
    check_equal_bits(make, paths, spp=8, max_depth=depth)
