"""Parameters to tables and back: against differences of `flatten`, each other's transpose, in every kind of scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from edgegrad import (
    AreaLight,
    Camera,
    Image,
    Material,
    Mesh,
    Mixture,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
    World,
    light_table,
    parameters,
    tables,
)
from edgegrad import expression as e
from edgegrad.camera_row import camera_row
from edgegrad.jacobian import jacobian
from edgegrad.material_table import GLOSSY, LAMBERTIAN, TRANSPARENCY
from edgegrad.table_derivatives import asked_tables, pull_back, push_forward, shapes, wanted_tables
from edgegrad.tables import Tables
from tests import shapes as solids

F64 = NDArray[np.float64]


def turn(x: float, y: float, z: float) -> F64:
    """(3, 3) rotation about the axis (x, y, z) by its length in radians."""
    angle = float(np.linalg.norm([x, y, z]))
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / (angle or 1.0)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)


def pose(rotation: F64, x: float, y: float, z: float) -> F64:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, (x, y, z)
    return out


def mesh(rng: np.random.Generator, materials: tuple[str, ...], **fields: Any) -> Mesh:
    """A cube with custom normals and layers of one to four values."""
    vertices, faces = solids.cube()
    layers = {
        "UVMap": 2, "UVMap.tangent": 4, "Generated.001": 3, "weight": 1, "unread": 3,
    }  # fmt: skip
    return Mesh(
        vertices + rng.normal(scale=0.2, size=vertices.shape), faces, materials, np.repeat([0, 1], 6).astype(np.int32),
        smoothing=faces, normals=rng.normal(size=(10, 3)) + vertices.mean(),
        attributes={name: rng.uniform(0.2, 1.0, (12, 3, n)).astype(np.float32) for name, n in layers.items()},
        **fields,
    )


def within_limits(material: Material) -> Material:
    """The material with values that may change to both sides."""
    for field, value in vars(material).items():
        if isinstance(value, (float, np.ndarray)):
            inner = np.where(value == 0.0, 0.1, np.where(value == 1.0, 0.9, value))
            setattr(material, field, inner if inner.ndim else float(inner))
    return material


def everything() -> Scene:
    """A scene in which every parameter of every kind matters somewhere."""
    rng = np.random.default_rng(11)
    place = turn(0.3, -0.5, 0.2) @ np.diag([1.2, 0.7, -0.9]) + rng.normal(scale=0.1, size=(3, 3))
    copies = np.stack([pose(turn(*rng.normal(size=3)) * s, *rng.normal(size=3)) for s in (0.5, -0.7, 1.1)])
    plain = solids.cube()
    uv, color, packed = e.Attribute("UVMap"), e.Attribute("Generated.001"), e.Attribute("weight")
    return Scene(
        Camera(
            pose(turn(0.4, 0.2, -0.3), 1.0, -5.0, 2.0), 0.8, 40, 30, np.array([0.1, -0.2]), pixel_aspect=1.3,
            longitude=np.array([-1.0, 2.0]), latitude=np.array([-0.7, 0.9]), aperture_radius=0.1, focus_distance=4.0,
            aperture_rotation=0.3, aperture_ratio=1.4, crop=(3, 4, 20, 25),
        ),
        {
            "moved": mesh(rng, ("wood", "clay"), transform=pose(place, 1.0, 2.0, -0.5)),
            "copies": mesh(rng, ("clay", "sum"), instances=copies, transform=pose(place, 0.3, -0.2, 0.1)),
            "lamps": mesh(rng, ("glow", "wood"), instances=copies[1:], transform=pose(place, 0.0, 1.0, 0.1)),
            "Cube.001": replace(mesh(rng, ("sum", "glow")), normals=None),
            "still": mesh(rng, ("sum", "wood")),
            "bare": Mesh(plain[0] + 4.0, plain[1], ("clay",)),
        },
        {
            "wood": within_limits(Material(
                np.array([0.6, 0.5, 0.4]), roughness=0.3, anisotropy=0.4, normal_uv="UVMap",
                textures={"normal": e.ImageTexture("bumps", uv), "alpha": packed,
                          "specular_tint": e.Mix(packed, e.ImageTexture("rgba", uv), color)},
            )),
            "sum": Mixture(("clay", "wood", "clay"), np.array([0.3, 0.5, 0.2]), {"1": packed}),
            "clay": within_limits(Material(
                np.array([0.5, 0.2, 0.4]), metallic=0.2, specular_ior_level=0.5, coat_weight=0.3, sheen_weight=0.2,
                transmission=0.1, subsurface_weight=0.2, alpha=0.9, diffuse_roughness=0.3,
                textures={"coat_tint": e.ImageTexture("rgba", uv, alpha="CHANNEL_PACKED"),
                          "sheen_tint": e.ImageTexture("grey", uv), "emission": e.ImageTexture("opaque", uv)},
            )),
            "glow": within_limits(Material(emission=np.array([1.0, 2.0, 3.0]))),
        },
        {
            "sun": SunLight(np.array([0.3, 1.0, -1.0]), 2.0, 0.1, color=np.array([0.9, 0.8, 0.7])),
            "hard sun": SunLight(np.array([0.3, 1.0, -1.0]), 2.0),
            "point": PointLight(np.array([2.0, -3.0, 4.0]), 60.0, color=np.array([0.5, 0.8, 0.7])),
            "ball": PointLight(np.array([2.0, -3.0, 4.0]), 60.0, 0.2, True),
            "spot": SpotLight(np.array([2.0, 3.0, 4.0]), np.array([0.4, -0.3, -2.0]), 60.0, 0.9, 0.3),
            "linear": SpotLight(np.array([2.0, 3.0, 4.0]), np.array([0.4, -0.3, -2.0]), 60.0, 0.9, 0.3, 0.2,
                                falloff="LINEAR"),
            "area": AreaLight(pose(turn(1.0, 0.2, 0.1), 0.0, 0.0, 3.0), np.array([1.0, 2.0]), "RECTANGLE", 50.0),
            "disk": AreaLight(pose(turn(1.0, 0.2, 0.1), 0.0, 1.0, 3.0), np.array([1.0, 1.5]), "ELLIPSE", 40.0, 1.0,
                              color=np.array([0.1, 0.6, 0.7])),
        },
        World(np.array([0.1, 0.2, 0.3]), 0.5, "sky", turn(0.1, 0.4, -0.8)),
        {
            "rgba": Image(rng.uniform(0.2, 0.9, (3, 5, 4)).astype(np.float32)),
            "opaque": Image(np.concatenate([rng.uniform(0.2, 0.9, (2, 3, 3)), np.ones((2, 3, 1))], 2).astype("f4")),
            "bumps": Image(rng.uniform(0.2, 0.9, (4, 4, 3)).astype(np.float32)),
            "grey": Image(rng.uniform(0.2, 0.9, (4, 2, 1)).astype(np.float32)),
            "sky": Image(rng.uniform(0.2, 5.0, (4, 8, 4)).astype(np.float32)),
            "unread": Image(rng.uniform(0.2, 0.9, (2, 2, 3)).astype(np.float32)),
        },
    )  # fmt: skip


def values(flat: Tables) -> dict[str, F64]:
    """The tables by their names in derivatives."""
    out: dict[str, Any] = {
        "vertices": flat.vertices,
        "normals": flat.custom_normals,
        "instance_to_world": flat.instance_to_world,
        "leaf_params": flat.materials.params,
        "light_params": flat.lights.params,
        "environment": flat.environment,
        "environment_rotation": flat.environment_rotation,
        "environment_pixels": flat.environment_pixels,
        "camera": np.concatenate([
            flat.camera_position, flat.camera_axes.reshape(-1), [flat.focal, flat.pixel_aspect], flat.principal_point,
            flat.panorama, flat.aperture[[0, 1, 3, 4]],
        ]),
    }
    if flat.textures is not None:
        for name in ("pixels", "attributes", "lookups", "constants"):
            out[f"texture_{name}"] = getattr(flat.textures, name)
    out = {name: np.reshape(out[name], shape).astype(np.float64) for name, shape in shapes(flat).items()}
    # Area lights are rows of `light_params`; their hidden meshes and leaves aren't differentiated.
    out["vertices"][flat.mesh_first_vertex[len(flat.mesh_names)] :] = 0.0
    out["leaf_params"][flat.materials.first_leaf[len(SCENE.materials)] :] = 0.0
    return out


SCENE = everything()
FLAT = tables.flatten(SCENE)
WITHOUT = ("clip_start", "clip_end", "filter_width", "terminator_offset")
PATHS = [path for path in parameters.paths(SCENE) if not path.endswith(WITHOUT)]
# What the picture doesn't depend on in this scene.
ZERO = {
    *(f"meshes.{name}.attributes.unread" for name in ("moved", "copies", "lamps", "Cube.001", "still")),
    "images.unread.pixels", "materials.wood.normal", "materials.wood.alpha", "materials.wood.specular_tint",
    "materials.clay.coat_tint", "materials.clay.sheen_tint", "materials.clay.emission",
    "lights.point.radius", "lights.spot.radius", "lights.hard sun.angle", "lights.area.spread", "camera.ortho_width",
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
    if field in ("to_world", "rotation") and not path.startswith("lights."):
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
    if field in ("to_world", "rotation") and not path.startswith("lights."):
        skew = direction[:3, :3] @ value[:3, :3].T
        out[:3, :3] = turn(*(step * np.array([skew[2, 1], skew[0, 2], skew[1, 0]]))) @ value[:3, :3]
    return out


@pytest.mark.parametrize("path", PATHS)
def test_tangents_are_the_differences_of_the_tables(path: str) -> None:
    """Central differences of fourth order; what is left is the rounding of float32 tables."""
    scene = everything()
    value = np.asarray(parameters.get(scene, path), np.float64)
    direction = direction_of(path, value, np.random.default_rng(1))
    tangent = push_forward(scene, FLAT, {path: direction})
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
    pulled = pull_back(SCENE, FLAT, gradients, PATHS)
    for path in PATHS:
        value = np.asarray(parameters.get(SCENE, path))
        assert pulled[path].shape == value.shape
        direction = rng.normal(size=value.shape)
        pushed = push_forward(SCENE, FLAT, {path: direction})
        forward = sum(float(np.vdot(part, gradients[name])) for name, part in pushed.items())
        size = sum(float(np.vdot(np.abs(part), np.abs(gradients[name]))) for name, part in pushed.items())
        assert abs(forward - float(np.vdot(direction, pulled[path]))) <= 1e-12 * size, path


def test_wanted_rows_are_those_that_change() -> None:
    rng = np.random.default_rng(3)
    for path in PATHS:
        wanted = wanted_tables(SCENE, FLAT, [path])
        pushed = push_forward(SCENE, FLAT, {path: rng.normal(size=np.shape(parameters.get(SCENE, path)))})
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
    wanted = wanted_tables(SCENE, FLAT, ["meshes.bare.vertices", "meshes.moved.vertices", "meshes.still.vertices",
                                         "meshes.moved.transform", "camera.fov_x", "camera.shift"])
    assert wanted["vertices"].tolist() == [[0, first[1]], [first[4], first[6]]]
    assert wanted["camera"].tolist() == [[12, 13], [14, 16]]


def test_small_rows_are_exact() -> None:
    """Against differences in double precision, whose own error is about 1e-10."""
    origin = FLAT.origin
    for held, row_of in [(light, lambda x: light_table.light_row(x, origin)) for light in SCENE.lights.values()] + [
        (replace(SCENE.camera, kind=kind), lambda x: camera_row(x, origin)) for kind in ("PERSPECTIVE", "ORTHOGRAPHIC")
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
    assert asked_tables(scene, flat, ["materials.clay.base_color", "materials.clay.roughness"]) is flat
    asked = asked_tables(scene, flat, ["materials.clay.coat_weight", "world.strength"])
    assert asked.environment_pixels is not None and asked.environment_pixels.shape == (4, 8, 3)
    glossy = (asked.materials.flags & GLOSSY) != 0
    assert glossy.tolist() == [True, True, True, True, False] + [False] * (len(plain) - 5)
    assert ((plain & GLOSSY) != 0).tolist() == [False, True, True, False, False] + [False] * (len(plain) - 5)
    assert not (asked.materials.flags & LAMBERTIAN)[[0, 3]].any() and (plain & LAMBERTIAN)[[0, 3]].all()
    alpha = asked_tables(scene, flat, ["materials.clay.alpha"]).materials.flags
    assert (alpha & TRANSPARENCY)[[0, 3]].all() and not (plain & TRANSPARENCY).any()


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("camera.clip_start", "parameter 'camera.clip_start' has no derivative: clip distances only say"),
        ("camera.filter_width", "parameter 'camera.filter_width' has no derivative: pixels are weighted"),
        ("meshes.still.terminator_offset", "parameter 'meshes.still.terminator_offset' has no derivative: it only"),
        ("lights.ball.sphere", "unknown parameter path 'lights.ball.sphere': 'sphere' is none of the fields"),
        ("camera.aperture_blades", "unknown parameter path 'camera.aperture_blades': 'aperture_blades' is none"),
        ("meshes.still.attributes.UV", "'attributes.UV' is none of the fields vertices, normals, attributes.UVMap"),
        ("images.none.pixels", "there is no 'none' in images"),
        ("materials.sum.base_color", "'base_color' is none of the fields weights"),
    ],
)
def test_what_has_no_derivative_says_so(path: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wanted_tables(SCENE, FLAT, [path])


def test_tangents_of_another_shape_are_refused() -> None:
    with pytest.raises(ValueError, match=r"tangent of 'camera\.fov_x' must have the shape \(\), not \(3,\)"):
        push_forward(SCENE, FLAT, {"camera.fov_x": np.ones(3)})
    with pytest.raises(ValueError, match=r"tangent of 'camera\.fov_x' has non-finite values"):
        push_forward(SCENE, FLAT, {"camera.fov_x": np.nan})
