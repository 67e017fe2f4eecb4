"""A scene with a parameter of every kind, and nothing at the ends of its range."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
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
)
from edgegrad import expression as e
from tests.support import shapes as solids

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


Place = tuple[float, float, float]


def mesh(rng: np.random.Generator, materials: tuple[str, ...], at: Place = (0.0, 0.0, 0.0), **fields: Any) -> Mesh:
    """A bent cube about a place, with custom normals and layers of one to four values."""
    vertices, faces = solids.cube()
    layers = {
        "UVMap": 2, "UVMap.tangent": 4, "Generated.001": 3, "weight": 1, "unread": 3,
    }  # fmt: skip
    return Mesh(
        vertices + at + rng.normal(scale=0.2, size=vertices.shape), faces, materials,
        np.repeat([0, 1], 6).astype(np.int32), smoothing=faces,
        normals=np.concatenate([vertices, vertices[:2]]) + rng.normal(scale=0.3, size=(10, 3)),
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
            pose(turn(1.25, 0.1, 0.05), 0.5, -11.0, 3.5), 0.9, 40, 30, np.array([0.05, -0.1]), pixel_aspect=1.3,
            longitude=np.array([-1.0, 2.0]), latitude=np.array([-0.7, 0.9]), aperture_radius=0.1, focus_distance=11.0,
            aperture_rotation=0.3, aperture_ratio=1.4, crop=(3, 4, 38, 29),
        ),
        {
            "moved": mesh(rng, ("wood", "clay"), transform=pose(place, 2.5, 0.0, -0.5)),
            "copies": mesh(rng, ("clay", "sum"), instances=copies, transform=pose(place, -2.5, 0.5, 1.5)),
            "lamps": mesh(rng, ("glow", "wood"), instances=copies[1:], transform=pose(place, 1.5, 2.5, 2.5)),
            "Cube.001": replace(mesh(rng, ("sum", "glow"), (-2.5, 0.0, -1.5)), normals=None),
            "still": mesh(rng, ("sum", "wood"), (0.0, -1.5, 0.0)),
            "bare": Mesh(plain[0] + [4.0, 4.0, 2.0], plain[1], ("clay",)),
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
            "point": PointLight(np.array([2.0, -6.0, 5.0]), 60.0, color=np.array([0.5, 0.8, 0.7])),
            "ball": PointLight(np.array([2.0, -6.0, 5.0]), 60.0, 0.2, True),
            "spot": SpotLight(np.array([-2.0, -6.0, 5.0]), np.array([0.8, 2.0, -2.0]), 60.0, 0.9, 0.3,
                              stretch=np.array([1.2, 0.8])),
            "linear": SpotLight(np.array([-2.0, -6.0, 5.0]), np.array([0.8, 2.0, -2.0]), 60.0, 0.9, 0.3, 0.2,
                                falloff="LINEAR"),
            "area": AreaLight(pose(turn(0.6, 0.2, 0.1), 0.0, -4.0, 5.0), np.array([1.0, 2.0]), "RECTANGLE", 50.0),
            "disk": AreaLight(pose(turn(0.6, 0.2, 0.1), -3.0, -4.0, 5.0), np.array([1.0, 1.5]), "ELLIPSE", 40.0, 1.0,
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
