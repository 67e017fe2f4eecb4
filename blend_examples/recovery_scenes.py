"""Scenes of which something is lost and found again from pictures: what is lost, where the search starts, and how far
from the truth it is.

What is looked for is never simply seen: a thing outside the frame is told by its shadow or by its reflection in rough
metal, a surface's and a lamp's values by how they shade, a camera's place by what it sees.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from edgegrad import AreaLight, Camera, FitResult, Image, Material, Mesh, PointLight, Scene, World, fit, render
from edgegrad import expression as e
from edgegrad.fitting.rigid_variables import rotations
from edgegrad.scene import parameters

F64 = NDArray[np.float64]
SIZE = 48  # pixels along each side
TARGET_SPP = 512


@dataclass(frozen=True)
class Recovery:
    """One search.

    Attributes
    ----------
    title
        What is looked for, from what.
    truth
        Makes the scene as it is.
    starts
        Name to a function that makes a scene where a search starts.
    wrt
        Parameter paths that are lost.
    error
        Of a scene, to the true one: 0 at the truth.
    part
        The part of a start's error that may be left.
    options
        Of `edgegrad.fit`.
    """

    title: str
    truth: Callable[[], Scene]
    starts: Mapping[str, Callable[[], Scene]]
    wrt: tuple[str, ...]
    error: Callable[[Scene, Scene], float]
    part: float
    options: Mapping[str, Any] = field(default_factory=dict)


def looking(eye: ArrayLike, at: ArrayLike, fov_x: float) -> Camera:
    """A camera at `eye` that looks at `at`."""
    pose = np.eye(4)
    back = np.asarray(eye, float) - np.asarray(at, float)
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    pose[:3] = np.stack([right, np.cross(back, right), back, np.asarray(eye, float)], axis=1)
    return Camera(pose, fov_x, SIZE, SIZE)


def square(half: float, material: str) -> Mesh:
    """A square in the plane z = 0, with UV coordinates."""
    corners = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uv = (0.5 * corners[:, :2] + 0.5).astype(np.float32)[faces]
    return Mesh(half * corners, faces, (material,), attributes={"UVMap": uv})


def ball(material: str, center: ArrayLike, radii: ArrayLike = 1.0, divisions: int = 8) -> Mesh:
    """An ellipsoid: a cube's faces of `divisions`² squares each, blown up; smooth."""
    line = np.tan(np.linspace(-1.0, 1.0, divisions + 1) * np.pi / 4.0)
    u, v = (x.ravel() for x in np.meshgrid(line, line, indexing="ij"))
    one = np.ones_like(u)
    sides = [(u, v, one), (v, u, -one), (one, u, v), (-one, v, u), (v, one, u), (u, -one, v)]
    points = np.concatenate([np.stack(side, axis=1) for side in sides])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    k = np.arange((divisions + 1) ** 2).reshape(divisions + 1, -1)
    a, b, c, d = k[:-1, :-1].ravel(), k[1:, :-1].ravel(), k[1:, 1:].ravel(), k[:-1, 1:].ravel()
    quads = np.concatenate([np.stack([a, b, c, d], axis=1) + n * k.size for n in range(6)])
    distinct, index = np.unique(points.round(9), axis=0, return_inverse=True)
    corners = index.reshape(-1)[quads]
    faces = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]).astype(np.int32)
    return Mesh(distinct * np.asarray(radii, float) + np.asarray(center, float), faces, (material,), smoothing=faces)


