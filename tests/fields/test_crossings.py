"""Curves along which distance fields pass through meshes and through each other, as the camera sees them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from edgegrad import Field, Material, PointLight, Scene, World, plan
from edgegrad.expression import Coordinates, VectorMath
from tests.support.fields.splines import Floats, exact_sphere, sampled, torus
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.small_scenes import box, camera, matte, rectangle

Change = Callable[[Scene, float], tuple[Scene, Mapping[str, Floats]]]


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def glowing(scale: float, *offset: float) -> Material:
    """A material whose emission varies with the position, so that radiance changes over both surfaces."""
    position = VectorMath("SCALE", Coordinates("POSITION"), scale=scale)
    return Material(np.zeros(3), textures={"emission": VectorMath("ADD", position, offset)})


def at(x: float, y: float, z: float, scale: float = 1.0) -> Floats:
    """The place of a field."""
    transform = np.diag([scale, scale, scale, 1.0])
    transform[:3, 3] = x, y, z
    return transform


def scene_of(fields: Mapping[str, Field], meshes: Mapping[str, Any], **others: Any) -> Scene:
    """Meshes that glow and dark fields, in a bright environment."""
    return Scene(**({
        "camera": camera((1.2, -1.9, 2.1), size=16), "fields": fields, "meshes": meshes,
        "world": World(np.array([0.2, 0.5, 1.0])),
        "materials": {"clay": matte(0.0, 0.0, 0.0), "lamp": glowing(0.2, 0.5, 1.0, 3.0)}} | others))


def lit_fields(fields: Mapping[str, Field]) -> Scene:
    """Fields that a lamp at the camera alone lights, which therefore sees no shadow."""
    lamp = PointLight(np.array([1.2, -1.9, 2.1]), power=200.0)
    return scene_of(fields, {}, world=World(np.zeros(3)), lights={"lamp": lamp},
                    materials={"clay": matte(0.9, 0.3, 0.2), "lamp": matte(0.2, 0.5, 0.9)})


def floor(z: float = 0.0) -> Any:
    return rectangle((0.1, 0.0, z), (1.3, 0.1, 0.05), (0.0, 1.2, 0.1), "lamp")


SCENES: dict[str, Callable[[], Scene]] = {
    # The second floor lies in the nodes of the grid, where edges of the carrier lie in its plane
    "sphere in a floor": lambda: scene_of({"body": exact_sphere(0.7, 20)}, {"other": floor(0.12)}),
    "torus in a flat floor": lambda: scene_of(
        {"body": sampled(torus, 29)}, {"other": rectangle((0, 0, 0), (1.3, 0, 0), (0, 1.2, 0), "lamp")}),
    "box in a torus": lambda: scene_of(
        {"body": sampled(torus, 28)}, {"other": box((0.5, 0.0, 0.0), (0.25, 0.5, 0.18), "lamp", angle=0.4)}),
    "torus in a sphere": lambda: lit_fields(
        {"body": sampled(torus, 28), "other": exact_sphere(0.6, 20, material="lamp", transform=at(0.5, 0.1, 0.1))}),
}


def values(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """Coefficients of the field change."""
    field = scene.fields["body"]
    x, y, z = (np.linspace(-1.0, 1.0, n) for n in field.values.shape)
    tangent = 0.15 + 0.1 * np.cos(2.0 * x[:, None, None] + 1.0) * np.sin(3.0 * y[None, :, None]) + 0.05 * z
    moved = replace(field, values=(field.values + theta * tangent).astype(np.float32))
    return replace(scene, fields={**scene.fields, "body": moved}), {"fields.body.values": tangent}


def transform(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The field moves, turns and stretches."""
    field, tangent = scene.fields["body"], np.zeros((4, 4))
    tangent[:3] = [[0.2, -0.5, 0.3, 0.5], [0.5, -0.1, -0.4, -0.3], [-0.3, 0.4, 0.1, 0.4]]
    moved = replace(field, transform=field.transform + theta * tangent)
    return replace(scene, fields={**scene.fields, "body": moved}), {"fields.body.transform": tangent}


