"""Light through transparent surfaces: its derivative by their materials, compared with central differences."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Image, Material
from edgegrad import expression as e
from tests.support.block_statistics import check, mean_p_value
from tests.support.picture_differences import check_agreement, check_transpose, need_every_table, sums_of_differences
from tests.support.scenes.transparent_sheets import (
    CLEAR,
    GLASS,
    HALF,
    PARTS,
    TEXELS,
    UV,
    bounced,
    changed,
    dozen,
    masked,
    one_material_twice,
    rippled,
    veiled,
)
from tests.support.small_scenes import Floats, Make, along, camera, matte, rectangle


def under(light: str) -> tuple[Make, list[str]]:
    return changed(lambda: veiled(light, veil=replace(CLEAR)), "materials.veil.alpha", 0.8)


VALUES: dict[str, tuple[Make, list[str]]] = {
    **{f"alpha under {light}": under(light)
       for light in ("point", "sphere", "spot", "rectangle", "sun", "mesh", "sky", "sky image")},
    "a colour": changed(lambda: veiled("rectangle", veil=replace(GLASS)), "materials.veil.base_color",
                        np.array([-1.0, 0.5, 1.0])),
    "one of two sheets": changed(lambda: veiled("rectangle", veil=replace(CLEAR), veil2=replace(GLASS)),
                                 "materials.veil.alpha", 1.0),
    "two sheets of a material": changed(one_material_twice, "materials.veil.alpha", 0.7),
    "a weight": changed(lambda: veiled("sphere", **PARTS, veil=replace(HALF)), "materials.veil.weights",
                        np.array([0.5, -0.5])),
    "texels": changed(lambda: masked("rectangle"), "images.mask.pixels", TEXELS),
    "texels under a sky": changed(lambda: masked("sky"), "images.mask.pixels", TEXELS),
    "numbers of an expression": changed(lambda: rippled("sun"), "materials.veil.textures.alpha", 0.1),
    "a dozen sheets": changed(dozen, "materials.veil.textures.alpha", 0.1),
    "bounced light": changed(bounced, "materials.veil.alpha", 0.8),
}


@pytest.mark.parametrize("name", VALUES)
def test_shadows_change_with_what_casts_them(name: str) -> None:
    need_every_table()
    check_agreement(along(*VALUES[name]), seeds=8, spp=32, reference_spp=128, eps=0.1,
                    max_depth=3 if "bounced" in name else 2)


ONE_SIDED: dict[str, tuple[Callable[[], edgegrad.Scene], str, Floats]] = {
    "an opaque sheet opens": (
        lambda: veiled("rectangle", veil=matte(0.7, 0.3, 0.2)), "materials.veil.alpha", np.array(-1.0),
    ),
    "a sheet behind an opaque one": (
        lambda: veiled("rectangle", veil=matte(0.7, 0.3, 0.2), veil2=replace(CLEAR)), "materials.veil.alpha",
        np.array(-1.0),
    ),
    "a channel that nothing passes": (
        lambda: veiled("sphere", veil=Material(np.array([0.8, 0.0, 0.5]), kind="TRANSPARENT")),
        "materials.veil.base_color", np.array([0.0, 1.0, 0.0]),
    ),
    "an invisible sheet appears": (
        lambda: veiled("sun", veil=Material(np.array([0.7, 0.3, 0.2]), alpha=0.0)), "materials.veil.alpha",
        np.array(1.0),
    ),
}


def pane(alpha: float, material: str = "veil") -> edgegrad.Scene:
    """A pane that the camera sees before a wall, both lit."""
    scene = edgegrad.Scene(
        camera((0.2, 0.1, 3.0), size=16),
        {
            "pane": rectangle((0, 0, 0), (0.7, 0.05, 0.1), (-0.05, 0.6, 0.15), material),
            "wall": rectangle((0, 0, -1.0), (2, 0, 0), (0, 2, 0), "wall"),
        },
        {"veil": Material(np.array([0.7, 0.3, 0.2]), np.full(3, 0.1), alpha=alpha), "wall": matte(0.9, 0.8, 0.7)},
        {"lamp": edgegrad.PointLight(np.array([1.0, 1.5, 3.0]), 200.0)},
    )
    texels = np.where(np.random.default_rng(5).uniform(size=(6, 6, 1)) < 0.5, 0.0, 1.0)
    scene.images["mask"] = Image(texels.astype(np.float32))
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    scene.meshes["pane"] = replace(scene.meshes["pane"], attributes={"UVMap": corners[scene.meshes["pane"].faces]})
    alphas = e.ImageTexture("mask", UV, extension="EXTEND")
    scene.materials["cut"] = Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": alphas})
    return scene


ONE_SIDED.update({
    "a pane opens": (lambda: pane(1.0), "materials.veil.alpha", np.array(-1.0)),
    "a pane appears": (lambda: pane(0.0), "materials.veil.alpha", np.array(1.0)),
    "a stencil": (lambda: pane(0.5, "cut"), "images.mask.pixels", 1.0 - 2.0 * pane(0.5, "cut").images["mask"].pixels),
})  # fmt: skip


@pytest.mark.parametrize("name", ONE_SIDED)
def test_the_ends_of_the_range_have_one_sided_derivatives(name: str) -> None:
    """Surfaces that are opaque at theta = 0 have one-sided derivatives, by the light behind them."""
    need_every_table()
    make, path, direction = ONE_SIDED[name]
    found, exact = sums_of_differences(deepcopy(make()), path, direction, 0.01, one_sided=True, spp=96)
    assert exact.mean() != 0.0
    check(mean_p_value(found - exact, 0.0, rounding=2e-3 * abs(exact.mean())))


@pytest.mark.parametrize("name", ["a sheet behind an opaque one", "a pane opens", "a stencil"])
def test_modes_are_transposes_at_the_ends(name: str) -> None:
    need_every_table()
    make, path, _ = ONE_SIDED[name]
    check_transpose(lambda _: make(), [path, "materials.floor.base_color"][: 1 + ("floor" in make().materials)], spp=16)


@pytest.mark.parametrize("name", ["texels", "a weight", "bounced light"])
def test_modes_are_transposes_by_value(name: str) -> None:
    need_every_table()
    make, paths = VALUES[name]
    check_transpose(make, paths, spp=16, max_depth=4)


CHANGING: dict[str, tuple[edgegrad.Scene, list[str], bool]] = {
    "an alpha": (veiled("sun", veil=replace(CLEAR)), ["materials.veil.alpha"], True),
    "an opaque one's": (veiled("sun", veil=matte()), ["materials.veil.alpha"], True),
    "what it scatters": (veiled("sun", veil=replace(CLEAR)), ["materials.veil.base_color"], False),
    "a constant one's place": (veiled("sun", veil=replace(CLEAR)), ["meshes.veil.vertices"], False),
    "a textured one's place": (rippled("sun"), ["meshes.veil.vertices"], True),
    "what it lights": (rippled("sun"), ["meshes.floor.vertices"], True),
    "texels": (masked("sun"), ["images.mask.pixels"], True),
    "a weight": (veiled("sun", **PARTS, veil=replace(HALF)), ["materials.veil.weights"], True),
    "a part's colour": (veiled("sun", **PARTS, veil=replace(HALF)), ["materials.glass.base_color"], True),
    "another part's": (veiled("sun", **PARTS, veil=replace(HALF)), ["materials.clay.base_color"], False),
}


@pytest.mark.parametrize("name", CHANGING)
def test_plans_name_what_lets_through_other_light(name: str) -> None:
    scene, wrt, changes = CHANGING[name]
    made = edgegrad.plan(scene, wrt, max_depth=2)
    assert any("the transmittance of veil changes" in words for words in made.terms[0].why) == changes
    assert made.missing == ()


def test_plans_name_shadows_of_texels_without_interpolation() -> None:
    scene = masked("point")
    sharp = e.ImageTexture("mask", UV, interpolation="CLOSEST", extension="EXTEND")
    scene.materials["veil"].textures = {"alpha": sharp}
    missing = edgegrad.plan(scene, ["lights.lamp.position"]).missing
    assert any("the transmittance of veil jump" in words for words in missing)
    assert edgegrad.plan(scene, ["lights.lamp.power"]).missing == ()


@pytest.mark.parametrize(("depth", "seen"), [(1, 0.0), (2, 1.0), (3, 1.0)])
def test_a_veil_before_an_even_sky(depth: int, seen: float) -> None:
    """What paths meet behind a surface that they pass counts even if it is nothing: dL/dalpha = sky (albedo - 1)."""
    need_every_table()
    albedo, sky = np.array([0.7, 0.3, 0.2]), 1.5
    veil = rectangle((0, 0, 0), (0, 4, 0), (4, 0, 0), "veil")
    material = Material(albedo, alpha=0.4, specular_ior_level=0.0)
    scene = edgegrad.Scene(camera(size=8), {"veil": veil}, {"veil": material}, world=edgegrad.World(np.ones(3), sky))
    found = edgegrad.Renderer(scene).render_forward({"materials.veil.alpha": 1.0}, spp=64, max_depth=depth)
    np.testing.assert_allclose(found.mean(axis=(0, 1)), sky * (seen * albedo - 1.0), rtol=0.02)