def blade(lobes: float, radius: float, center: tuple[float, float] = (0.0, 0.0), height: float = 1.5) -> Mesh:
    """A level sheet whose outline is a circle with three lobes: 4 rings of 48 vertices about its middle."""
    angle = np.arange(48) * 2.0 * np.pi / 48
    outline = radius * (1.0 + lobes * np.cos(3.0 * angle))[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    flat = np.concatenate([np.zeros((1, 2)), *(k / 4.0 * outline for k in range(1, 5))]) + np.asarray(center)
    here = np.arange(48)
    after = (here + 1) % 48
    faces = [np.stack([0 * here, 1 + here, 1 + after], axis=1)]
    for ring in range(3):
        a, b = 1 + 48 * ring, 49 + 48 * ring
        faces += [np.stack([a + here, b + here, b + after], axis=1), np.stack([a + here, b + after, a + after], axis=1)]
    vertices = np.concatenate([flat, np.full((len(flat), 1), height)], axis=1)
    return Mesh(vertices, np.concatenate(faces).astype(np.int32), ("dark",))


def matte(*color: float) -> Material:
    """A Lambertian material."""
    return Material(np.array(color))


def lamp_at(*position: float, size: float = 0.4, power: float = 60.0) -> AreaLight:
    """A square lamp that shines down."""
    pose = np.eye(4)
    pose[:3, 3] = position
    return AreaLight(pose, np.full(2, size), power=power)


# A thing above the frame, told by its shadow.

LAMP = (0.0, 0.0, 4.0)


def shadow_of(thing: Mesh) -> Scene:
    """A floor with the shadow of something that the camera doesn't see."""
    return Scene(
        looking((0.0, -3.2, 1.2), (0.0, 0.3, -0.35), 0.75),
        {"floor": square(6.0, "floor"), "thing": thing},
        {"floor": matte(0.8, 0.75, 0.7), "dark": matte(0.2, 0.2, 0.2)},
        {"lamp": lamp_at(*LAMP)},
        World(np.full(3, 0.05)),
    )


def shadow_mask(mesh: Mesh, count: int = 160) -> NDArray[np.bool_]:
    """Which points of a grid on the floor the mesh hides from the lamp's middle."""
    lamp = np.array(LAMP)
    along = lamp[2] / (lamp[2] - mesh.vertices[:, 2:])
    corners = (lamp[:2] + (mesh.vertices[:, :2] - lamp[:2]) * along)[mesh.faces]
    line = np.linspace(-2.5, 2.5, count)
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    out = np.zeros(len(points), bool)
    for triangle in corners:
        near = np.flatnonzero(((points >= triangle.min(axis=0)) & (points <= triangle.max(axis=0))).all(axis=1))
        side = np.stack([_cross(np.roll(triangle, -1, axis=0)[k] - triangle[k], points[near] - triangle[k])
                         for k in range(3)])  # fmt: skip
        out[near] |= (side >= 0.0).all(axis=0) | (side <= 0.0).all(axis=0)
    return out


def _cross(a: F64, b: F64) -> F64:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def shadow_error(found: Scene, truth: Scene) -> float:
    """1 - the part that two shadows have in common of the area that either covers."""
    a, b = (shadow_mask(scene.meshes["thing"]) for scene in (found, truth))
    return 1.0 - float((a & b).sum() / (a | b).sum())


# A thing above the frame, told by its reflection in a floor of rough metal (GGX alpha 0.2).


def reflection_of(center: ArrayLike, radii: ArrayLike) -> Scene:
    """A rough metal floor that shows something which the camera doesn't see itself."""
    metal = Material(np.array([0.9, 0.9, 0.9]), metallic=1.0, roughness=float(np.sqrt(0.2)))
    return Scene(
        looking((0.0, -3.0, 1.2), (0.0, -0.2, -0.2), 0.7),
        {"floor": square(6.0, "metal"), "thing": ball("paint", center, radii)},
        {"metal": metal, "paint": matte(0.9, 0.3, 0.1)},
        {"lamp": lamp_at(1.5, -1.0, 3.5, size=1.0, power=150.0)},
        World(np.array([0.25, 0.35, 0.5])),
    )


def outline_error(found: Scene, truth: Scene) -> float:
    """Greatest difference of the thing's left, right, lower and upper ends, metres.

    How far away its parts are, and what its back looks like, a blurred reflection hardly tells.
    """
    ends = [np.concatenate([across.min(axis=0), across.max(axis=0)])
            for across in (scene.meshes["thing"].vertices[:, [0, 2]] for scene in (found, truth))]  # fmt: skip
    return float(np.abs(ends[0] - ends[1]).max())


# Values of a surface, of lamps, of a texture, and the camera's place.


def still_life(**values: Any) -> Scene:
    """A ball on a chequered floor under two lamps; `values`: parameter paths, with "/" for ".", to their values."""
    ramp = np.indices((8, 8)).sum(axis=0) % 2
    checks = np.where(ramp[..., None] == 1, [0.7, 0.6, 0.5], [0.25, 0.3, 0.4]).astype(np.float32)
    scene = Scene(
        looking((0.5, -4.5, 2.2), (0.0, 0.0, 0.6), 0.6),
        {"floor": square(2.0, "checks"), "thing": ball("glaze", (0.0, 0.0, 0.9), 0.8)},
        {
            "checks": Material(textures={"base_color": e.ImageTexture("checks", e.Attribute("UVMap"))}),
            "glaze": Material(np.array([0.7, 0.35, 0.15]), metallic=0.6, roughness=0.35, specular_ior_level=0.5),
        },
        {
            "lamp": lamp_at(-1.5, -1.5, 3.5, size=0.8, power=60.0),
            "bulb": PointLight(np.array([1.1, -0.8, 0.8]), 15.0, 0.15),
        },
        World(np.full(3, 0.1)),
        {"checks": Image(checks)},
    )
    for path, value in values.items():
        parameters.put(scene, path.replace("/", "."), value)
    return scene


def value_error(*paths: str, scales: tuple[float, ...] = ()) -> Callable[[Scene, Scene], float]:
    """Greatest difference among values, each in its unit or by `scales`."""

    def error(found: Scene, truth: Scene) -> float:
        units = scales or (1.0,) * len(paths)
        return max(float(np.abs(np.subtract(parameters.get(found, p), parameters.get(truth, p))).max()) / unit
                   for p, unit in zip(paths, units, strict=True))  # fmt: skip

    return error


def texel_error(found: Scene, truth: Scene) -> float:
    """Median difference of the texture: texels behind the ball can't be found."""
    return float(np.median(np.abs(found.images["checks"].pixels - truth.images["checks"].pixels)))


def camera_moved(scene: Scene, move: ArrayLike, turn: ArrayLike) -> Scene:
    """The scene, its camera moved in the world and turned about its own axes (radians)."""
    pose = scene.camera.to_world.copy()
    pose[:3, :3] = pose[:3, :3] @ rotations(np.asarray(turn, float))
    pose[:3, 3] += np.asarray(move, float)
    scene.camera.to_world = pose
    return scene


METAL = ("materials.glaze.base_color", "materials.glaze.metallic", "materials.glaze.roughness")
BULB = ("lights.bulb.position", "lights.bulb.power", "lights.bulb.radius")


def _metal(color: ArrayLike, metallic: float, roughness: float) -> Callable[[], Scene]:
    values = dict(zip(METAL, (np.asarray(color, float), metallic, roughness), strict=True))
    return lambda: still_life(**{path.replace(".", "/"): value for path, value in values.items()})


def _bulb(position: ArrayLike, power: float, radius: float) -> Callable[[], Scene]:
    values = dict(zip(BULB, (np.asarray(position, float), power, radius), strict=True))
    return lambda: still_life(**{path.replace(".", "/"): value for path, value in values.items()})


RECOVERIES: dict[str, Recovery] = {
    "shadow": Recovery(
        "shape and place of a thing outside the frame, from its shadow",
        lambda: shadow_of(blade(0.25, 0.6)),
        {
            "right": lambda: shadow_of(blade(0.0, 0.5, (0.5, 0.3))),
            "left, small": lambda: shadow_of(blade(0.0, 0.35, (-0.5, -0.1))),
            "front, large, low": lambda: shadow_of(blade(0.0, 0.65, (0.1, -0.4), 1.35)),
        },
        ("meshes.thing.vertices",),
        shadow_error,
        0.12,
        {"iterations": 150, "spp": 8},
    ),
    "reflection": Recovery(
        "shape of a thing outside the frame, from its reflection in rough metal",
        lambda: reflection_of((0.0, 2.2, 1.1), (0.75, 0.5, 0.5)),
        {
            "round": lambda: reflection_of((0.0, 2.2, 1.1), (0.5, 0.5, 0.5)),
            "left": lambda: reflection_of((-0.4, 2.2, 1.15), (0.5, 0.5, 0.5)),
            "right, flat": lambda: reflection_of((0.35, 2.2, 1.1), (0.6, 0.5, 0.4)),
        },
        ("meshes.thing.vertices",),
        outline_error,
        0.4,
        {"iterations": 100, "spp": 32, "max_depth": 3},
    ),
    "metal": Recovery(
        "base colour, metallic and roughness of a surface",
        still_life,
        {
            "grey, rough": _metal((0.5, 0.5, 0.5), 0.2, 0.7),
            "blue, smooth": _metal((0.3, 0.4, 0.7), 0.9, 0.2),
            "white, dull": _metal((0.9, 0.9, 0.9), 0.5, 0.9),
        },
        METAL,
        value_error(*METAL),
        0.2,
        {"iterations": 120, "spp": 16, "max_depth": 3},
    ),
    "lamp": Recovery(
        "place, power and size of a lamp",
        still_life,
        {
            "left, weak": _bulb((0.8, -1.1, 1.1), 8.0, 0.25),
            "low, strong": _bulb((1.3, -0.5, 0.6), 25.0, 0.1),
            "right, large": _bulb((1.4, -1.0, 1.0), 15.0, 0.3),
        },
        BULB,
        value_error(*BULB, scales=(0.5, 15.0, 0.3)),
        0.1,
        {"iterations": 150, "spp": 16, "max_depth": 3},
    ),
    "texture": Recovery(
        "a floor's texture",
        still_life,
        {
            "grey": lambda: still_life(**{"images/checks/pixels": np.full((8, 8, 3), 0.5, np.float32)}),
            "black": lambda: still_life(**{"images/checks/pixels": np.full((8, 8, 3), 0.05, np.float32)}),
            "noise": lambda: still_life(
                **{"images/checks/pixels": np.random.default_rng(1).random((8, 8, 3), np.float32)}
            ),
        },
        ("images.checks.pixels",),
        texel_error,
        0.15,
        # From black, texels go further than usual first steps lead.
        {"iterations": 150, "spp": 16, "max_depth": 3, "step_sizes": {"images.checks.pixels": 0.1}},
    ),
    "camera": Recovery(
        "where the camera stood and how it was held",
        still_life,
        {
            "left": lambda: camera_moved(still_life(), (-0.4, 0.2, 0.1), (0.0, -0.05, 0.05)),
            "near, high": lambda: camera_moved(still_life(), (0.0, 0.6, 0.3), (-0.08, 0.0, 0.0)),
            "rolled": lambda: camera_moved(still_life(), (0.2, 0.0, -0.2), (0.02, 0.04, 0.15)),
        },
        ("camera.to_world",),
        value_error("camera.to_world"),
        0.35,
        {"iterations": 100, "spp": 16, "max_depth": 3},
    ),
}


@dataclass(frozen=True)
class Found:
    """What a search came to: errors before and after, and pictures."""

    error_before: float
    error: float
    before: NDArray[np.float32]
    target: NDArray[np.float32]
    after: NDArray[np.float32]
    result: FitResult


def lost_and_found(
    recovery: Recovery, start: str, *, threads: int = 0, progress: Callable[[float], None] | None = None
) -> Found:
    """Search from one of the starts."""
    truth, scene = recovery.truth(), recovery.starts[start]()
    depth = recovery.options.get("max_depth", 2)
    target = render(truth, spp=TARGET_SPP, max_depth=depth, seed=12345, threads=threads)
    before = render(scene, spp=TARGET_SPP, max_depth=depth, threads=threads)
    error = recovery.error(scene, truth)
    result = fit(scene, target, recovery.wrt, threads=threads, progress=progress, **recovery.options)
    after = render(scene, spp=TARGET_SPP, max_depth=depth, threads=threads)
    return Found(error, recovery.error(scene, truth), before, target, after, result)
