"""What makes numbers hard, as families of scenes from harmless to extreme, and the error of the derivatives of each.

Every error is relative to a truth that is known exactly: the area that a triangle covers (`coverage`), that nothing
changes where everything moves with the camera, that pictures are linear in radiance, that gradients scale with the
world. It is given with its standard error over seeds where the truth is one of the mean.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import edgegrad
from edgegrad import Camera, Material, Mesh, PointLight, Renderer, Scene, SunLight, World
from tests.stability import coverage
from tests.support.scenes.turned_box import build, geometry
from tests.support.small_scenes import camera, glowing, matte, rectangle

F64 = NDArray[np.float64]
Error = tuple[float, float]


@dataclass(frozen=True)
class Stress:
    """A family of scenes.

    Attributes
    ----------
    name, unit
        What is varied, in words.
    values
        From the most harmless to the hardest.
    error
        Relative error of the derivatives at a value, and its standard error.
    truth
        What they are compared with, in words.
    rounding
        Error that single precision explains, at a value.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    error: Callable[[float], Error]
    truth: str
    rounding: Callable[[float], float] = lambda value: 1e-5


SEEDS = 32
EYE = camera(size=8, fov=0.7)
# Weights of the pixels in sums over the picture.
WEIGHTS = np.random.default_rng(7).uniform(0.5, 1.5, (8, 8))


def relative(found: Iterable[F64], exact: F64, size: float = 0.0) -> Error:
    """Error of the mean over seeds and its standard error, relative to `size` or else the exact gradient."""
    samples = np.array(list(found))
    size = size or float(np.linalg.norm(exact))
    noise = float(np.sqrt(samples.var(axis=0, ddof=1).sum() / len(samples)))
    return float(np.linalg.norm(samples.mean(axis=0) - exact)) / size, noise / size


# ---------------------------------------------------------------- the area of emissive triangles
def covered(corners: F64, view: Camera = EYE) -> Error:
    """A lone emissive triangle, of corners that single precision holds."""
    corners = np.round(corners * 2.0**21) / 2.0**21
    mesh = Mesh(corners, np.array([[0, 1, 2]]), ("lamp",))
    scene = Scene(view, {"triangle": mesh}, {"lamp": glowing(1.0, True)})
    renderer = Renderer(scene, threads=1)
    adjoint, path = np.repeat(WEIGHTS[..., None], 3, axis=2) / 3.0, "meshes.triangle.vertices"
    found = (renderer.render_backward(adjoint, [path], spp=64, max_depth=1, seed=k)[path] for k in range(SEEDS))
    return relative(found, coverage.gradient(view, corners, WEIGHTS))


def needle(aspect: float) -> Error:
    return covered(np.array([[-0.875, -0.5, 0.25], [0.75, 0.625, -0.125], [0.75, 0.625 + 2.0 / aspect, -0.125]]))


def grazing_view(angle: float) -> Error:
    """A face nearly edge-on, whose plane passes the camera at that angle."""
    eye, a, b = np.array([0.0, 0.0, 4.0]), np.array([-0.75, -0.5, 1.0]), np.array([0.625, -0.625, 0.5])
    normal = np.cross(a - eye, b - eye)
    c = eye + 0.75 * (a - eye) + 0.5 * (b - eye) + angle * normal / np.linalg.norm(normal)
    return covered(np.array([a, b, c]))


def end_on(angle: float) -> Error:
    """An edge that points at the camera."""
    a, eye = np.array([0.25, 0.375, 1.0]), np.array([0.0, 0.0, 4.0])
    b = a + 0.75 * (a - eye) + angle * np.array([0.5, -0.5, 0.0])
    return covered(np.array([a, b, [-0.625, -0.5, 0.5]]))


def past_the_camera(distance: float) -> Error:
    """An edge from the front of the camera to its back, which passes it farther away than the clip distance."""
    corners = np.array([[0.5, 0.25, -1.0], [-0.5, -0.25 - 2.0 * distance, 9.0], [0.75, -0.5, -2.0]])
    return covered(corners, replace(EYE, clip_start=0.1 * distance))


def stacked(gap: float) -> Error:
    """A glowing triangle before a larger one of another radiance, at a distance."""
    front = np.array([[-0.5, -0.375, gap], [0.5, -0.25, gap], [0.125, 0.5, gap]])
    back = np.array([[-1.0, -1.0, 0.0], [1.25, -1.0, 0.0], [0.0, 1.25, 0.0]])
    meshes = {name: Mesh(corners, np.array([[0, 1, 2]]), (name,)) for name, corners in (("f", front), ("b", back))}
    scene = Scene(EYE, meshes, {"f": glowing(3.0, True), "b": glowing(1.0, True)})
    renderer = Renderer(scene, threads=1)
    adjoint, path = np.repeat(WEIGHTS[..., None], 3, axis=2) / 3.0, "meshes.f.vertices"
    found = (renderer.render_backward(adjoint, [path], spp=64, max_depth=1, seed=k)[path] for k in range(SEEDS))
    return relative(found, 2.0 * coverage.gradient(EYE, front, WEIGHTS))


