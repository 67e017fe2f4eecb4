"""Derivatives of tables by parameters: against differences of `flatten`, and each mode against the other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import Material, Medium, Mixture, Scene
from edgegrad.derivatives.complex_step import jacobian
from edgegrad.derivatives.table_derivatives import ParameterMap, shapes, with_requested
from edgegrad.scene import parameters
from edgegrad.scene.camera import KINDS
from edgegrad.tables import lights as light_table
from edgegrad.tables import tables
from edgegrad.tables.camera import camera_row
from edgegrad.tables.materials import GLOSSY, LAMBERTIAN, TRANSPARENCY
from tests.support.rich_scene import everything, turn
from tests.support.table_values import WITHOUT, values

F64 = NDArray[np.float64]


def made() -> Scene:
    """A scene with everything. At a `smooth` of 0, the least value, there is no difference to the other side."""
    scene = everything()
    for light in scene.lights.values():
        if hasattr(light, "smooth"):
            light.smooth = 0.2
    scene.world.medium = Medium((0.2, 0.3, 0.4), (0.1, 0.2, 0.3), 0.3)
    haze = Medium((1.0, 0.3, 0.5), (0.1, 0.2, 0.3), -0.4)
    scene.materials["haze"] = Material(np.full(3, 0.7), kind="TRANSPARENT", medium=haze)
    return scene


SCENE = made()
FLAT = tables.flatten(SCENE)
PATHS = [path for path in parameters.paths(SCENE) if not path.endswith(WITHOUT) and ".textures." not in path
         and not (path.startswith("materials.haze.") and ".medium." not in path)]
# Parameters on which the picture does not depend in this scene.
ZERO = {
    *(f"meshes.{name}.attributes.unread" for name in ("moved", "copies", "lamps", "Cube.001", "still")),
    "images.unread.pixels", "materials.wood.normal", "materials.wood.alpha", "materials.wood.specular_tint",
    "materials.clay.coat_tint", "materials.clay.sheen_tint", "materials.clay.emission",
    "lights.point.radius", "lights.spot.radius", "lights.hard sun.angle", "lights.area.spread", "lights.linear.across",
    "camera.ortho_width", "camera.fisheye_fov", "camera.fisheye_lens", "camera.fisheye_polynomial",
}  # fmt: skip


def test_every_float_is_a_parameter() -> None:
    kinds = {type(held).__name__ + "." + parameters.split(path)[2].split(".")[0]
             for path in PATHS for held in [parameters.owner(SCENE, path)[0]]}
    assert {
        "Mesh.vertices", "Mesh.normals", "Mesh.instances", "Mesh.transform", "Mesh.attributes", "Image.pixels",
        "Mixture.weights", "Material.roughness", "Material.normal_strength", "World.rotation", "Camera.to_world",
        "Camera.fov_x", "Camera.ortho_width", "Camera.shift", "Camera.aperture_radius", "Camera.focus_distance",
        "SpotLight.blend", "SpotLight.angle", "SpotLight.direction", "SpotLight.position", "AreaLight.to_world",
        "AreaLight.size", "AreaLight.spread", "SunLight.angle", "PointLight.radius",
    } <= kinds  # fmt: skip
    assert len(kinds) > 60


def direction_of(path: str, value: F64, rng: np.random.Generator) -> F64:
    """A tangent of a parameter's value; of rotations one that keeps them so, as scenes are checked."""
    field = parameters.split(path)[2]
    if field == "weights":
        return np.array([0.1, 0.0, -0.2])  # the second is textured
    if field in ("to_world", "rotation"):
        out = np.zeros(value.shape)
        x, y, z = rng.normal(size=3)
        out[:3, :3] = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) @ value[:3, :3]
        if value.shape == (4, 4):
            out[:3, 3] = rng.normal(size=3)
        return out
    out = np.asarray(rng.choice([-1.0, 1.0], value.shape) * rng.uniform(0.1, 0.5, value.shape) * (np.abs(value) + 0.1))
    if path == "images.opaque.pixels":
        out[..., 3] = 0.0  # an alpha of 1 everywhere isn't stored
    return out


def moved(path: str, value: F64, direction: F64, step: float) -> F64:
    field = parameters.split(path)[2]
    out = value + step * direction
    if field in ("to_world", "rotation"):
        skew = direction[:3, :3] @ value[:3, :3].T
        out[:3, :3] = turn(*(step * np.array([skew[2, 1], skew[0, 2], skew[1, 0]]))) @ value[:3, :3]
    return out


