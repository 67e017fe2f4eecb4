"""Borders within faces at which textures jump, as the camera sees them, against central differences.

The surfaces only emit, so that the primary term is the whole derivative: it is zero but for the borders, the outlines,
and how much of each cell a pixel sees.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import expression as e
from edgegrad import plan
from tests.support.fields.outlined import doughnut, over_a_sheet
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose
from tests.support.small_scenes import Make, along, camera, need, rectangle

PLACE, POSE, VERTICES, COPIES = (
    "meshes.sheet.transform", "camera.to_world", "meshes.sheet.vertices", "meshes.sheet.instances"
)  # fmt: skip
UV = e.Attribute("UVMap")
CHECKER = e.Checker(UV, (3.0, 1.0, 0.5), (0.2, 0.4, 1.0), 4.3)
STEPS = e.Math("FLOOR", e.Math("MULTIPLY", e.Channel(UV, 0), 5.3))
TEXELS = np.random.default_rng(1).uniform(0.1, 3.0, (5, 7, 3)).astype(np.float32)
STRIPE = e.Math("GREATER_THAN", e.Channel(UV, 0), e.Math("MULTIPLY", e.Channel(UV, 1), 0.7))
RAMP = e.Ramp(e.Channel(UV, 1), np.repeat([[0.2], [1.5], [0.7]], (60, 100, 96), axis=0) * np.ones(4), False)
CLOSEST = e.ImageTexture("texels", UV, interpolation="CLOSEST")
CUT = e.Math("GREATER_THAN", e.Channel(CLOSEST, 0), 1.5)
RAINBOW = e.ColorModel(e.Combine(e.Math("MULTIPLY_ADD", e.Channel(UV, 0), 2.1, -0.55), 0.8, 1.5), "HSV", "RGB")
SETTINGS = {"eps": 0.02, "max_depth": 1}


def sheet_scene(paint: e.Expression = CHECKER, grid: int = 1) -> edgegrad.Scene:
    """A tilted sheet that emits what its texture says; `grid` quads along each side, and UVs over [0, 1]."""
    step = np.linspace(-1.0, 1.0, grid + 1)
    y, x = np.meshgrid(step, step, indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), 0.3 * x.ravel() - 0.2 * y.ravel()], axis=1)
    first = (np.arange(grid)[:, None] * (grid + 1) + np.arange(grid)).ravel()
    quads = np.stack([first, first + 1, first + grid + 2, first + grid + 1], axis=1)
    faces = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    mesh = edgegrad.Mesh(vertices, faces, ("paint",))
    mesh.attributes["UVMap"] = (0.5 + 0.5 * vertices[:, :2]).astype(np.float32)[faces]
    paint_ = edgegrad.Material(np.zeros(3), np.ones(3), textures={"emission": paint})
    return edgegrad.Scene(camera=camera((0.3, 0.2, 3.0)), meshes={"sheet": mesh}, materials={"paint": paint_},
                          images={"texels": edgegrad.Image(TEXELS)})  # fmt: skip


def moved(scene: edgegrad.Scene, theta: float) -> edgegrad.Scene:
    """The scene with the sheet shifted and turned."""
    place = np.eye(4)
    place[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
    place[:3, 3] = theta * np.array([0.6, -0.4, 0.2])
    scene.meshes["sheet"].transform = place
    return scene


def stretched(scene: edgegrad.Scene, theta: float) -> edgegrad.Scene:
    """The scene with the sheet's corners pulled apart."""
    vertices = scene.meshes["sheet"].vertices
    scene.meshes["sheet"].vertices = vertices + theta * np.sin(2.0 * vertices[:, [1, 2, 0]] + 0.5)
    return scene


