"""What derivatives lack where lights meet distance fields, mirrors and glass is named where it exists and moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from edgegrad import AreaLight, Material, PointLight, Scene, World, plan
from edgegrad.expression import Coordinates, VectorMath
from tests.support.fields.in_mirrors import optical, shown_by
from tests.support.fields.splines import exact_sphere
from tests.support.picture_differences import need_every_table
from tests.support.small_scenes import camera, matte, rectangle

BODY, POSE, LAMP = "fields.body.values", "camera.to_world", "lights.lamp.to_world"


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


def missing(scene: Scene, *wrt: str) -> str:
    return " ".join(plan(scene, wrt, max_depth=4).missing)


def computed(scene: Scene, *wrt: str) -> str:
    return " ".join(why for term in plan(scene, wrt, max_depth=4).terms for why in term.why)


def lamp(*position: float) -> AreaLight:
    at = np.eye(4)
    at[:3, 3] = position
    return AreaLight(at, power=100.0, size=np.array([0.8, 0.5]))


@pytest.mark.parametrize("material", ["mirror", "glass"])
def test_outlines_of_lights_that_fields_show(material: str) -> None:
    scene = optical(material)
    scene.lights = {"lamp": lamp(0.5, 1.5, 3.0)}
    said = "the outlines of lamp that the camera sees by mirrors and smooth glass"
    for path in (BODY, "fields.body.transform", POSE, LAMP, "lights.lamp.size"):
        assert said in computed(scene, path), path
    for path in ("lights.lamp.power", "meshes.card.vertices", "materials.warm.base_color"):
        assert said not in computed(scene, path), path
    scene.lights["lamp"].visible_to = frozenset(["camera", "diffuse", "shadow"])
    assert said not in computed(scene, BODY)


def test_a_still_mirror_shows_still_lights() -> None:
    """Fields that move before the lights are outlines of their own."""
    scene = shown_by("flat mirror")
    scene.lights = {"lamp": lamp(0.5, 1.5, 4.0)}
    said = "the outlines of lamp"
    assert said not in computed(scene, BODY)
    assert said not in computed(scene, "meshes.sheet.vertices")
    for path in ("meshes.mirror.vertices", POSE, LAMP):
        assert said in computed(scene, BODY, path)


@pytest.mark.parametrize("material", ["mirror", "glass"])
def test_surfaces_through_lights_that_fields_show(material: str) -> None:
    scene = optical(material)
    scene.lights = {"lamp": lamp(0.5, 1.5, 3.0)}
    said = "the lines where card pass through the light 'lamp', in mirrors"
    assert said not in missing(scene, LAMP)
    scene.meshes["card"] = rectangle((0.5, 1.5, 3.0), (0.1, 0.0, 0.1), (0.0, 0.2, 0.0), "warm")
    assert said in missing(scene, LAMP)


def with_light(light: Any) -> Scene:
    """A ball over a floor, and a light. The box of the ball reaches from -1 to 1."""
    floor = rectangle((0, 0, -2), (2, 0, 0), (0, 2, 0), "clay")
    return Scene(camera((0, 0, 4.5), (0, 0, 0), 16, 0.5), {"floor": floor}, {"clay": matte(0.5, 0.5, 0.5)},
                 fields={"body": exact_sphere(0.6, 20)}, lights={"lamp": light}, world=World(np.zeros(3)))


@pytest.mark.parametrize(("light", "still"), [
    (lamp(0.7, 0.0, 0.1), ("meshes.floor.vertices", "lights.lamp.power", "materials.clay.base_color")),
    # The part of a sphere or of a disk that a point sees turns with the point
    (PointLight(np.array([0.7, 0.0, 0.1]), radius=0.3, sphere=True), ("lights.lamp.power",)),
    (PointLight(np.array([0.7, 0.0, 0.1]), radius=0.3, sphere=False), ("lights.lamp.power",))])
def test_lights_that_fields_pass_through(light: Any, still: Sequence[str]) -> None:
    scene = with_light(light)
    said = "the curves where the light 'lamp' passes through the distance fields body"
    moved = LAMP if isinstance(light, AreaLight) else "lights.lamp.position"
    for path in (BODY, "fields.body.transform", POSE, moved):
        assert said in missing(scene, path), path
    for path in still:
        assert said not in missing(scene, path), path


@pytest.mark.parametrize("light", [
    lamp(0.0, 0.0, 0.75), PointLight(np.array([0.8, 0.8, 0.0]), radius=0.3), PointLight(np.zeros(3), radius=0.3),
    lamp(0.0, 0.0, 3.0)])
def test_lights_beside_fields(light: Any) -> None:
    """They are in the field's box or outside of it, or in its inside, but do not meet its surface."""
    assert "passes through" not in missing(with_light(light), BODY, POSE)


def test_normals_that_turn_away_are_named() -> None:
    """Where normals turn away from the viewer, below the surface, gloss of any roughness ends with a jump."""
    tilted = VectorMath("NORMALIZE", VectorMath("ADD", Coordinates("NORMAL"), (0.3, 0.2, 0.9)))
    said = "the borders where normals of {} begin to point"
    for material in ("glass", "mirror"):
        scene = optical(material)
        assert said.format(material) not in missing(scene, BODY)
        scene.materials[material].textures = {"normal": tilted}
        scene.materials[material].normal_space = "WORLD"
        assert said.format(material) in missing(scene, BODY)
    scene = optical("glass")
    scene.materials["glass"] = Material(np.ones(3), kind="DIFFUSE", textures={"normal": tilted}, normal_space="WORLD")
    assert said.format("glass") not in missing(scene, BODY)
