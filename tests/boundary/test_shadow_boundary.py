"""Shadow boundaries against central differences: every kind of light, of motion, of occluder and of camera."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad.rendering.renderer import Renderer
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table
from tests.support.rich_scene import turn
from tests.support.scenes.box_under_lights import (
    ABOVE,
    BOX,
    CASES,
    LIGHTS,
    at,
    box_moves,
    mesh_moves,
    scene_under,
    sky_turns,
)
from tests.support.slow_cases import slow_but
from tests.support.small_scenes import Make, along, box, rectangle

# Each kind of light, of motion and of camera once in every run, the others in the slow ones.
QUICK = (
    "point: box moves", "disk: box moves", "sized spot: floor moves", "rectangle: box moves", "sun: box moves",
    "mesh: box moves", "sky image: box moves", "ellipse: floor moves", "hard sun: floor moves", "disk: camera moves",
    "spot: light moves", "disk: light moves", "disk: light grows", "rectangle: light moves and turns",
    "spread: light moves and turns", "sun: light turns", "sky image: light turns", "mesh: light moves",
    "lens: box moves", "orthographic: camera moves", "panorama: box moves", "wide filter and crop: box moves",
)
RUNS = slow_but(CASES, QUICK)


@pytest.mark.parametrize("name", RUNS)
def test_shadows_agree_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*CASES[name]))


def test_turning_sky_is_met_by_rays_that_go_on() -> None:
    """If a path may scatter once more, rays into the environment are recorded vertices, which turn with it."""
    need_every_table()
    check_agreement(along(sky_turns(), ["world.rotation"]), max_depth=3)


# ---------------------------------------------------------------- what hides light, and from what
def flattened(light: str) -> Make:
    """A cube whose scale along an axis is zero: faces lie on each other, and others have no area."""
    vertices, faces = shapes.cube(0.5)
    flat = (vertices * [1.0, 0.0, 1.0]) @ turn(0.2, 0.5, 0.4).T

    def make(theta: float) -> edgegrad.Scene:
        scene = scene_under(light)
        place = scene.meshes["box"].vertices.mean(axis=0) + theta * np.array([1.0, 0.6, -0.4])
        scene.meshes["box"] = edgegrad.Mesh(flat + place, faces, ("clay",))
        return scene

    return make


def instanced(theta: float) -> edgegrad.Scene:
    """Two copies of a box, one mirrored, over a floor that is an instance too."""
    scene = scene_under("rectangle")
    scene.meshes["box"].vertices = scene.meshes["box"].vertices - [0.1, 0.7, 0.0]
    scene.meshes["box"].instances = np.stack([
        at(turn(0.2, 0.5 + 0.5 * theta, 0.1), (0.4 + 0.8 * theta, 0.7, 0.2)),
        at(turn(0.1, 0.3, 0.5) @ np.diag([-0.8, 0.7, 1.1]), (-0.5, 0.6 - 0.7 * theta, 0.0)),
    ])
    scene.meshes["floor"].instances = at(turn(0.2 * theta, 0.0, 0.1 * theta), (0.0, 0.4 * theta, 0.0))[None]
    return scene


def stretched(theta: float) -> edgegrad.Scene:
    """The mesh that is placed changes, and with it all its copies."""
    scene = instanced(0.0)
    box_ = scene.meshes["box"]
    box_.vertices = box_.vertices * (1.0 + theta * np.array([0.5, -0.8, 0.3])) + theta * np.array([0.2, 0.4, -0.3])
    return scene


def linked(theta: float) -> edgegrad.Scene:
    """Two lights over two boxes: one lights the floor alone and is hidden by one box, one casts no shadow."""
    scene = scene_under("sphere")
    scene.meshes["other"] = box((-0.5, 0.5, 0.2), (0.2, 0.25, 0.2), "clay", 0.2)
    scene.lights["lamp"] = replace(LIGHTS["sphere"], receivers=("floor",), blockers=("box",))
    scene.lights["bare"] = edgegrad.PointLight(np.array([-0.8, 2.0, 0.3]), 40.0, casts_shadow=False)
    for name in ("box", "other"):
        scene.meshes[name].vertices = scene.meshes[name].vertices + theta * np.array([1.0, 0.3, 0.2])
    return scene


def veiled(theta: float) -> edgegrad.Scene:
    """A half-transparent box and a coloured pane under a light, over a floor seen through a veil."""
    scene = scene_under("sphere")
    scene.materials["clay"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.6)
    scene.materials["pane"] = edgegrad.Material(np.array([0.9, 0.5, 0.2]), kind="TRANSPARENT")
    scene.materials["veil"] = edgegrad.Material(np.array([0.3, 0.3, 0.4]), alpha=0.4)
    scene.meshes["pane"] = rectangle((-0.4, 0.9, 0.2), (0.3, 0.05, 0.0), (0.0, 0.1, 0.25), "pane")
    scene.meshes["veil"] = rectangle((0.2, 2.0, 1.8), (0.3, 0.0, 0.0), (0.0, 0.1, -0.3), "veil")
    for name, rate in (("box", [1.0, 0.3, 0.2]), ("pane", [-0.5, 0.4, 0.7])):
        scene.meshes[name].vertices = scene.meshes[name].vertices + theta * np.array(rate)
    return scene


def windowed(light: str) -> Make:
    """Of a box every second triangle lets light through, so that it changes on either side of edges that are none."""

    def moved(theta: float) -> edgegrad.Scene:
        scene = box_moves(light)(theta)
        scene.materials["pane"] = edgegrad.Material(np.array([0.7, 0.3, 0.2]), alpha=0.2)
        mesh = scene.meshes["box"]
        mesh.materials = ("clay", "pane")
        mesh.face_material = np.arange(len(mesh.faces), dtype=np.int32) % 2
        return scene

    return moved


def unseen(theta: float) -> edgegrad.Scene:
    """A box that only shadow rays can hit, a card that they cannot hit, and a card that the camera cannot see."""
    scene = box_moves("point")(theta)
    scene.meshes["box"].visible_to = frozenset(("shadow",))
    card = mesh_moves(lambda: edgegrad.Scene(
        deepcopy(ABOVE), {"card": rectangle((-0.4, 0.4, 0.0), (0.3, 0.0, 0.0), (0.0, 0.1, -0.3), "clay")},
        scene.materials,
    ), "card", np.array([0.4, 0.5, -0.3]))(theta).meshes["card"]
    scene.meshes["card"] = replace(card, visible_to=frozenset(("camera", "diffuse")))
    return scene


def glossy(theta: float) -> edgegrad.Scene:
    """A rough mirror with a smooth-shaded bump as the floor, under a light that it lights through one lobe alone."""
    scene = box_moves("rectangle")(theta)
    scene.materials["floor"] = edgegrad.Material(np.array([0.3, 0.4, 0.5]), roughness=0.45, metallic=0.3,
                                                 specular_ior_level=0.5)
    scene.lights["lamp"] = replace(LIGHTS["rectangle"], visible_to=frozenset(("glossy",)))
    return scene


CARD = ["meshes.card.vertices", *BOX]
HIDING: dict[str, tuple[Make, list[str]]] = {
    "instances are placed": (instanced, ["meshes.box.instances", "meshes.floor.instances"]),
    "instances are stretched": (stretched, BOX),
    "a flattened cube under the sky": (flattened("sky"), BOX),
    "a flattened cube under the sky's image": (flattened("sky image"), BOX),
    "a flattened cube under a sphere": (flattened("sphere"), BOX),
    "linked lights": (linked, [*BOX, "meshes.other.vertices"]),
    "transparent occluders": (veiled, [*BOX, "meshes.pane.vertices"]),
    "windows under the sky": (windowed("sky"), BOX),
    "windows under the sky's image": (windowed("sky image"), BOX),
    "windows under a sphere": (windowed("sphere"), BOX),
    "meshes that some rays don't meet": (unseen, CARD),
    "glossy floor": (glossy, BOX),
}


@pytest.mark.parametrize("name", HIDING)
def test_what_hides_light_agrees_with_central_differences(name: str) -> None:
    need_every_table()
    check_agreement(along(*HIDING[name]))


def test_windows_draw_no_lines_on_the_floor() -> None:
    """Edges in a window's plane have no directions in it of their own: where it meets the floor nothing is special."""
    need_every_table()
    scene, tangent = along(*HIDING["windows under the sky"])(0.0)
    scene.camera = replace(scene.camera, width=72, height=72)
    renderer = Renderer(scene, engine="native")
    pictures = [renderer.render_forward(tangent, spp=256, seed=k, terms=("shadow",)) for k in range(4)]
    floor = np.mean(pictures, axis=0)[40:]
    # A line of one pixel's width has a 72nd of the pixels. If it is most of the derivative, its mean is above eight
    # times the root mean square and its peaks are far higher; a smooth shadow stays below, noise included.
    assert 0.0 < np.abs(floor).max() < 12.0 * np.sqrt((floor**2).mean())


# ---------------------------------------------------------------- reverse mode
DOT: dict[str, tuple[Make, list[str]]] = {
    **{name: CASES[name] for name in (
        "point: light moves", "disk: light moves", "rectangle: light moves and turns", "sun: light turns",
        "sky image: light turns", "mesh: box moves", "sky: floor moves", "lens: box moves",
        "orthographic: camera moves")},
    "instances are placed": HIDING["instances are placed"],
    "transparent occluders": HIDING["transparent occluders"],
}


@pytest.mark.parametrize("name", DOT)
def test_reverse_mode_is_the_transpose(name: str) -> None:
    need_every_table()
    check_transpose(*DOT[name], spp=32, terms=("shadow",))


def test_a_strength_alone_moves_no_shadow() -> None:
    need_every_table()
    renderer = Renderer(scene_under("rectangle"))
    image = renderer.render_forward({"lights.lamp.power": 1.0}, spp=4, terms=("primary", "shadow"))
    assert not image.any()