@pytest.mark.parametrize("path", PATHS)
def test_tangents_are_the_differences_of_the_tables(path: str) -> None:
    """Central differences of fourth order; their error is the rounding of float32 tables."""
    scene = made()
    value = np.asarray(parameters.get(scene, path), np.float64)
    direction = direction_of(path, value, np.random.default_rng(1))
    tangent = ParameterMap(scene, FLAT, [path]).push_forward({path: direction})
    if path in ZERO:
        assert not any(np.any(part) for part in tangent.values())
        return
    h, at = 0.02, {}
    for k in (-2, -1, 1, 2):
        parameters.put(scene, path, moved(path, value, direction, k * h))
        # Values leave geometry and textures as they are, which saves most of the time.
        shaped = path.startswith(("meshes.", "images."))
        at[k] = values(tables.flatten(scene, FLAT.origin) if shaped else tables.with_values(scene, FLAT))
    changed = False
    for name, base in values(FLAT).items():
        difference = (8.0 * (at[1][name] - at[-1][name]) - (at[2][name] - at[-2][name])) / (12.0 * h)
        expected = tangent.get(name, np.zeros(base.shape))
        allowed = 1e-6 + 2e-5 * (np.abs(base) + np.abs(expected))
        assert np.all(np.abs(difference - expected) <= allowed), f"{name}: {np.abs(difference - expected).max()}"
        changed |= bool(np.any(np.abs(difference) > 100.0 * allowed))
    assert changed


def test_pull_back_is_the_transpose_of_push_forward() -> None:
    rng = np.random.default_rng(2)
    gradients = {name: rng.normal(size=shape) for name, shape in shapes(FLAT).items()}
    pulled = ParameterMap(SCENE, FLAT, PATHS).pull_back(gradients)
    for path in PATHS:
        value = np.asarray(parameters.get(SCENE, path))
        assert pulled[path].shape == value.shape
        direction = rng.normal(size=value.shape)
        pushed = ParameterMap(SCENE, FLAT, [path]).push_forward({path: direction})
        forward = sum(float(np.vdot(part, gradients[name])) for name, part in pushed.items())
        size = sum(float(np.vdot(np.abs(part), np.abs(gradients[name]))) for name, part in pushed.items())
        assert abs(forward - float(np.vdot(direction, pulled[path]))) <= 1e-12 * size, path


def test_wanted_rows_are_those_that_change() -> None:
    rng = np.random.default_rng(3)
    for path in PATHS:
        derivative = ParameterMap(SCENE, FLAT, [path])
        wanted = derivative.requested
        pushed = derivative.push_forward({path: rng.normal(size=np.shape(parameters.get(SCENE, path)))})
        assert set(wanted) == set(pushed)
        for name, spans in wanted.items():
            rows = pushed[name].reshape(len(pushed[name]), -1).any(axis=1)
            inside = np.zeros(len(rows), bool)
            for first, last in spans:
                assert rows[first:last].any(), (path, name)
                inside[first:last] = True
            assert not rows[~inside].any(), (path, name)


def test_spans_of_several_parameters_are_united() -> None:
    count = [len(m.vertices) for m in tables.placed_meshes(SCENE)]
    first = np.cumsum([0, *count])
    wanted = ParameterMap(SCENE, FLAT, ["meshes.bare.vertices", "meshes.moved.vertices", "meshes.still.vertices",
                                        "meshes.moved.transform", "camera.fov_x", "camera.shift"]).requested
    assert wanted["vertices"].tolist() == [[0, first[1]], [first[4], first[6]]]
    assert wanted["camera"].tolist() == [[12, 13], [14, 16]]


def test_small_rows_are_exact() -> None:
    """Against differences in double precision, whose own error is about 1e-10."""
    origin = FLAT.origin
    for held, row_of in [(light, lambda x: light_table.light_row(x, origin)) for light in SCENE.lights.values()] + [
        (replace(SCENE.camera, kind=kind), lambda x: camera_row(x, origin)) for kind in KINDS
    ]:
        row = row_of(held)
        for field in (f for f in vars(held) if isinstance(getattr(held, f), (float, np.ndarray))):
            value = np.asarray(getattr(held, field), np.float64)
            if (field, float(value.max())) in (("radius", 0.0), ("angle", 0.0), ("spread", np.pi)):
                continue
            direction = np.random.default_rng(4).normal(size=value.shape) * 0.1 * (np.abs(value) + 0.1)
            h = 0.01

            def at(step: float, held: Any = held, field: str = field, row_of: Any = row_of) -> F64:
                return np.asarray(row_of(replace(held, **{field: (value + step * direction)[()]})))  # noqa: B023

            odd = [at(k * h) - at(-k * h) for k in (1, 2, 3)]
            difference = (45.0 * odd[0] - 9.0 * odd[1] + odd[2]) / (60.0 * h)
            found = np.tensordot(jacobian(row_of, held, field), direction, value.ndim)
            np.testing.assert_allclose(found, difference, rtol=1e-9, atol=1e-11 * np.abs(row).max(), err_msg=field)