def crowded(edges: float) -> Error:
    """As many edges in one pixel, of triangles side by side; the gradient of moving and stretching them all.

    It is a sum of parts of both signs, to whose sizes the error is relative.
    """
    side = max(1, round((edges / 3) ** 0.5))
    view = camera(size=3, fov=0.7)
    step = 1.0 / side
    x, y = (a.ravel() for a in np.meshgrid(*[(np.arange(side) + 0.1) * step - 0.5] * 2))
    offsets = step * np.array([[0.0, 0.0], [0.8, 0.0], [0.0, 0.8]])
    width = 4.0 / view.focal  # of a pixel in the plane z = 0
    corners = np.stack([np.stack([x + dx, y + dy, 0.0 * x], 1) for dx, dy in offsets], axis=1) * width
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    scene = Scene(view, {"dust": Mesh(corners.reshape(-1, 3), faces, ("lamp",))}, {"lamp": glowing(1.0, True)})
    renderer = Renderer(scene, threads=1)
    path = "meshes.dust.vertices"
    # The fields x / width, y / width and 1 over the vertices.
    fields = np.concatenate([corners.reshape(-1, 3)[:, :2] / width, np.ones((3 * len(corners), 1))], axis=1)

    def total(seed: int) -> F64:
        adjoint = np.full((3, 3, 3), 1.0 / 3.0)
        return np.asarray(fields.T @ renderer.render_backward(adjoint, [path], spp=1024, max_depth=1, seed=seed)[path])

    def size(moved: F64) -> F64:
        screen = view.focal * moved[..., :2] / (4.0 - moved[..., 2:])
        a, b = screen[:, 1] - screen[:, 0], screen[:, 2] - screen[:, 0]
        return np.asarray(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2.0)

    exact, h = np.zeros(corners.shape), 1e-7 * width
    for k in np.ndindex(3, 3):
        unit = np.zeros((3, 3))
        unit[k] = h
        exact[:, k[0], k[1]] = (size(corners + unit) - size(corners - unit)) / (2.0 * h)
    exact = exact.reshape(-1, 3)
    parts = float(np.linalg.norm(np.abs(fields).T @ np.abs(exact)))
    return relative((total(k) for k in range(SEEDS)), fields.T @ exact, parts)


def copies(count: float) -> Error:
    """A face that the mesh has several times."""
    corners = np.array([[-0.875, -0.5, 0.25], [0.75, -0.625, -0.125], [0.125, 0.75, 0.0]])
    faces = np.tile([[0, 1, 2], [2, 1, 0]], (int(count), 1))[: int(count)]
    scene = Scene(EYE, {"triangle": Mesh(corners, faces, ("lamp",))}, {"lamp": glowing(1.0, True)})
    renderer = Renderer(scene, threads=1)
    adjoint, path = np.repeat(WEIGHTS[..., None], 3, axis=2) / 3.0, "meshes.triangle.vertices"
    found = (renderer.render_backward(adjoint, [path], spp=64, max_depth=1, seed=k)[path] for k in range(SEEDS))
    return relative(found, coverage.gradient(EYE, corners, WEIGHTS))


# ---------------------------------------------------------------- worlds of any size, anywhere
LENGTHS = ("meshes.box.vertices", "meshes.floor.vertices", "lights.point.position")
PATHS = (*LENGTHS, "materials.clay.base_color", "lights.key.power")


def world_gradients(scale: float, shift: float, seed: int) -> list[F64]:
    """Gradients of a lit box over a floor, in units of the unscaled world."""
    body, faces, floor, floor_faces = geometry()
    scene = build((body, faces), (floor, floor_faces), scale=scale, shift=shift)
    adjoint = np.random.default_rng(2).uniform(0.5, 1.5, (*scene.camera.size, 3))
    found = Renderer(scene, threads=1).render_backward(adjoint, PATHS, spp=16, seed=seed)
    units = [*[scale] * len(LENGTHS), 1.0, scale**2]
    return [found[path] * unit for path, unit in zip(PATHS, units, strict=True)]


def placed(scale: float, shift: float) -> Error:
    """Largest error of a parameter's gradient, for equal random numbers."""
    plain, there = world_gradients(1.0, 0.0, 0), world_gradients(scale, shift, 0)
    pairs = zip(plain, there, strict=True)
    return max(float(np.linalg.norm(other - one) / np.linalg.norm(one)) for one, other in pairs), 0.0


