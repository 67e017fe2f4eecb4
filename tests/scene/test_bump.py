"""Bump: the normal in closed form, attributes beside positions, and derivatives by all that a height consists of."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Camera, Image, Material, Mesh, Mixture, Scene, SunLight, World, render
from edgegrad import expression as e
from edgegrad.scene import parameters
from tests.support.block_statistics import check, mean_p_value
from tests.support.node_cases.texture_points import corners_mesh, evaluate, points, scene_of
from tests.support.picture_differences import check_transpose, need_every_table, sums_of_differences

POSITION = e.Coordinates("POSITION")


def unit(v: Any) -> NDArray[np.float64]:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True), np.float64)


def slope(gradient: tuple[float, float, float]) -> e.Expression:
    """A height with this gradient in space."""
    return e.VectorMath("DOT_PRODUCT", POSITION, gradient)


def computed(bump: e.Expression, normal: Any, surface: Any) -> NDArray[np.float32]:
    where = points(len(normal), normal=normal, true_normal=surface, position=(0.3, -0.2, 0.5))
    return evaluate(scene_of([bump], {"mesh": corners_mesh(P=np.zeros((1, 3)))}), where)[0, :, :3]


@pytest.mark.parametrize("inverted", [False, True])
def test_normals_of_a_linear_height(inverted: bool) -> None:
    """cos N - d g for the slope g within the surface (Mikkelsen 2010), where N is the surface's own normal."""
    rng = np.random.default_rng(2)
    n, gradient = unit(rng.normal(size=(40, 3))), rng.normal(size=3)
    along = gradient - n * (n @ gradient)[:, None]
    bent = unit(n - (-0.7 if inverted else 0.7) * along)
    strength = 0.4
    bump = e.Bump(slope(tuple(gradient)), strength, 0.7, 0.01, invert=inverted)
    expected = unit(strength * bent + (1.0 - strength) * n)
    assert computed(bump, n, n) == pytest.approx(expected, abs=2e-4)


def test_smooth_normals_are_bent_by_the_slope_of_the_face() -> None:
    rng = np.random.default_rng(3)
    surface = unit(rng.normal(size=(40, 3)))
    n = unit(surface + 0.3 * rng.normal(size=(40, 3)))
    gradient = rng.normal(size=3)
    # Orthonormal tangents a, b of the face: the surface gradient is h_a (b x n) + h_b (n x a).
    a = unit(np.cross(surface, rng.normal(size=3)))
    b = np.cross(surface, a)
    cosine = np.einsum("ij,ij->i", n, surface)[:, None]
    bent = (a @ gradient)[:, None] * np.cross(b, n) + (b @ gradient)[:, None] * np.cross(n, a)
    expected = unit(np.abs(cosine) * n - np.sign(cosine) * bent)
    assert computed(e.Bump(slope(tuple(gradient)), step=0.01), n, surface) == pytest.approx(expected, abs=3e-4)


def test_bumps_add_up() -> None:
    """A bump of a bump on a plane: small slopes add."""
    n = np.array([[0.0, 0.0, 1.0]])
    both = e.Bump(slope((0.01, 0.0, 0.0)), step=0.1, normal=e.Bump(slope((0.0, 0.02, 0.0)), step=0.1))
    assert computed(both, n, n)[0] == pytest.approx((-0.01, -0.02, 1.0), abs=1e-3)


def test_what_has_no_slope_leaves_the_normal() -> None:
    n = unit(np.array([[0.1, 0.2, 1.0]]))
    for height in (0.7, e.Math("MULTIPLY", e.Coordinates("INCOMING"), 3.0)):
        assert computed(e.Bump(height), n, n)[0] == pytest.approx(n[0], abs=1e-6)
    with pytest.raises(ValueError, match="step must be above 0"):
        computed(e.Bump(slope((1, 0, 0)), step=0.0), n, n)