def test_what_is_zero_but_asked_for_is_in_the_tables() -> None:
    black = replace(SCENE.world, color=np.zeros(3))
    scene = replace(SCENE, world=black, materials={
        "clay": Material(), "wood": Material(kind="GLASS"), "sum": Mixture(("wood", "clay"), np.ones(2)),
        "glow": Material(emission=np.ones(3)),
    })  # fmt: skip
    flat = tables.flatten(scene)
    plain = flat.materials.flags
    assert flat.environment_pixels is None
    assert with_requested(scene, flat, ["materials.clay.base_color", "materials.clay.roughness"]) is flat
    asked = with_requested(scene, flat, ["materials.clay.coat_weight", "world.strength"])
    assert asked.environment_pixels is not None and asked.environment_pixels.shape == (4, 8, 3)
    glossy = (asked.materials.flags & GLOSSY) != 0
    assert glossy.tolist() == [True, True, True, True, False] + [False] * (len(plain) - 5)
    assert ((plain & GLOSSY) != 0).tolist() == [False, True, True, False, False] + [False] * (len(plain) - 5)
    assert not (asked.materials.flags & LAMBERTIAN)[[0, 3]].any() and (plain & LAMBERTIAN)[[0, 3]].all()
    alpha = with_requested(scene, flat, ["materials.clay.alpha"]).materials.flags
    assert (alpha & TRANSPARENCY)[[0, 3]].all() and not (plain & TRANSPARENCY).any()


def test_asked_for_images_keep_their_alpha() -> None:
    """Of colours at alpha 1 and just below it: the derivative by alpha is that of colour times alpha, and of alpha."""
    path = "images.opaque.pixels"
    asked = with_requested(SCENE, FLAT, [path])
    stored = {image.name: image for image in asked.textures.stored_images}["opaque"]
    assert (stored.channels, stored.multiplied) == (4, True)
    assert {image.name: image for image in FLAT.textures.stored_images}["opaque"].channels == 3
    scene = made()
    pixels = np.array(parameters.get(scene, path))
    direction = np.random.default_rng(9).uniform(-0.5, -0.1, pixels.shape)
    parameters.put(scene, path, pixels + 1e-2 * direction)
    tangent = ParameterMap(SCENE, asked, [path]).push_forward({path: direction})["texture_pixels"]
    difference = (tables.flatten(scene).textures.pixels - asked.textures.pixels) / 1e-2
    np.testing.assert_allclose(difference, tangent, atol=5e-3)  # of second order: the product of both changes
    assert with_requested(SCENE, FLAT, ["images.rgba.pixels", "images.sky.pixels"]) is FLAT


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("camera.clip_start", "parameter 'camera.clip_start' has no derivative: clip distances only decide"),
        ("camera.filter_width", "parameter 'camera.filter_width' has no derivative: pixels are weighted"),
        ("meshes.still.terminator_offset", "parameter 'meshes.still.terminator_offset' has no derivative: it only"),
        ("lights.ball.sphere", "unknown parameter path 'lights.ball.sphere': 'sphere' is not one of the fields"),
        ("camera.aperture_blades", "unknown parameter path 'camera.aperture_blades': 'aperture_blades' is not one"),
        ("meshes.still.attributes.UV", "'attributes.UV' is not one of the fields vertices, normals, attributes.UVMap"),
        ("images.none.pixels", "there is no 'none' in images"),
        ("materials.sum.base_color", "'base_color' is not one of the fields weights"),
    ],
)
def test_what_has_no_derivative_says_so(path: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ParameterMap(SCENE, FLAT, [path])


def test_tangents_of_another_shape_are_refused() -> None:
    derivative = ParameterMap(SCENE, FLAT, ["camera.fov_x"])
    with pytest.raises(ValueError, match=r"tangent of 'camera\.fov_x' must have the shape \(\), not \(3,\)"):
        derivative.push_forward({"camera.fov_x": np.ones(3)})
    with pytest.raises(ValueError, match=r"tangent of 'camera\.fov_x' has 1 non-finite values"):
        derivative.push_forward({"camera.fov_x": np.nan})