def turned(scene: edgegrad.Scene, theta: float) -> edgegrad.Scene:
    """The scene with the camera turned and moved."""
    c, s = np.cos(0.5 * theta), np.sin(0.5 * theta)
    turn = np.eye(4)
    turn[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    turn[:3, 3] = theta * np.array([0.2, 0.5, 0.3])
    scene.camera = replace(scene.camera, to_world=turn @ scene.camera.to_world)
    return scene


def copied(scene: edgegrad.Scene, theta: float) -> edgegrad.Scene:
    """The scene with two copies of the sheet, one in front of the other, of which one moves."""
    places = np.stack([np.eye(4), np.eye(4)])
    places[0, :3, :3] *= 0.6
    places[0, :3, 3] = [-0.4 + theta, 0.2, 0.8]
    places[1, :3, 3] = [0.2, -0.5 * theta, -0.5]
    scene.meshes["sheet"].instances = places
    return scene


def seen_by(scene: edgegrad.Scene, **fields: object) -> edgegrad.Scene:
    """The scene with other fields of its camera."""
    scene.camera = replace(scene.camera, **fields)
    return scene


def behind_glass(scene: edgegrad.Scene) -> edgegrad.Scene:
    """The scene with a half-transparent sheet before a part of it, and an opaque one before another."""
    for name, x, alpha in (("veil", 0.5, 0.4), ("card", -0.7, 1.0)):
        scene.materials[name] = edgegrad.Material(np.zeros(3), np.full(3, 0.5), alpha=alpha, kind="PRINCIPLED")
        scene.meshes[name] = rectangle((x, 0.2, 1.0), (0.3, 0, 0), (0, 0.4, 0), name)
    return scene


def case(move: Callable[[edgegrad.Scene, float], edgegrad.Scene], make: Callable[[], edgegrad.Scene]) -> Make:
    return lambda theta: move(make(), theta)


CASES: dict[str, tuple[Make, list[str]]] = {
    "squares move": (case(moved, sheet_scene), [PLACE]),
    "squares are stretched": (case(stretched, sheet_scene), [VERTICES]),
    "the camera turns": (case(turned, sheet_scene), [POSE]),
    "texels move": (case(moved, lambda: sheet_scene(CLOSEST)), [PLACE]),
    "bright texels move": (case(moved, lambda: sheet_scene(CUT)), [PLACE]),
    "steps move": (case(moved, lambda: sheet_scene(STEPS)), [PLACE]),
    "a comparison moves": (case(moved, lambda: sheet_scene(STRIPE)), [PLACE]),
    "a constant ramp moves": (case(moved, lambda: sheet_scene(RAMP, grid=3)), [PLACE]),
    "hues beyond [0, 1] move": (case(moved, lambda: sheet_scene(RAINBOW)), [PLACE]),
    "squares end at edges": (
        case(moved, lambda: sheet_scene(e.Checker(UV, (3.0, 1.0, 0.5), (0.2, 0.4, 1.0), 4.0), grid=4)), [PLACE]
    ),
    # Squares of another size: no border may cross a border of blocks between the places where derivatives are taken.
    "copies move": (case(copied, lambda: sheet_scene(e.Checker(UV, (3.0, 1.0, 0.5), (0.2, 0.4, 1.0), 4.9))), [COPIES]),
    "a lens": (
        case(moved, lambda: seen_by(sheet_scene(), aperture_radius=0.1, focus_distance=2.0)), [PLACE]
    ),
    "parallel rays": (
        case(turned, lambda: seen_by(sheet_scene(), kind="ORTHOGRAPHIC", ortho_width=2.5)), [POSE]
    ),
    "other surfaces are in front": (case(moved, lambda: behind_glass(sheet_scene())), [PLACE]),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_borders_agree_with_central_differences(name: str) -> None:
    need("native")
    wide = {"eps": 0.1, "reference_spp": 2048} if name == "a lens" else {}
    check_agreement(along(*CASES[name]), **{**SETTINGS, **wide})


@pytest.mark.parametrize("name", ["squares are stretched", "the camera turns", "copies move"])
def test_both_modes_agree(name: str) -> None:
    need("native")
    check_transpose(*CASES[name], spp=16, max_depth=1)
    check_equal_bits(*CASES[name], spp=16, max_depth=1)


def test_light_that_other_surfaces_throw_moves_with_them() -> None:
    """A wall lit by the moving squares: later vertices of paths ride on their surfaces, and need no borders."""
    need("native")

    def lit() -> edgegrad.Scene:
        scene = sheet_scene()
        scene.camera = camera((0.0, -4.0, 1.5), (0, 0, 0.8), up=(0, 0, 1))
        scene.materials["wall"] = edgegrad.Material(np.full(3, 0.8))
        scene.meshes["wall"] = rectangle((0, 1.5, 0.5), (2.0, 0, 0), (0, 0, 1.5), "wall")
        return scene

    check_agreement(along(case(moved, lit), [PLACE]), eps=0.02, max_depth=2)


def test_the_plan_names_what_is_sampled_and_what_is_not() -> None:
    need("native")

    def said(paint: e.Expression, wrt: list[str], grid: int = 1) -> tuple[str, str]:
        made = plan(sheet_scene(paint, grid), wrt, max_depth=1)
        return str(made), " ".join(made.missing)

    sampled, left_out = "at which textures jump", "where their textures may jump"
    for wrt in ([PLACE], [VERTICES], [POSE]):
        words, missing = said(CHECKER, wrt)
        assert sampled in words and left_out not in missing
    assert sampled not in said(CHECKER, ["materials.paint.emission"])[0]
    smooth = e.ImageTexture("texels", UV)
    assert sampled not in said(smooth, [PLACE])[0] and left_out not in said(smooth, [PLACE])[1]
    for mortar, named in ((0.1, False), (0.0, True)):
        assert (left_out in said(e.Brick(UV, mortar_smooth=mortar), [PLACE])[1]) == named
    tinted = e.HueSaturation(smooth, hue=0.3)
    assert left_out not in said(tinted, [PLACE])[1], "a hue that jumps has one colour"
    for paint in (STRIPE, RAMP):
        words, missing = said(paint, [PLACE])
        assert sampled in words and left_out not in missing
    for paint in (e.Math("LESS_THAN", e.Noise(UV), 0.5), e.WhiteNoise(UV), e.Voronoi(UV)):
        words, missing = said(paint, [PLACE])
        assert left_out in missing
    dense = e.Checker(UV, scale=1e6)
    assert left_out in said(dense, [PLACE])[1] and sampled not in said(dense, [PLACE])[0]
    slides = "may jump, where they move"
    assert slides in said(CHECKER, ["meshes.sheet.attributes.UVMap"])[1]
    words, missing = said(CUT, [PLACE])
    assert sampled in words and left_out not in missing, "whole texels are cut off"
    cut = e.Math("LESS_THAN", e.Channel(smooth, 0), 1.5)
    for paint, named in ((smooth, False), (tinted, False), (CUT, False), (cut, True)):
        assert (slides in said(paint, ["images.texels.pixels"])[1]) == named


@pytest.mark.parametrize("what", ["fields.ring.values", "fields.ring.transform", POSE])
def test_the_plan_names_jumps_on_fields_that_move(what: str) -> None:
    need("native")
    scene = over_a_sheet({"ring": doughnut()})
    scene.materials["checks"] = edgegrad.Material(textures={"base_color": e.Checker(e.Coordinates("POSITION"))})
    scene.fields["ring"].material = "checks"
    missing = " ".join(plan(scene, [what], max_depth=1).missing)
    assert "borders within the faces of ring where their textures may jump" in missing
    assert "may jump" not in " ".join(plan(scene, ["world.strength"], max_depth=1).missing)
