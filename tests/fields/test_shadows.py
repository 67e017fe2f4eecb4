"""Shadows of distance fields, and on them: derivatives of pictures by what moves them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import AreaLight, Material, Mesh, PointLight, Scene, SpotLight, SunLight, World, plan
from edgegrad._check import RAYS
from tests.support.fields.splines import Floats, exact_sphere, sampled, torus
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.small_scenes import camera, matte, rectangle

DARK = World(np.zeros(3))
VEIL = Material(np.array([0.8, 0.3, 0.3]), kind="PRINCIPLED", alpha=0.5)
Change = Callable[[Scene, float], tuple[Scene, Mapping[str, Floats]]]


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def downwards(x: float, y: float, z: float) -> Floats:
    """The pose of a light that shines along -z from a point."""
    to_world = np.eye(4)
    to_world[:3, 3] = x, y, z
    return to_world


LIGHTS: dict[str, Callable[[], Any]] = {
    "point": lambda: PointLight(np.array([0.4, 0.3, 3.0]), power=300.0),
    "ball": lambda: PointLight(np.array([0.4, 0.3, 3.0]), power=300.0, radius=0.3),
    "spot": lambda: SpotLight(np.array([0.4, 0.3, 3.0]), np.array([0.0, 0.0, -1.0]), power=600.0, angle=1.6, blend=1.0),
    "sun": lambda: SunLight(np.array([0.2, 0.1, -1.0]), strength=5.0, angle=0.0),
    "wide sun": lambda: SunLight(np.array([0.2, 0.1, -1.0]), strength=5.0, angle=0.3),
    "area": lambda: AreaLight(downwards(0.4, 0.3, 3.0), power=200.0, size=np.array([0.8, 0.5])),
    "disk": lambda: AreaLight(downwards(0.4, 0.3, 3.0), power=200.0, size=np.array([0.8, 0.5]), shape="ELLIPSE"),
}


def over_a_floor(light: str, shape: str = "ball", **others: Any) -> Scene:
    """A field over a floor. The camera looks past the field at its shadow."""
    field = exact_sphere(0.45, 20) if shape == "ball" else sampled(torus, 28)
    field = replace(field, transform=downwards(0.0, 0.0, 0.8) @ np.diag([0.8, 0.8, 0.8, 1.0]), visible_to=frozenset(
        ["diffuse", "glossy", "transmission", "shadow"]))
    return Scene(**({
        "camera": camera((0.3, -0.2, 4.0), (0.0, 0.0, 0.0), 16, 0.55, up=(0, 1, 0)),
        "meshes": {"floor": rectangle((0, 0, 0), (3, 0, 0), (0, 3, 0), "floor")},
        "materials": {"floor": matte(0.7, 0.6, 0.5), "clay": matte(0.0, 0.0, 0.0)},
        "fields": {"body": field}, "world": DARK,
        "lights": {"lamp": LIGHTS[light]()} if light in LIGHTS else {}} | others))


def values(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """Coefficients of the field change."""
    field = scene.fields["body"]
    x, y, z = (np.linspace(-1.0, 1.0, n) for n in field.values.shape)
    tangent = 0.15 + 0.1 * np.cos(2.0 * x[:, None, None] + 1.0) * np.sin(3.0 * y[None, :, None]) + 0.05 * z
    moved = replace(field, values=(field.values + theta * tangent).astype(np.float32))
    return replace(scene, fields={"body": moved}), {"fields.body.values": tangent}


def transform(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The field moves, turns and stretches."""
    field, tangent = scene.fields["body"], np.zeros((4, 4))
    tangent[:3] = [[0.2, -0.5, 0.3, 0.5], [0.5, -0.1, -0.4, -0.3], [-0.3, 0.4, 0.1, 0.4]]
    moved = replace(field, transform=field.transform + theta * tangent)
    return replace(scene, fields={"body": moved}), {"fields.body.transform": tangent}


