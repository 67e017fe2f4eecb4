"""Derivatives by a distance field itself: by its coefficients and its place, where no outline moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import edgegrad
from edgegrad import Material, Mesh, PointLight, Scene, World
from edgegrad.scene import parameters
from tests.support.fields.splines import Floats, points, sampled, torus
from tests.support.picture_differences import check_agreement, check_equal_bits, check_transpose, need_every_table
from tests.support.small_scenes import camera, matte, rectangle


@pytest.fixture(autouse=True)
def _native() -> None:
    need_every_table()


MATERIALS = {
    "matte": matte(0.7, 0.6, 0.5),
    "conductor": Material(np.array([0.9, 0.8, 0.7]), kind="PRINCIPLED", metallic=1.0, roughness=0.4),
    "glossy": Material(np.array([0.6, 0.5, 0.7]), kind="PRINCIPLED", roughness=0.5),
    "mirror": Material(np.ones(3), kind="GLOSSY", roughness=0.0),
    "glass": Material(np.array([0.9, 0.95, 1.0]), kind="REFRACTION", roughness=0.0, ior=1.3),
}


def sky() -> edgegrad.Image:
    """A smooth environment."""
    v, u = np.meshgrid(np.linspace(0, np.pi, 64), np.linspace(0, 2 * np.pi, 128), indexing="ij")
    pixels = np.stack([1.0 + 0.5 * np.sin(v) * np.cos(u), 1.0 + 0.5 * np.sin(v) * np.sin(u), 1.0 + 0.5 * np.cos(v)],
                      axis=-1)
    return edgegrad.Image(pixels.astype(np.float32))


def bowl(kind: str, lit: str) -> Scene:
    """A shallow bowl that fills the picture, seen and lit from its hollow side: no outline moves in the picture.

    Its border is an outline in the light that it scatters onto itself and in rough reflections of the sky.
    """
    field = sampled(lambda p: p[..., 2] - 0.15 * (p[..., 0] ** 2 + 0.7 * p[..., 1] ** 2) - 0.1 * p[..., 0],
                    (24, 24, 16), lower=(-2.5, -2.5, -1.0), upper=(2.5, 2.5, 2.0))
    lights = {"lamp": PointLight(np.array([0.5, 0.4, 2.2]), power=100.0)} if lit == "point" else {}
    world, images = World(np.zeros(3)), {}
    if lit == "sky":
        images, world = {"sky": sky()}, World(np.ones(3), image="sky")
    meshes = {}
    materials = {"clay": MATERIALS[kind]}
    if lit == "lamp":
        meshes["sheet"] = rectangle((0.3, 0.2, 2.6), (0.6, 0.1, 0.0), (0.0, 0.5, 0.1), "glow")
        materials["glow"] = Material(np.zeros(3), np.array([6.0, 5.0, 4.0]))
    return Scene(camera((0.2, -0.3, 2.4), (0.2, -0.3, 0.0), 16), meshes, materials, lights, world, images,
                 fields={"bowl": field})


def room(kind: str) -> Scene:
    """A round room around the camera and a lamp: it is convex and closed, so that nothing hides or ends in it."""
    field = sampled(lambda p: 0.8 - np.sum(p**2, axis=-1), 24, lower=(-1.2, -1.2, -1.2), upper=(1.2, 1.2, 1.2))
    return Scene(camera((0.2, -0.3, 0.4), (0.0, 0.1, -0.6), 16), {}, {"clay": MATERIALS[kind]},
                 {"lamp": PointLight(np.array([0.1, 0.2, 0.3]), power=40.0)}, World(np.zeros(3)),
                 fields={"bowl": field})


def direction_of(scene: Scene, what: str) -> Floats:
    """A tangent of the field's parameter."""
    field = scene.fields["bowl"]
    if what == "values":  # smooth, so that the bowl stays free of bumps that hide each other
        x, y, z = (np.linspace(-1.0, 1.0, n) for n in field.values.shape)
        return np.asarray(0.3 + 0.4 * np.cos(2.0 * x[:, None, None] + 1.0) * np.sin(2.0 * y[None, :, None])
                          + 0.2 * z[None, None, :])
    if what in ("lower", "upper"):
        return np.array([0.3, -0.2, 0.25])
    out = np.zeros((4, 4))
    if what == "translation":
        out[:3, 3] = 0.5, -0.3, 0.7
    elif what == "rotation":
        out[:3, :3] = np.array([[0.0, -0.5, 0.3], [0.5, 0.0, -0.4], [-0.3, 0.4, 0.0]])
    else:
        out[:3, :3] = np.diag([0.4, -0.3, 0.6])
    return out


def moving(kind: str, lit: str, what: str) -> Any:
    """The bowl as a function of one number."""
    path = f"fields.bowl.{what if what in ('values', 'lower', 'upper') else 'transform'}"

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        scene = room(kind) if lit == "room" else bowl(kind, lit)
        tangent = direction_of(scene, what)
        parameters.put(scene, path, np.asarray(parameters.get(scene, path), float) + theta * tangent)
        return scene, {path: tangent}

    return at


@pytest.mark.parametrize("what", ["values", "translation", "rotation", "scale", "lower", "upper"])
def test_every_parameter(what: str) -> None:
    at = moving("matte", "point", what)
    check_agreement(at, max_depth=2, eps=0.04, seeds=8)


@pytest.mark.parametrize(("kind", "lit"), [("conductor", "point"), ("glossy", "point"), ("mirror", "sky"),
                                           ("glass", "sky")])
@pytest.mark.parametrize("what", ["values", "rotation"])
def test_materials(kind: str, lit: str, what: str) -> None:
    check_agreement(moving(kind, lit, what), max_depth=2, eps=0.04, seeds=8)


