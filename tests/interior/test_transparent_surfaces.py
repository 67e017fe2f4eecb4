"""Light that reaches surfaces through transparent ones: its derivative by what they are and by where they are passed,
against central differences."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

import edgegrad
from edgegrad import Image, Material, Mixture
from edgegrad import expression as e
from edgegrad._check import RAYS
from edgegrad.scene import parameters
from tests.boundary.test_shadow_boundary import scene_under
from tests.support import shapes
from tests.support.picture_differences import check_agreement, check_transpose, compare, need_every_table
from tests.support.rich_scene import pose, turn
from tests.support.small_scenes import Floats, Make, along, camera, glowing, matte, rectangle

VIEW = camera((0, 1.6, 2.4), (0, 0, 0.1), 16)
SKIES = ("sky", "sky image")
UV = e.Attribute("UVMap")
UNSEEN = frozenset(RAYS) - {"camera"}


def sheet(height: float, material: str, size: float = 1.3, tilt: float = 0.2) -> edgegrad.Mesh:
    """A sheet over the floor whose UV map fills the unit square; the camera doesn't see it."""
    mesh = rectangle((0, height, 0), (0, tilt, size), (size, 0, 0), material)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return replace(mesh, attributes={"UVMap": corners[mesh.faces]}, visible_to=UNSEEN)


def veiled(light: str, **materials: Material | Mixture) -> edgegrad.Scene:
    """A floor under one sheet for each material "veil...", lit by one light."""
    scene = scene_under(light)
    scene.camera = VIEW
    del scene.meshes["box"], scene.materials["clay"]
    scene.materials.update(materials)
    for k, name in enumerate(name for name in materials if name.startswith("veil")):
        scene.meshes[name] = sheet(0.6 + 0.3 * k, name)
    return scene


def soft_mask(size: int = 8) -> Image:
    """Alphas between 0.1 and 0.9."""
    return Image(np.random.default_rng(7).uniform(0.1, 0.9, (size, size, 1)).astype(np.float32))