def light(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The light moves."""
    lamp = scene.lights["lamp"]
    path = {PointLight: "position", SpotLight: "position", SunLight: "direction"}.get(type(lamp), "to_world")
    tangent = np.array([0.5, -0.4, 0.3])
    if path == "to_world":
        tangent, shift = np.zeros((4, 4)), tangent
        tangent[:3, 3] = shift
    value = np.asarray(getattr(lamp, path), float) + theta * tangent
    return replace(scene, lights={"lamp": replace(lamp, **{path: value})}), {f"lights.lamp.{path}": tangent}


def floor(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The floor tilts."""
    mesh = scene.meshes["floor"]
    tangent = np.zeros_like(mesh.vertices)
    tangent[:, 2] = 0.5 + 0.2 * mesh.vertices[:, 0] - 0.1 * mesh.vertices[:, 1]
    moved = replace(mesh, vertices=mesh.vertices + theta * tangent)
    return replace(scene, meshes={**scene.meshes, "floor": moved}), {"meshes.floor.vertices": tangent}


def eye(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The camera moves."""
    tangent = np.zeros((4, 4))
    tangent[:3, 3] = 0.5, 0.4, 0.3
    to_world = np.asarray(scene.camera.to_world, float) + theta * tangent
    return replace(scene, camera=replace(scene.camera, to_world=to_world)), {"camera.to_world": tangent}


CHANGES: dict[str, Change] = {"values": values, "transform": transform, "light": light, "floor": floor, "camera": eye}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("kind", LIGHTS)
def test_the_shadow_of_a_ball(kind: str, change: str) -> None:
    """On a floor, in each light."""
    scene = over_a_floor(kind)
    check_agreement(partial(CHANGES[change], scene), max_depth=2, eps=0.04, seeds=8)


@pytest.mark.parametrize("kind", ["point", "area", "wide sun"])
def test_the_shadow_of_a_torus(kind: str) -> None:
    """It throws a shadow on itself, too, and the camera sees both."""
    scene = over_a_floor(kind, "torus", materials={"floor": matte(0.7, 0.6, 0.5), "clay": matte(0.6, 0.6, 0.7)})
    ring = scene.fields["body"]
    ring.visible_to = frozenset(RAYS)
    ring.transform = ring.transform @ np.array(
        [[1.0, 0, 0, 0], [0, 0.5, -0.87, 0], [0, 0.87, 0.5, 0], [0, 0, 0, 1.0]])
    for change in (values, light):
        check_agreement(partial(change, scene), max_depth=2, eps=0.02, seeds=8)


def with_a_mesh(scene: Scene, name: str, mesh: Mesh, seen_by: Sequence[str], **materials: Material) -> Scene:
    """The scene with one more mesh, which some kinds of rays meet."""
    mesh.visible_to = frozenset(seen_by)
    return replace(scene, meshes={**scene.meshes, name: mesh}, materials={**scene.materials, **materials})


def with_a_lamp_of_a_mesh() -> Scene:
    """A sheet that shines takes the place of the light."""
    glow = Material(np.zeros(3), np.array([60.0, 50.0, 40.0]))
    return with_a_mesh(over_a_floor("none"), "lamp", rectangle((0.4, 0.3, 3.0), (0.0, 0.3, 0.0), (0.4, 0.0, 0.0),
                                                               "glow"), ["diffuse", "shadow"], glow=glow)


def sheet(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The sheet moves."""
    mesh = scene.meshes["lamp"]
    tangent = np.tile([0.5, -0.4, 0.3], (4, 1))
    moved = replace(mesh, vertices=mesh.vertices + theta * tangent)
    return replace(scene, meshes={**scene.meshes, "lamp": moved}), {"meshes.lamp.vertices": tangent}


@pytest.mark.parametrize("change", [values, sheet, floor])
def test_light_of_a_mesh(change: Change) -> None:
    scene = with_a_lamp_of_a_mesh()
    check_agreement(partial(change, scene), max_depth=2, eps=0.04, seeds=8)


@pytest.mark.parametrize("change", [values, transform, floor, eye])
def test_the_shadow_in_an_environment(change: Change) -> None:
    scene = over_a_floor("none", world=World(np.array([0.6, 0.8, 1.0])))
    check_agreement(partial(change, scene), max_depth=2, eps=0.04, seeds=8)


def test_the_shadow_in_the_light_of_an_image() -> None:
    v, u = np.meshgrid(np.linspace(0, np.pi, 16), np.linspace(0, 2 * np.pi, 32), indexing="ij")
    pixels = np.stack([1.0 + 0.9 * np.cos(u), 1.0 + 0.9 * np.sin(u), 1.0 + 0.9 * np.cos(v)], axis=-1)
    scene = over_a_floor("none", world=World(np.ones(3), image="sky"),
                         images={"sky": edgegrad.Image(pixels.astype(np.float32))})
    for change in (values, floor):
        check_agreement(partial(change, scene), max_depth=2, eps=0.04, seeds=8)


def between_walls(**others: Any) -> Scene:
    """A wall that a lamp lights alone, a floor that the wall lights, and the field between both."""
    lamp = SpotLight(np.array([-0.9, 0.0, 1.0]), np.array([-1.0, 0.0, 0.0]), power=500.0, angle=2.2, blend=1.0)
    scene = over_a_floor("none", lights={"lamp": lamp})
    wall = rectangle((-1.3, 0, 1.0), (0, 0.8, 0), (0, 0, 0.8), "wall")
    return replace(with_a_mesh(scene, "wall", wall, sorted(RAYS), wall=matte(0.9, 0.8, 0.7)), **others)


@pytest.mark.parametrize("change", [values, transform, floor])
def test_a_field_between_surfaces(change: Change) -> None:
    scene = between_walls()
    check_agreement(partial(change, scene), max_depth=3, eps=0.1, seeds=32, spp=128, reference_spp=2048)


def test_later_bounces() -> None:
    """Light that the floor throws on a ceiling, which the camera sees alone."""
    ceiling = rectangle((1.0, 0.0, 1.5), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0), "floor")
    scene = with_a_mesh(over_a_floor("area"), "ceiling", ceiling, sorted(RAYS))
    check_agreement(partial(values, scene), max_depth=3, eps=0.04, seeds=8)


def on_waves(kind: str) -> Scene:
    """A sheet over a wavy field, which the camera sees alone."""
    scene = over_a_floor(kind)
    waves = sampled(lambda p: p[..., 2] - 0.06 * np.sin(4.0 * p[..., 0] + 1.0) * np.cos(3.0 * p[..., 1]),
                    (24, 24, 12), lower=(-2.0, -2.0, -0.5), upper=(2.0, 2.0, 0.5), material="floor")
    leaf = rectangle((0.0, 0.0, 0.9), (0.3, 0.1, 0.0), (0.0, 0.4, 0.1), "clay")
    leaf.visible_to = frozenset(["diffuse", "shadow"])
    return replace(scene, meshes={"floor": leaf}, fields={"body": waves})


@pytest.mark.parametrize("change", [values, transform, light, floor, eye])
@pytest.mark.parametrize("kind", ["point", "area"])
def test_the_shadow_of_a_mesh_on_a_field(kind: str, change: Change) -> None:
    """The edges of a sheet throw the shadow; the field that receives it moves, or stands still."""
    scene = on_waves(kind)
    check_agreement(partial(change, scene), max_depth=2, eps=0.04, seeds=8)


@pytest.mark.parametrize("kind", ["point", "area", "sun", "wide sun"])
def test_both_modes(kind: str) -> None:
    scene = over_a_floor(kind, "torus")
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world", "meshes.floor.vertices"]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=3)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=3)


def test_both_modes_between_surfaces() -> None:
    scene = between_walls(world=World(np.array([0.2, 0.3, 0.4])))
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world", "meshes.floor.vertices"]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=4)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=4)


def test_the_plan_names_what_is_computed_and_what_is_missing() -> None:
    scene = between_walls()
    said = plan(scene, ["fields.body.values"], max_depth=3)
    assert "the shadows of the distance fields body" in str(said)
    assert "what the distance fields body hide of one surface from another" in str(said)
    assert not any("distance field" in sentence and "shadow" in sentence for sentence in said.missing)
    clear = replace(scene, materials={**scene.materials, "clay": VEIL})
    assert "the shadows of the distance fields body" in str(plan(clear, ["fields.body.values"], max_depth=3))
    assert not plan(clear, ["fields.body.values"], max_depth=3).missing


@pytest.mark.parametrize("change", [values, light])
@pytest.mark.parametrize("kind", ["point", "sun", "area", "ball"])
def test_the_shadow_of_a_transparent_field(kind: str, change: Change) -> None:
    """Lines below its outline pass the surface twice."""
    scene = over_a_floor(kind, materials={"floor": matte(0.7, 0.6, 0.5), "clay": VEIL})
    check_agreement(partial(change, scene), max_depth=2, eps=0.04, seeds=8)


def test_a_transparent_field_in_an_environment() -> None:
    scene = over_a_floor("none", world=World(np.array([0.6, 0.8, 1.0])),
                         materials={"floor": matte(0.7, 0.6, 0.5), "clay": VEIL})
    check_agreement(partial(values, scene), max_depth=2, eps=0.04, seeds=8)


def test_a_transparent_field_between_surfaces() -> None:
    scene = between_walls()
    scene.materials["clay"] = VEIL
    check_agreement(partial(values, scene), max_depth=3, eps=0.1, seeds=32, spp=128, reference_spp=2048)
    paths = ["fields.body.values", "fields.body.transform", "meshes.floor.vertices"]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=4)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=4)