@pytest.mark.parametrize(("kind", "depth"), [("matte", 3), ("matte", 4), ("conductor", 3), ("glossy", 4)])
@pytest.mark.parametrize("what", ["values", "translation", "scale"])
def test_depths(kind: str, depth: int, what: str) -> None:
    """Later vertices of paths keep their places on the surface as it moves along its normals."""
    check_agreement(moving(kind, "room", what), max_depth=depth, eps=0.04, seeds=8)


def test_one_coefficient() -> None:
    """A step that moves the surface by less than 0.02 cells: its dent hides nothing."""
    field = room("matte").fields["bowl"]
    nearest = np.unravel_index(np.argmin(np.sum((points(field.values.shape, field.lower, field.upper)
                                                 - np.array([0.0, 0.1, -0.88])) ** 2, axis=-1)), field.values.shape)
    tangent = np.zeros(field.values.shape)
    tangent[nearest] = 1.0

    def at(theta: float) -> tuple[Scene, Mapping[str, Floats]]:
        scene = room("matte")
        moved = scene.fields["bowl"]
        moved.values = (moved.values + theta * tangent).astype(np.float32)
        return scene, {"fields.bowl.values": tangent}

    check_agreement(at, max_depth=2, eps=0.01, seeds=8)


def test_a_mesh_of_the_same_room() -> None:
    """A translation moves a field as it moves the finely triangulated mesh of its surface."""
    scene, count = room("matte"), 200
    spacing = 2.4 / 21  # the spline of the samples of x^2 is x^2 + spacing^2 / 3
    v, u = np.meshgrid(np.linspace(0, np.pi, count + 2)[1:-1], np.linspace(0, 2 * np.pi, 2 * count, endpoint=False),
                       indexing="ij")
    # The poles, which are left open, are not in the picture
    sphere = np.stack([np.cos(v), np.sin(v) * np.cos(u), np.sin(v) * np.sin(u)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(count - 1), np.arange(2 * count), indexing="ij")
    corner = [(i + a) * 2 * count + (j + b) % (2 * count) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = np.stack([corner[k] for k in (0, 1, 2, 0, 2, 3)], axis=-1).reshape(-1, 3).astype(np.int32)
    mesh = Mesh(sphere * np.sqrt(0.8 - spacing**2), faces, ("clay",), smoothing=faces)
    meshed = replace(scene, fields={}, meshes={"bowl": mesh})
    tangent = direction_of(scene, "translation")
    options: dict[str, Any] = {"spp": 16, "max_depth": 2}
    found = edgegrad.render_forward(scene, {"fields.bowl.transform": tangent}, **options)
    motion = np.tile(tangent[:3, 3], (len(sphere), 1))
    wanted = edgegrad.render_forward(meshed, {"meshes.bowl.vertices": motion}, **options)
    assert np.linalg.norm(found - wanted) < 1e-3 * np.linalg.norm(wanted)


@pytest.mark.parametrize("kind", list(MATERIALS))
def test_both_modes(kind: str) -> None:
    paths = ["fields.bowl.values", "fields.bowl.transform"]
    lit = "sky" if kind in ("mirror", "glass") else "lamp"  # a mirror shows the lamp with one brightness
    for depth in (2, 4):
        check_transpose(lambda _: bowl(kind, lit), paths, spp=8, max_depth=depth)
    check_equal_bits(lambda _: bowl(kind, lit), [*paths, "fields.bowl.lower"], spp=2, max_depth=4)


def of_scale(factor: float) -> Scene:
    """A torus over a floor, with its values times `factor`, but for one that is far from its surface.

    The renderer sees values relative to the largest one.
    """
    field = sampled(torus, (20, 18, 16))
    values = (factor * field.values).astype(np.float32)
    values[0, 0, 0] = 2.0
    light = edgegrad.AreaLight(to_world=np.array([[1, 0, 0, 0.5], [0, 0, 1, 3.0], [0, -1, 0, 0.5], [0, 0, 0, 1.0]]),
                               size=np.array([0.8, 0.8]), power=60.0)  # fmt: skip
    floor = rectangle((0, -0.9, 0), (0, 0, 2), (2, 0, 0), "clay")
    return Scene(camera((0.5, 1.5, 3.0), (0, 0, 0), 16), {"floor": floor}, {"clay": matte(0.6, 0.5, 0.4)},
                 {"lamp": light}, World(np.full(3, 0.3)), fields={"body": replace(field, values=values)})  # fmt: skip


@pytest.mark.parametrize("exponent", [-30, -50])
@pytest.mark.parametrize("edges", ["outlines", "reparameterised", "relaxed"])
def test_values_may_have_any_scale(edges: str, exponent: int) -> None:
    """For powers of two, floats differ by their exponents alone, and results have the same bits."""
    options = {"spp": 8, "max_depth": 3, "seed": 3}
    factor = 2.0**exponent
    shift = np.zeros((4, 4))
    shift[:3, 3] = 1.0, 0.3, 0.2
    change = np.random.default_rng(0).normal(size=(20, 18, 16))
    results = []
    for k in (1.0, factor):
        renderer = edgegrad.Renderer(of_scale(k))
        results.append([
            renderer.render(**options),
            renderer.render_forward({"fields.body.transform": shift}, field_edges=edges, **options),
            renderer.render_forward({"fields.body.values": k * change}, field_edges=edges, **options),
        ])  # fmt: skip
    for name, one, other in zip(("picture", "shift", "values"), *results, strict=True):
        assert np.any(one), name
        np.testing.assert_array_equal(one, other, err_msg=name)