def masked(light: str) -> edgegrad.Scene:
    """A sheet that an image of alphas covers."""
    alpha = e.ImageTexture("mask", UV, extension="EXTEND")
    scene = veiled(light, veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": alpha}))
    scene.images["mask"] = soft_mask()
    return scene


def waves(*amplitudes: float) -> e.Expression:
    """A smooth alpha of waves across the sheet."""
    x = [e.Math("SINE", e.Math("MULTIPLY", e.Channel(UV, k), 9.0)) for k in range(2)]
    return e.Math("MULTIPLY_ADD", e.Math("MULTIPLY", x[0], x[1]), *(amplitudes or (0.4, 0.5)))


def rippled(light: str) -> edgegrad.Scene:
    return veiled(light, veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": waves()}))


def changed(make: Callable[[], edgegrad.Scene], path: str, rate: float | Floats) -> tuple[Make, list[str]]:
    """One parameter changes at a constant rate."""

    def at(theta: float) -> edgegrad.Scene:
        scene = deepcopy(make())
        parameters.put(scene, path, np.asarray(parameters.get(scene, path), np.float64) + theta * np.asarray(rate))
        return scene

    return at, [path]


def moved(make: Callable[[], edgegrad.Scene], name: str, rate: Floats) -> tuple[Make, list[str]]:
    """A mesh moves and is sheared."""
    scene = make()
    vertices = scene.meshes[name].vertices
    return changed(make, f"meshes.{name}.vertices", rate + 0.3 * (vertices - vertices.mean(axis=0))[:, [1, 2, 0]])


CLEAR = Material(np.array([0.7, 0.3, 0.2]), alpha=0.4)
GLASS = Material(np.array([0.9, 0.5, 0.2]), kind="TRANSPARENT")
PARTS = {"glass": GLASS, "clay": matte(0.5, 0.3, 0.1)}
HALF = Mixture(("glass", "clay"), np.array([0.6, 0.4]))
TEXELS = 0.5 * np.random.default_rng(3).normal(size=(8, 8, 1))


def one_material_twice() -> edgegrad.Scene:
    """Both sheets change."""
    scene = veiled("rectangle", veil=replace(CLEAR))
    scene.meshes["other"] = sheet(1.1, "veil", 0.8, -0.3)
    return scene


def bounced() -> edgegrad.Scene:
    """A floor that a wall lights, which a lamp behind a veil lights; all rays meet the veil."""
    return edgegrad.Scene(
        camera((0, 0.8, 2.0), (0, 0, 0), 16, 0.7),
        {
            "floor": rectangle((0, 0, 0), (0, 0, 1), (1, 0, 0), "floor"),
            "wall": rectangle((0, 1.0, -1.0), (1, 0, 0), (0, 1, 0), "wall"),
            "shelf": rectangle((0, 1.5, 0.1), (0, 0, 0.6), (1, 0, 0), "wall"),
            "veil": replace(sheet(1.9, "veil", 1.0), visible_to=frozenset(RAYS)),
        },
        {"floor": matte(), "wall": matte(0.9, 0.8, 0.7), "veil": replace(CLEAR)},
        {"lamp": edgegrad.PointLight(np.array([0.2, 2.4, 0.1]), 200.0)},
    )  # fmt: skip


def dozen() -> edgegrad.Scene:
    """More sheets than a ray has room for at first."""
    alpha = e.Math("MULTIPLY", waves(), 0.3)
    scene = veiled("rectangle", veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": alpha}))
    for k in range(11):
        scene.meshes[f"veil{k}"] = sheet(0.7 + 0.1 * k, "veil", 1.3 - 0.05 * k, 0.02 * k)
    return scene


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


def light_turns() -> tuple[Make, list[str]]:
    scene = rippled("rectangle")
    to_world = np.array(scene.lights["lamp"].to_world)

    def make(theta: float) -> edgegrad.Scene:
        scene = rippled("rectangle")
        turned = to_world.copy()
        turned[:3, :3] = turn(0.5 * theta, 0.3 * theta, -0.4 * theta) @ to_world[:3, :3]
        turned[:3, 3] += theta * np.array([0.5, 0.2, -0.3])
        scene.lights["lamp"] = replace(scene.lights["lamp"], to_world=turned)
        return scene

    return make, ["lights.lamp.to_world"]


def camera_moves() -> tuple[Make, list[str]]:
    def make(theta: float) -> edgegrad.Scene:
        scene = rippled("point")
        to_world = np.array(scene.camera.to_world)
        to_world[:3, 3] += theta * np.array([0.4, 0.3, -0.2])
        scene.camera = replace(scene.camera, to_world=to_world)
        return scene

    return make, ["camera.to_world"]


def in_metal() -> edgegrad.Scene:
    """A floor of rough metal, which scatters rays that no surface ends into the sky behind the sheet."""
    scene = rippled("sky")
    scene.materials["floor"] = Material(np.array([0.8, 0.7, 0.6]), kind="GLOSSY", roughness=0.6)
    return scene


def in_a_mirror() -> edgegrad.Scene:
    """A black sheet of waves before a glowing wall, both behind the camera."""
    veil = replace(rectangle((0, 0, 2.5), (0, 7, 0), (7, 0, 0), "veil"), attributes=sheet(0.0, "veil").attributes)
    return edgegrad.Scene(
        camera((0.2, 0.1, 1.5), size=16),
        {
            "mirror": rectangle((0, 0, -1.0), (3, 0, 0.2), (0, 3, 0.1), "mirror"),
            "veil": veil,
            "wall": rectangle((0, 0, 3.5), (0, 9, 0), (9, 0, 0), "wall"),
        },
        {
            "mirror": Material(np.full(3, 0.9), kind="GLOSSY", roughness=0.0),
            "veil": Material(np.zeros(3), textures={"alpha": waves()}),
            "wall": glowing(1.0),
        },
    )


def between() -> edgegrad.Scene:
    """A floor that a bright wall lights through a sheet of waves."""
    scene = bounced()
    del scene.meshes["veil"]
    scene.meshes["shelf"].vertices = scene.meshes["shelf"].vertices + np.array([0.0, 0.6, -0.3])
    scene.meshes["veil"] = sheet(0.5, "veil", 0.9)
    scene.materials["veil"] = Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": waves()})
    scene.lights["lamp"] = edgegrad.PointLight(np.array([0.2, 2.4, -0.7]), 200.0)
    return scene


DRIFT = np.array([0.3, 0.4, -0.2])
SCATTERED: dict[str, tuple[Make, list[str]]] = {
    "seen in metal": moved(in_metal, "veil", DRIFT),
    "metal moves": moved(in_metal, "floor", DRIFT),
    "seen in a mirror": moved(in_a_mirror, "mirror", DRIFT),
    "between surfaces": moved(between, "veil", DRIFT),
}


@pytest.mark.parametrize("name", SCATTERED)
def test_paths_change_with_where_they_pass(name: str) -> None:
    """Rays that surfaces scatter go through sheets by chance."""
    need_every_table()
    depth = 3 if name.startswith("between") else 2
    check_agreement(along(*SCATTERED[name]), eps=0.04, spp=128, max_depth=depth)


@pytest.mark.parametrize("make", [in_metal, in_a_mirror, between])
def test_modes_are_transposes_along_paths(make: Callable[[], edgegrad.Scene]) -> None:
    need_every_table()
    paths = [f"meshes.{name}.vertices" for name in make().meshes]
    check_transpose(lambda _: make(), [*paths, "camera.to_world"], spp=16, max_depth=4)


def facets() -> edgegrad.Scene:
    """A bent sheet of two flat facets that let light through by its angle."""
    scene = veiled("point", veil=Material(np.array([0.7, 0.3, 0.2]), textures={"alpha": e.LayerWeight("FACING", 0.5)}))
    x, z = np.tile([-1.3, 0.0, 1.3], 2), np.repeat([-1.3, 1.3], 3)
    vertices = np.stack([x, 0.65 + 0.4 * (x == 0.0) + 0.04 * z, z], axis=1)
    faces = np.array([[0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2]], np.int32)
    scene.meshes["veil"] = edgegrad.Mesh(vertices, faces, ("veil",), visible_to=UNSEEN)
    return scene


def copies() -> edgegrad.Scene:
    """The sheet of waves twice, both turned and stretched, one of them mirrored."""
    scene = rippled("rectangle")
    poses = np.stack([pose(turn(0.1, 0.3, 0.05) @ np.diag([0.6, 1.0, 0.7]), -0.4, 0.0, 0.1),
                      pose(turn(-0.1, 0.7, 0.1) @ np.diag([-0.5, 1.0, 0.6]), 0.5, 0.4, -0.2)])  # fmt: skip
    scene.meshes["veil"].instances = poses
    return scene


def lifted() -> edgegrad.Scene:
    """A smooth-shaded ball whose shadow rays start above it, under the sheet of waves."""
    scene = rippled("rectangle")
    vertices, faces = shapes.ball(1, 0.45)
    ball = edgegrad.Mesh(vertices + np.array([0, 0.1, 0]), faces, ("floor",), smoothing=faces, terminator_offset=1.0)
    scene.meshes = {"ball": ball, "veil": scene.meshes["veil"]}
    scene.camera = camera((0, 1.6, 1.6), (0, 0.1, 0), 16, 0.6)
    return scene


SHIFT = np.zeros((2, 4, 4))
SHIFT[:, :3] = np.random.default_rng(2).normal(size=(2, 3, 4)) * 0.3
MOTIONS: dict[str, tuple[Make, list[str]]] = {
    **{f"sheet moves under {light}": moved(lambda light=light: rippled(light), "veil", DRIFT)
       for light in ("point", "rectangle", "sun", "mesh", "sky", "sky image")},
    "floor moves": moved(lambda: rippled("rectangle"), "floor", np.array([0.2, 0.5, 0.3])),
    "light moves": changed(lambda: rippled("point"), "lights.lamp.position", np.array([0.8, -0.3, 0.6])),
    "sun turns": changed(lambda: rippled("hard sun"), "lights.lamp.direction", np.array([0.2, 0.0, -0.3])),
    "sheet moves over a ball": moved(lifted, "veil", DRIFT),
    "facets move": moved(facets, "veil", DRIFT),
    "copies move": moved(copies, "veil", DRIFT),
    "copies are placed anew": changed(copies, "meshes.veil.instances", SHIFT),
    "rectangle turns": light_turns(),
    "camera moves": camera_moves(),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_shadows_change_with_where_they_are_cast(name: str) -> None:
    need_every_table()
    check_agreement(along(*MOTIONS[name]), seeds=8, reference_spp=256, max_depth=2)


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
    """Behind what is opaque now there is light that would come through."""
    need_every_table()
    make, path, direction = ONE_SIDED[name]
    found, exact, error = compare(deepcopy(make()), path, direction, 0.01, one_sided=True, spp=256)
    assert exact != 0.0
    assert abs(found - exact) <= 4.0 * error + 2e-3 * abs(exact)


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


@pytest.mark.parametrize("make", [lambda _: rippled("sky image"), lambda _: masked("mesh"), lambda _: dozen()])
def test_modes_are_transposes_by_place(make: Make) -> None:
    need_every_table()
    paths = ["meshes.veil.vertices", "meshes.floor.vertices", "materials.floor.base_color", "camera.to_world"]
    check_transpose(make, paths, spp=16, max_depth=3)


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
    assert any("what veil let through changes" in words for words in made.terms[0].why) == changes
    assert made.missing == ()


def test_plans_name_shadows_of_texels_without_interpolation() -> None:
    scene = masked("point")
    sharp = e.ImageTexture("mask", UV, interpolation="CLOSEST", extension="EXTEND")
    scene.materials["veil"].textures = {"alpha": sharp}
    assert any("in what veil let through" in words for words in edgegrad.plan(scene, ["lights.lamp.position"]).missing)
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