def other(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The other surface moves."""
    if "other" in scene.fields:
        field, tangent = scene.fields["other"], np.zeros((4, 4))
        tangent[:3] = [[0.2, -0.5, 0.3, 0.5], [0.5, -0.1, -0.4, -0.3], [-0.3, 0.4, 0.1, 0.4]]
        moved = replace(field, transform=field.transform + theta * tangent)
        return replace(scene, fields={**scene.fields, "other": moved}), {"fields.other.transform": tangent}
    mesh = scene.meshes["other"]
    tangent = np.random.default_rng(5).normal(size=mesh.vertices.shape) * 0.3 + (0.3, -0.2, 0.5)
    return replace(scene, meshes={"other": replace(mesh, vertices=mesh.vertices + theta * tangent)}), {
        "meshes.other.vertices": tangent}


def view(scene: Scene, theta: float) -> tuple[Scene, Mapping[str, Floats]]:
    """The camera moves."""
    to_world, tangent = np.array(scene.camera.to_world, float), np.zeros((4, 4))
    tangent[:3, 3] = 1.0, 0.5, 0.4
    moved = replace(scene, camera=replace(scene.camera, to_world=to_world + theta * tangent))
    if not scene.lights:
        return moved, {"camera.to_world": tangent}
    lamp = replace(scene.lights["lamp"], position=moved.camera.to_world[:3, 3].copy())
    return replace(moved, lights={"lamp": lamp}), {"camera.to_world": tangent, "lights.lamp.position": tangent[:3, 3]}


@pytest.mark.parametrize("change", [values, transform, other, view])
@pytest.mark.parametrize("case", list(SCENES))
def test_what_glows(case: str, change: Change) -> None:
    scene = SCENES[case]()
    check_agreement(lambda theta: change(scene, theta), max_depth=2 if scene.lights else 1, eps=0.02, seeds=8)


def seen_by(kind: str) -> Any:
    if kind == "ORTHOGRAPHIC":
        return replace(camera((1.2, -1.9, 2.1), size=16), kind=kind, ortho_width=2.2)
    if kind == "EQUIRECTANGULAR":
        return replace(camera((0.7, -1.0, 1.3), size=16), kind=kind, longitude=np.array([-0.6, 0.6]),
                       latitude=np.array([-0.6, 0.6]))
    return replace(camera((1.2, -1.9, 2.1), size=16), aperture_radius=0.08, focus_distance=2.6)


@pytest.mark.parametrize("kind", ["ORTHOGRAPHIC", "EQUIRECTANGULAR"])
@pytest.mark.parametrize("change", [values, view])
def test_cameras(kind: str, change: Change) -> None:
    scene = replace(SCENES["box in a torus"](), camera=seen_by(kind))
    check_agreement(lambda theta: change(scene, theta), max_depth=1, eps=0.02, seeds=8)


def test_two_copies_of_a_mesh() -> None:
    """Both copies pass through the field, one of them mirrored."""
    mesh = box((0.0, 0.0, 0.0), (0.25, 0.5, 0.18), "lamp", angle=0.4)
    copies = np.stack([at(0.5, 0.0, 0.05), at(-0.4, -0.3, 0.0) @ np.diag([-1.0, 1.0, 1.0, 1.0])])
    scene = scene_of({"body": sampled(torus, 28)}, {"other": replace(mesh, instances=copies)})
    check_agreement(lambda theta: values(scene, theta), max_depth=1, eps=0.02, seeds=8)

    def moved(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        tangent = np.zeros((2, 4, 4))
        tangent[0, :3] = [[0.2, -0.5, 0.3, 0.5], [0.5, -0.1, -0.4, -0.3], [-0.3, 0.4, 0.1, 0.4]]
        tangent[1, :3, 3] = 0.3, 0.5, -0.4
        placed = replace(mesh, instances=copies + theta * tangent)
        return replace(scene, meshes={"other": placed}), {"meshes.other.instances": tangent}

    check_agreement(moved, max_depth=1, eps=0.02, seeds=8)


@pytest.mark.parametrize("case", ["box in a torus", "torus in a sphere"])
def test_both_modes(case: str) -> None:
    scene = SCENES[case]()
    moved = "meshes.other.vertices" if "other" in scene.meshes else "fields.other.transform"
    paths = ["fields.body.values", "fields.body.transform", "camera.to_world", moved]
    check_transpose(lambda _: scene, paths, spp=8, max_depth=3)
    check_equal_bits(lambda _: scene, paths, spp=4, max_depth=3)


def test_the_plan_names_the_curves() -> None:
    scene = SCENES["box in a torus"]()
    said = "where 'other' and 'body' pass through each other"
    assert said in str(plan(scene, ["fields.body.values"], max_depth=1))
    assert not any("body" in sentence for sentence in plan(scene, ["fields.body.values"], max_depth=1).missing)
    scene.meshes["other"].vertices = scene.meshes["other"].vertices + np.array([5.0, 0.0, 0.0])
    assert "pass through each other" not in str(plan(scene, ["fields.body.values"], max_depth=1))


def test_borders_of_boxes_are_named() -> None:
    """The surface of the second field reaches its box."""
    for radius, ends in ((0.7, False), (1.1, True)):
        scene = scene_of({"body": exact_sphere(radius, 20)}, {})
        said = plan(scene, ["fields.body.values"], max_depth=1).missing
        assert any("end at their boxes" in sentence for sentence in said) == ends


WHITE = matte(0.8, 0.7, 0.6)


def before_a_screen(fields: Mapping[str, Field], meshes: Mapping[str, Any], glow: float) -> Scene:
    """The camera sees a screen alone, which light from a field and what passes through it reaches."""
    unseen = frozenset(["diffuse", "glossy", "transmission", "shadow"])
    screen = rectangle((0.0, 0.0, -1.6), (1.6, 0.0, 0.0), (0.0, 1.6, 0.0), "screen")
    lamp = Material(np.full(3, 0.6), np.full(3, glow))
    return Scene(
        camera=replace(camera((0.0, 0.0, 2.0), size=16), kind="ORTHOGRAPHIC", ortho_width=2.4),
        meshes={"screen": screen, **{name: replace(mesh, visible_to=unseen) for name, mesh in meshes.items()}},
        fields={name: replace(field, visible_to=unseen) for name, field in fields.items()},
        materials={"screen": WHITE, "clay": matte(0.1, 0.5, 0.9), "lamp": lamp}, world=World(np.zeros(3)),
        lights={} if glow else {"lamp": PointLight(np.array([0.9, 0.7, -0.9]), power=60.0)})


@pytest.mark.parametrize("change", [values, transform, other])
def test_fields_in_emissive_meshes(change: Change) -> None:
    """A field hides a part of a sheet that lights a screen."""
    sheet = rectangle((0.0, 0.0, 0.1), (1.1, 0.1, 0.2), (0.0, 1.0, 0.1), "lamp")
    scene = before_a_screen({"body": exact_sphere(0.6, 20)}, {"other": sheet}, 3.0)
    said = str(plan(scene, ["fields.body.values"], max_depth=2))
    assert "hide of each other's light" in said

    def moved(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        shown, tangent = change(replace(scene, meshes={"other": scene.meshes["other"]}), theta)
        return replace(shown, meshes={**scene.meshes, **shown.meshes}), tangent

    check_agreement(moved, max_depth=2, eps=0.02, seeds=8)


@pytest.mark.parametrize("change", [values, other])
@pytest.mark.parametrize("kind", ["sheet", "field"])
def test_light_of_surfaces_that_fields_pass_through(kind: str, change: Change) -> None:
    """A lamp below a field and what passes through it: their light reaches the screen."""
    # A cap of the field is below the sheet, so that the lamp lights the sheet up to the curve
    sheet = rectangle((0.0, 0.0, -0.4), (1.1, 0.1, 0.2), (0.0, 1.0, 0.1), "lamp")
    ball = exact_sphere(0.6, 20, material="lamp", transform=at(0.45, 0.1, 0.0))
    scene = before_a_screen({"body": exact_sphere(0.6, 20), **({"other": ball} if kind == "field" else {})},
                            {"other": sheet} if kind == "sheet" else {}, 0.0)
    if kind == "sheet":
        scene.materials["clay"] = matte(0.0, 0.0, 0.0)  # so that the light of the sheet alone changes
    assert "the curves where" in str(plan(scene, ["fields.body.values"], max_depth=3))

    def moved(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        meshes = {name: mesh for name, mesh in scene.meshes.items() if name == "other"}
        shown, tangent = change(replace(scene, meshes=meshes), theta)
        return replace(shown, meshes={**scene.meshes, **shown.meshes}), tangent

    check_agreement(moved, max_depth=3, eps=0.02, seeds=8)