# ---------------------------------------------------------------- lights
def together(scene: Scene, lengths: Iterable[str]) -> Error:
    """The derivative by a common motion of all objects, relative to the largest derivative by one object."""
    renderer = Renderer(scene, threads=1)
    shift = np.array([0.5, 0.25, -0.75])
    options: dict[str, Any] = {"spp": 16, "seed": 3}
    tangents = {path: np.broadcast_to(shift, np.shape(edgegrad.parameters.get(scene, path))) for path in lengths}
    pose = np.zeros((4, 4))
    pose[:3, 3] = shift
    tangents["camera.to_world"] = pose
    parts = [renderer.render_forward({path: value}, **options) for path, value in tangents.items()]
    whole = renderer.render_forward(tangents, **options)
    return float(np.linalg.norm(whole)) / max(float(np.linalg.norm(part)) for part in parts), 0.0


def lit(light: PointLight | SunLight) -> Scene:
    """A card over a floor under a light, both seen from above."""
    meshes = {
        "floor": rectangle((0, 0, 0), (0, 0, 2), (2, 0, 0), "clay"),
        "card": rectangle((0.25, 0.5, 0.125), (0.5, 0.0, 0.125), (0.125, 0.25, 0.5), "clay"),
    }
    return Scene(camera((0.0, 3.0, 3.0), size=16), meshes, {"clay": matte(0.6, 0.5, 0.4)}, {"light": light})


MOVING = ("meshes.floor.vertices", "meshes.card.vertices")


def touching_light(distance: float) -> Error:
    return together(lit(PointLight(np.array([-0.5, distance, 0.25]), 10.0)), (*MOVING, "lights.light.position"))


def grazing_light(angle: float) -> Error:
    return together(lit(SunLight(np.array([1.0, -angle, 0.25]), 1.0 / angle)), MOVING)


def bright(radiance: float) -> Error:
    """A box whose material glows and which lights a floor: gradients are linear in its radiance."""
    def gradient(size: float) -> F64:
        scene = lit(SunLight(np.array([0.0, -1.0, 0.0]), 0.0))
        scene.materials = {**scene.materials, "lamp": Material(np.full(3, 0.5), np.full(3, size))}
        scene.meshes["card"].materials = ("lamp",)
        scene.world = World(np.full(3, size))
        adjoint = np.random.default_rng(5).uniform(0.5, 1.5, (16, 16, 3))
        found = Renderer(scene, threads=1).render_backward(adjoint, MOVING, spp=16, seed=1)
        return np.concatenate([found[path] / size for path in MOVING])

    plain = gradient(1.0)
    return float(np.linalg.norm(gradient(radiance) - plain) / np.linalg.norm(plain)), 0.0


def powers(base: float, first: int, last: int) -> tuple[float, ...]:
    """base^first ... base^last."""
    step = 1 if last >= first else -1
    return tuple(base**k for k in range(first, last + step, step))


AREA, RIGID = "area that the triangle covers", "zero, as all moves together"
PLAIN = "gradient of the plain world"


def of_a_sample(value: float) -> float:
    """Of some ten thousand samples, one or another may be decided by rounding."""
    return 1e-3


STRESSES = (
    # Powers of two scale numbers without rounding, which would break ties in the tree of edges in another way: then
    # other samples are taken.
    Stress("large worlds", "metres", powers(8.0, 0, 5), lambda s: placed(s, 0.0), PLAIN, of_a_sample),
    Stress("small worlds", "metres", powers(0.125, 0, 4), lambda s: placed(s, 0.0), PLAIN, of_a_sample),
    Stress("distance from the origin", "metres", (1.0, 10.0, 1e2, 1e3, 1e4, 1e5), lambda d: placed(1.0, d), PLAIN,
           of_a_sample),
    Stress("needles", "aspect", powers(4.0, 1, 10), needle, AREA),
    Stress("faces edge-on", "radians", powers(0.125, 1, 7), grazing_view, AREA),
    Stress("edges end-on", "radians", powers(0.125, 1, 6), end_on, AREA),
    Stress("edges past the camera", "metres", powers(0.125, 0, 6), past_the_camera, AREA,
           # Corners are up to 8 m away, which floats hold to half of 2^-20.
           lambda distance: 2.0**-21 / distance),
    Stress("nearly coplanar faces", "metres", powers(0.125, 1, 6), stacked, AREA),
    Stress("copies of a face", "faces", (1.0, 2.0, 3.0, 4.0), copies, AREA),
    Stress("edges in a pixel", "edges", (3.0, 12.0, 108.0, 1008.0, 10092.0), crowded, AREA),
    Stress("light close to a surface", "metres", powers(0.1, 0, 6), touching_light, RIGID),
    Stress("grazing light", "radians", powers(0.1, 0, 6), grazing_light, RIGID),
    Stress("bright light", "radiance", powers(1e5, 0, 6), bright, "linear in radiance"),
    Stress("dim light", "radiance", (1.0, 1e-10, 1e-20, 1e-30, 1e-38), bright, "linear in radiance",
           # Floats hold samples of a ten thousandth of the radiance in steps of 2^-149.
           lambda radiance: 1e-5 + 1e4 * 2.0**-149 / radiance),
)