def tile(normal: e.Expression, material: Material | None = None, **images: Image) -> Scene:
    """A tilted square with UV coordinates 0 to 1, lit by a wide sun and the sky."""
    c, s = np.cos(0.4), np.sin(0.4)
    vertices = np.array([[-1, -c, -s], [1, -c, -s], [1, c, s], [-1, c, s]], np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)[faces]
    to_world = np.eye(4)
    to_world[2, 3] = 4.0
    base = material or Material(np.full(3, 0.6))
    clay = replace(base, textures={**base.textures, "normal": normal}, normal_space="WORLD")
    place = vertices[faces].astype(np.float32)
    flat = place * np.array([0.9, 1.1, 0.3], np.float32)
    mesh = Mesh(vertices, faces, ("clay",), attributes={"uv": uv, "place": place, "flat": flat})
    sun = SunLight(direction=np.array([0.4, 0.3, -0.9]), strength=2.0, angle=0.2)
    return Scene(Camera(to_world, fov_x=0.38, width=12, height=12), {"tile": mesh}, {"clay": clay}, {"sun": sun},
                 World(np.full(3, 0.3)), images)  # fmt: skip


def waves(place: e.Expression) -> e.Expression:
    return e.Math("SINE", e.VectorMath("DOT_PRODUCT", place, (5.0, 3.0, 0.0)))


@pytest.mark.parametrize("instanced", [False, True])
def test_attributes_are_extended_over_their_face(instanced: bool) -> None:
    """A height of an attribute that is the position is that of the position, also where instances scale it."""
    by_attribute = tile(e.Bump(waves(e.Attribute("place")), 1.0, 0.1, 0.01))
    by_position = tile(e.Bump(waves(POSITION), 1.0, 0.1, 0.01))
    if instanced:
        for scene in (by_attribute, by_position):
            scene.meshes["tile"].vertices = scene.meshes["tile"].vertices / 2.0
            scene.meshes["tile"].instances = np.diag([2.0, 2.0, 2.0, 1.0])[None]
    ours, theirs = (render(scene, spp=16, max_depth=2) for scene in (by_attribute, by_position))
    assert np.ptp(theirs) > 0.1
    assert ours == pytest.approx(theirs, abs=2e-3)


def test_normal_maps_may_be_bent_further() -> None:
    """A normal map as an expression is the one of the material; a bump without slope leaves it."""
    color = e.Combine(0.6, 0.45, 0.9)
    plain = tile(color)
    plain.materials["clay"] = replace(plain.materials["clay"], normal_space="TANGENT", normal_uv="uv",
                                      normal_strength=0.7)  # fmt: skip
    ours = render(plain, spp=8, max_depth=2)
    for normal in (e.NormalMap(color, 0.7, "uv"), e.Bump(1.0, normal=e.NormalMap(color, 0.7, "uv"))):
        assert render(tile(normal), spp=8, max_depth=2) == pytest.approx(ours, abs=1e-5)


@pytest.mark.parametrize("mixed", [False, True])
def test_smooth_normals_replace_those_of_all_shading(mixed: bool) -> None:
    """A displaced surface looks like a surface with those normals, without the shadowing of bent normals."""
    bump = e.Bump(slope((0.3, 0.2, 0.0)), step=0.01)
    scene = tile(bump)
    clay = scene.materials["clay"]
    scene.materials["clay"] = replace(clay, textures={"smooth_normal": bump, "base_color": e.VectorMath(
        "ABSOLUTE", e.Coordinates("NORMAL"))}, normal_space="TANGENT")  # fmt: skip
    if mixed:
        scene.materials["part"] = scene.materials["clay"]
        scene.materials["clay"] = Mixture(("part", "part"), np.array([0.5, 0.5]))
    face = np.array([0.0, -np.sin(0.4), np.cos(0.4)])
    gradient = np.array([0.3, 0.2, 0.0])
    n = unit(face - (gradient - face * (face @ gradient)))
    picture = render(scene, spp=64, max_depth=2)
    ratio = picture.mean(axis=(0, 1))
    assert ratio / ratio[2] == pytest.approx(np.abs(n) / abs(n[2]), rel=2e-3)


