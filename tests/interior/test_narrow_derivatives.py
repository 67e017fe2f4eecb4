"""Derivatives of tables for engines that render flat, diffuse scenes only."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from edgegrad import AreaLight, Material, Mesh, PointLight, Scene, SunLight, World
from edgegrad.derivatives.table_derivatives import ParameterMap, shapes, with_requested
from edgegrad.reference import diffuse_tables
from edgegrad.scene import parameters
from edgegrad.tables import tables
from tests.support import shapes as solids

WRT = [
    "meshes.b.vertices", "materials.clay.base_color", "materials.lamp.emission", "lights.second sun.strength",
    "lights.point.color", "lights.disk.power", "world.color",
]  # fmt: skip


def plain() -> Scene:
    """A flat, diffuse scene with every kind of light."""
    pose = np.eye(4)
    pose[:3, 3] = [0.0, 0.0, 3.0]
    vertices, faces = solids.cube()
    return Scene(
        solids.camera(),
        {"a": Mesh(vertices, faces, ("clay", "lamp"), np.repeat(np.array([0, 1], np.int32), 6)),
         "b": Mesh(vertices + 3.0, faces, ("clay",))},
        {"clay": Material(np.array([0.6, 0.5, 0.4])), "lamp": Material(emission=np.array([1.0, 2.0, 3.0]))},
        {
            "sun": SunLight(np.array([0.0, 1.0, -1.0]), 2.0, color=np.array([0.9, 0.8, 0.7])),
            "point": PointLight(np.array([2.0, -3.0, 4.0]), 60.0, color=np.array([0.5, 0.8, 0.7])),
            "area": AreaLight(pose, np.array([1.0, 2.0]), "RECTANGLE", 50.0, color=np.array([0.5, 0.6, 0.7])),
            "disk": AreaLight(pose, np.array([1.0, 1.0]), "ELLIPSE", 40.0, color=np.array([0.1, 0.6, 0.7])),
            "second sun": SunLight(np.array([1.0, 1.0, -1.0]), 3.0),
        },
        World(np.array([0.1, 0.2, 0.3]), 0.5),
    )


@pytest.mark.parametrize("path", WRT)
def test_tangents_are_the_differences_of_the_narrow_tables(path: str) -> None:
    """Every narrow table is linear in these: a difference is exact up to float32."""
    scene = plain()
    flat = tables.flatten(scene)
    value = np.asarray(parameters.get(scene, path), np.float64)
    direction = np.random.default_rng(1).uniform(0.1, 0.3, value.shape)
    tangent = diffuse_tables.narrowed(flat, ParameterMap(scene, flat, [path]).push_forward({path: direction}))
    parameters.put(scene, path, value + direction)
    before, after = (diffuse_tables.narrow_values(t) for t in (flat, tables.flatten(scene, flat.origin)))
    for f in fields(tangent):
        difference = after[f.name].astype(np.float64) - before[f.name]
        rounding = 2e-6 * np.abs(before[f.name]).max(initial=0.0)
        np.testing.assert_allclose(getattr(tangent, f.name), difference, atol=rounding)
    assert any(np.abs(getattr(tangent, f.name)).max(initial=0.0) > 1e-3 for f in fields(tangent))


def test_widening_is_the_transpose_of_narrowing() -> None:
    scene = plain()
    flat = tables.flatten(scene)
    rng = np.random.default_rng(2)
    wanted = ParameterMap(scene, flat, WRT).requested
    tangent = {name: rng.normal(size=shapes(flat)[name]) for name in wanted}
    part = diffuse_tables.narrowed(flat, tangent)
    values = diffuse_tables.narrow_values(flat)
    gradient = diffuse_tables.Derivative(**{name: rng.normal(size=value.shape) for name, value in values.items()})
    wide = diffuse_tables.widened(flat, gradient, wanted)
    assert set(wide) == set(wanted)
    forward = sum(float(np.vdot(getattr(part, f.name), getattr(gradient, f.name))) for f in fields(part))
    assert forward == pytest.approx(sum(float(np.vdot(wide[name], tangent[name])) for name in wide), rel=1e-12)


def test_what_is_asked_for() -> None:
    scene = plain()
    flat = tables.flatten(scene)

    def asked(*wrt: str) -> diffuse_tables.Asked:
        made = with_requested(scene, flat, wrt)
        return diffuse_tables.asked(made, ParameterMap(scene, made, wrt).requested)

    moving = asked("meshes.b.vertices")
    assert moving.moving.tolist() == [0, 1, 0, 0] and not moving.emitting.any()
    assert not (moving.colors or moving.lights or moving.environment)
    color = asked("materials.clay.base_color")
    assert color.colors and not color.emitting.any() and not color.moving.any()
    assert asked("materials.clay.emission").emitting.tolist() == [1, 0, 0, 0]  # though it is 0
    assert asked("lights.disk.color").emitting.tolist() == [0, 0, 0, 1] and not asked("lights.disk.color").lights
    assert asked("lights.second sun.strength").lights
    assert asked("world.strength").environment


def test_other_parameters_are_refused() -> None:
    with pytest.raises(ValueError, match=r"'camera\.fov_x' has no derivative in this version"):
        diffuse_tables.check(["world.color", "camera.fov_x"])
