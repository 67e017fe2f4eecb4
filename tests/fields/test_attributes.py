"""Attributes of fields: values on grids over their boxes, in pictures and in derivatives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Field, Material, Renderer, Scene, SunLight, World
from edgegrad.distance_fields import to_mesh
from edgegrad.expression import (
    Attribute,
    Bump,
    Channel,
    Combine,
    Coordinates,
    Expression,
    Operand,
    Transform,
    VectorMath,
)
from tests.support.fields.splines import Floats, sampled
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose
from tests.support.small_scenes import camera, matte, need, rectangle

# A field that is turned, sheared and moved, over a box whose cells are no cubes.
PLACE = np.array([[0.9, -0.3, 0.1, 0.2], [0.4, 0.8, 0.0, -0.1], [0.0, 0.2, 1.1, 0.1], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(autouse=True)
def _native() -> None:
    need("native")


def grid_places(size: tuple[int, int, int], lower: Floats, upper: Floats) -> Floats:
    """(ax, ay, az, 3) places of a grid's values in the field's own space."""
    axes = [np.linspace(a, b, n) for n, a, b in zip(size, lower, upper, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def own_place() -> Expression:
    """The hit point in the space of a field with the transform PLACE."""
    return Transform(Coordinates("POSITION"), tuple(map(tuple, np.linalg.inv(PLACE)[:3].tolist())))


def egg(**others: Any) -> Field:
    """A stretched ball with values that are linear in its own space: 0.25 of the place, + 0.5."""
    field = sampled(lambda p: np.linalg.norm(p / [0.8, 0.6, 0.7], axis=-1) - 1.0, (20, 16, 24), (-1, -0.8, -0.9),
                    (1, 0.8, 1), **({"transform": PLACE} | others))
    places = 0.5 + 0.25 * grid_places((3, 2, 5), field.lower, field.upper)
    return replace(field, attributes={"place": places, "x": places[..., :1]} | field.attributes)


def shown(field: Field, color: Operand, other: Operand, **others: Any) -> Scene:
    """A field of a textured metal in front of a floor, under a sun and an even environment."""
    values: dict[str, Operand] = {"base_color": color, "roughness": other, "metallic": other}
    textures = {key: value for key, value in values.items() if isinstance(value, Expression)}
    constants: dict[str, Any] = {key: np.asarray(value) if isinstance(value, tuple) else value
                                 for key, value in values.items() if key not in textures}
    rough = Material(textures=textures, specular_ior_level=0.5, **constants)
    floor = rectangle((0, 0, -1.5), (2, 0, 0), (0, 2, 0), "floor")
    return Scene(**({"camera": camera(size=24), "meshes": {"floor": floor},
                     "materials": {"clay": rough, "floor": matte(0.5, 0.4, 0.3)}, "fields": {"egg": field},
                     "lights": {"sun": SunLight(np.array([0.3, -0.5, -1.0]), strength=1.0, angle=0.2)},
                     "world": World(np.array([0.2, 0.3, 0.4]))} | others))


def test_linear_grids_are_expressions_of_the_position() -> None:
    """Colour, roughness and metallic, directly seen and behind bounces, beside a mesh without the attribute."""
    place = VectorMath("ADD", VectorMath("SCALE", own_place(), scale=0.25), (0.5, 0.5, 0.5))
    found = edgegrad.render(shown(egg(), Attribute("place"), Attribute("x")), spp=16, max_depth=4)
    wanted = edgegrad.render(shown(egg(), place, Channel(place, 0)), spp=16, max_depth=4)
    # Roundings decide some directions of paths, for which single samples differ.
    assert np.median(np.abs(found - wanted)) < 1e-6
    assert np.linalg.norm(found - wanted) < 1e-3 * np.linalg.norm(wanted)


@pytest.mark.parametrize("is_position", [True, False])
@pytest.mark.parametrize("back", [False, True])
def test_bumps_of_linear_grids_are_those_of_positions(back: bool, is_position: bool) -> None:
    """Attributes that are no positions sink on the back where they rise on the front, as those of meshes do."""
    place = VectorMath("ADD", VectorMath("SCALE", own_place(), scale=0.25), (0.5, 0.5, 0.5))
    field = replace(egg(), values=-egg().values) if back else egg()
    flat = shown(field, (0.5, 0.5, 0.5), 0.5)
    pictures = [edgegrad.render(flat, spp=16, max_depth=2)]
    for height, invert in ((Attribute("x", is_position=is_position), False),
                           (Channel(place, 0), back and not is_position)):
        material = Material(textures={"normal": Bump(height, distance=0.5, step=0.01, invert=invert)},
                            normal_space="WORLD", roughness=0.5, metallic=0.5, specular_ior_level=0.5)
        scene = replace(flat, materials={**flat.materials, "clay": material})
        pictures.append(edgegrad.render(scene, spp=16, max_depth=2))
    assert np.linalg.norm(pictures[1] - pictures[2]) < 0.02 * np.linalg.norm(pictures[2] - pictures[0])


def test_numbers_of_components() -> None:
    """One value is a grey, two are (u, v, 0), and alpha is the fourth: as for meshes."""
    one, two, four = np.full((1, 1, 1, 1), 0.3), np.full((2, 1, 1, 2), [0.2, 0.6]), np.full((1, 2, 1, 4), 0.1)
    field = replace(egg(), attributes={"one": one, "two": two, "four": four})
    alpha = Channel(Attribute("four"), 3)
    for value, color in ((Attribute("one"), (0.3, 0.3, 0.3)), (Attribute("two"), (0.2, 0.6, 0.0)),
                         (Combine(alpha, alpha, Attribute("none", required=False)), (0.1, 0.1, 0.0))):
        found = edgegrad.render(shown(field, value, 0.5), spp=4, max_depth=3)
        assert np.allclose(found, edgegrad.render(shown(field, color, 0.5), spp=4, max_depth=3), rtol=1e-4, atol=1e-6)


def test_meshes_of_fields_look_the_same() -> None:
    rng = np.random.default_rng(3)
    field = replace(egg(), attributes={"paint": rng.uniform(0.1, 0.9, (6, 5, 4, 3)),
                                       "x": rng.uniform(size=(3, 3, 3, 1))})
    scene = shown(field, Attribute("paint"), Attribute("x"))
    found = edgegrad.render(scene, spp=256, max_depth=3)
    mesh = to_mesh(field, finer=2)
    assert mesh.attributes.keys() == {"paint", "x"}
    wanted = edgegrad.render(replace(scene, fields={}, meshes={**scene.meshes, "egg": mesh}), spp=256, max_depth=3)
    assert np.linalg.norm(found - wanted) < 0.02 * np.linalg.norm(wanted)


def test_updates() -> None:
    """A renderer that takes changed grids over shows what a new one shows."""
    scene = shown(egg(), Attribute("place"), Attribute("x"))
    renderer = Renderer(scene)
    renderer.render(spp=4)
    for paths in (["fields.egg.attributes.place"], ["fields.egg.values", "fields.egg.attributes.x"], None):
        for path in ("fields.egg.attributes.place", "fields.egg.values", "fields.egg.attributes.x"):
            if paths is None or path in paths:
                edgegrad.parameters.put(scene, path, 0.9 * edgegrad.parameters.get(scene, path))
        renderer.update(paths)
        assert np.array_equal(renderer.render(spp=4), edgegrad.render(scene, spp=4))


# ---------------------------------------------------------------- derivatives
def waves(**others: Any) -> Field:
    """A wavy plane that fills the picture and hides nothing of itself, with values that vary over each cell."""
    rng = np.random.default_rng(5)
    lower, upper = (-2.0, -2.0, -0.5), (2.0, 2.0, 0.5)
    grids = {"paint": rng.uniform(0.2, 0.8, (7, 6, 3, 3)), "x": rng.uniform(0.3, 0.7, (5, 7, 2, 1))}
    return sampled(lambda p: p[..., 2] - 0.06 * np.sin(4.0 * p[..., 0] + 1.0) * np.cos(3.0 * p[..., 1]),
                   (24, 24, 12), lower, upper, **({"attributes": grids} | others))


def over_waves(path: str, theta: float, tangent: Floats, **others: Any) -> tuple[Scene, Mapping[str, Floats]]:
    scene = shown(waves(), Attribute("paint"), Attribute("x"),
                  **({"camera": camera((0.2, 0.3, 3.0), size=16), "meshes": {}, "fields": {"waves": waves()}} | others))
    edgegrad.parameters.put(scene, path, edgegrad.parameters.get(scene, path) + theta * tangent)
    return scene, {path: tangent}


def tangent_of(path: str) -> Floats:
    shape = np.shape(edgegrad.parameters.get(over_waves("world.color", 0.0, np.zeros(3))[0], path))
    if path == "camera.to_world":
        out = np.zeros((4, 4))
        out[:3, 3] = [0.5, 0.3, 0.2]
        return out
    if path.endswith("transform"):
        return np.array([[0.1, 0.2, 0.0, 0.4], [-0.2, 0.1, 0.1, 0.2], [0.0, 0.1, 0.1, 0.1], [0.0, 0.0, 0.0, 0.0]])
    return np.random.default_rng(8).normal(size=shape)


@pytest.mark.parametrize("depth", [2, 3])
@pytest.mark.parametrize(
    ("path", "step"),
    [("fields.waves.attributes.paint", 0.02), ("fields.waves.attributes.x", 0.02), ("fields.waves.values", 2e-3),
     ("fields.waves.transform", 0.01), ("fields.waves.lower", 0.01), ("camera.to_world", 0.01)])
def test_derivatives(path: str, step: float, depth: int) -> None:
    """By the values of grids, and by all that moves the surface through its grids."""
    others = {"world": World(np.zeros(3))}

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        return over_waves(path, theta, tangent_of(path) if path != "fields.waves.lower" else np.array([0.2, 0.1, 0.0]),
                          **others)

    check_agreement(at, max_depth=depth, eps=step, seeds=8)


@pytest.mark.parametrize("path", [f"fields.waves.{name}" for name in ("attributes.paint", "attributes.x", "transform")])
def test_modes_agree_and_repeat(path: str) -> None:
    def scene(_: float = 0.0) -> Scene:
        return over_waves(path, 0.0, tangent_of(path), materials={
            "clay": Material(textures={"base_color": Attribute("paint"), "roughness": Attribute("x"),
                                       "metallic": Attribute("x")})})[0]

    check_transpose(scene, [path], spp=8, max_depth=3)
    check_equal_bits(scene, [path], spp=4, max_depth=3)


def test_grids_that_no_texture_reads_have_no_derivative() -> None:
    scene = shown(replace(egg(), attributes={"place": np.ones((2, 2, 2, 3)), "other": np.ones((3, 2, 2, 1))}),
                  Attribute("place"), 0.5)
    found = edgegrad.render_backward(scene, np.ones((24, 24, 3)), ["fields.egg.attributes.other"], spp=4)
    assert not found["fields.egg.attributes.other"].any()
    scene.materials = {**scene.materials, "clay": matte(0.5, 0.5, 0.5)}
    found = edgegrad.render_backward(scene, np.ones((24, 24, 3)), ["fields.egg.attributes.other"], spp=4)
    assert not found["fields.egg.attributes.other"].any()