def displaced(gradient: tuple[float, float, float], turn: Any, side: float = 1.0) -> Scene:
    """A square that glows by its smooth normal, displaced by a linear height, as placed by a matrix (3, 3)."""
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float64)
    after = square + np.outer(square @ gradient, (0, 0, 1))
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)[:, :: int(side)]
    places = {"before": square, "after": after}
    before, own = e.Attribute("before"), e.Attribute("after", is_position=True)
    height = e.VectorMath("DOT_PRODUCT", before, gradient)
    normal = e.DisplacedBump(height, 0.01, before, own, side)
    shown = e.VectorMath("MULTIPLY_ADD", e.Coordinates("NORMAL"), (0.5, 0.5, 0.5), (0.5, 0.5, 0.5))
    glow = Material(np.zeros(3), textures={"smooth_normal": normal, "emission": shown})
    mesh = Mesh(after @ np.transpose(turn), faces, ("glow",), normals=np.tile(turn @ np.array([0.0, 0.0, 1.0]), (4, 1)),
                smoothing=faces, attributes={k: v[faces].astype(np.float32) for k, v in places.items()})  # fmt: skip
    to_world = np.eye(4)
    to_world[2, 3] = 4.0
    return Scene(Camera(to_world, fov_x=0.1, width=4, height=4), {"square": mesh}, {"glow": glow})


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_displacement_and_bump_has_the_normal_of_the_displaced_plane(side: float) -> None:
    gradient = (0.4, -0.2, 0.0)
    (c, s), (k, h) = ((np.cos(angle), np.sin(angle)) for angle in (0.3, 0.4))
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ [[1.0, 0.0, 0.0], [0.0, k, -h], [0.0, h, k]]
    turn = turn @ np.diag([side, 1.0, 1.0])
    scene = displaced(gradient, turn, side)
    expected = turn @ unit(np.array([-0.4, 0.2, 1.0]))
    found = render(scene, spp=8, max_depth=1).reshape(-1, 3) * 2.0 - 1.0
    assert found == pytest.approx(np.tile(expected, (16, 1)), abs=2e-3)


PLACE = e.Attribute("place", is_position=True)
PIXELS = np.random.default_rng(5).uniform(0.0, 1.0, (6, 6, 1)).astype(np.float32)
BUMPS = {
    "image": e.Bump(e.ImageTexture("heights", e.Attribute("uv")), 0.8, 0.2, 0.02),
    "waves": e.Bump(waves(POSITION), 0.7, 0.1, e.Math("MULTIPLY_ADD", e.Channel(POSITION, 1), 0.003, 0.02)),
    "displaced": e.DisplacedBump(
        e.Math("MULTIPLY", waves(e.DisplacedPosition(e.Attribute("flat"), PLACE)), 0.05), 0.02, e.Attribute("flat"),
        PLACE),
    "chain": e.Bump(waves(e.Attribute("place")), 0.7, 0.1, 0.02, e.Bump(
        e.ImageTexture("heights", e.Attribute("uv"), "CUBIC"), 0.8, 0.2, 0.02)),
}  # fmt: skip


def bumped(name: str) -> Scene:
    gloss = Material(np.full(3, 0.5), roughness=0.5, specular_ior_level=0.5)
    return tile(BUMPS[name], gloss, heights=Image(PIXELS))


PARAMETERS = [("image", "images.heights.pixels"), ("image", "materials.clay.textures.normal"),
              ("waves", "materials.clay.textures.normal"), ("chain", "materials.clay.textures.normal"),
              ("waves", "meshes.tile.vertices"), ("chain", "images.heights.pixels"),
              ("chain", "meshes.tile.attributes.place"), ("displaced", "meshes.tile.attributes.flat"),
              ("displaced", "meshes.tile.attributes.place"),
              ("displaced", "materials.clay.textures.normal")]  # fmt: skip


@pytest.mark.parametrize("name, path", PARAMETERS)
def test_pictures_change_as_their_derivatives_say(name: str, path: str) -> None:
    need_every_table()
    scene = bumped(name)
    value = np.asarray(parameters.get(scene, path), np.float64)
    direction = np.random.default_rng(3).uniform(0.2, 0.5, value.shape)
    if path.endswith("vertices"):  # the camera sees no edge
        direction = np.broadcast_to([0.3, 0.2, 0.4], value.shape)
    elif path.endswith("normal"):
        direction = direction * value
    found, exact = sums_of_differences(scene, path, direction, 2e-3, spp=32, seeds=12)
    assert abs(exact.mean()) > 0.0
    check(mean_p_value(found - exact, 0.0, rounding=4e-3 * abs(found.mean())))


@pytest.mark.parametrize("name", BUMPS)
def test_both_modes_agree(name: str) -> None:
    need_every_table()
    paths = ["materials.clay.textures.normal", "meshes.tile.vertices", "meshes.tile.attributes.uv"]
    if name not in ("waves", "displaced"):
        paths.append("images.heights.pixels")
    check_transpose(lambda _: bumped(name), paths, spp=8, max_depth=2)
