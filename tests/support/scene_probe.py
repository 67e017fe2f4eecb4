"""Derivatives of shading code that reads the scene, beside differences: surfaces, normal maps, camera, lights."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Camera, Material, Mesh, Scene, World, _native
from edgegrad import expression as e
from edgegrad.tables.lights import AXIS_X, AXIS_Y, EDGE, EDGE_SCALE, SHINES_TO, SMOOTH_CONE
from edgegrad.tables.lights import WIDTH as LIGHT_WIDTH
from edgegrad.tables.textures.program import compile_textures
from tests.support.differences import check_derivative

DOT_PRODUCT = 1e-5  # relative: both sweeps have the rounding of single precision


def units(rng: np.random.Generator, n: int, upper: bool = True) -> NDArray[np.float32]:
    """Directions, those of the upper hemisphere not below 20 degrees."""
    v = rng.normal(size=(n, 3))
    if upper:
        v[:, 2] = np.abs(v[:, 2]) + 0.4 * np.linalg.norm(v[:, :2], axis=1)
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True), np.float32)


F64 = NDArray[np.float64]

SURFACE, BENT_NORMAL, CAMERA, ENVIRONMENT, LIGHT = range(5)
TABLES = (
    "vertices", "normals", "instance_to_world", "light_params", "environment_pixels", "attributes", "environment",
    "environment_rotation", "camera", "a", "b",
)  # fmt: skip
PERSPECTIVE, ORTHOGRAPHIC, EQUIRECTANGULAR, EQUISOLID, EQUIDISTANT, POLYNOMIAL = range(6)
POINTS = 200
FACES = 24
APERTURE = 26  # place of its radius in the camera's row
# Rotation of other axes.
ROTATION = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def normal_mapped(faces: NDArray[np.int32], vertices: F64, tangents: bool) -> Any:
    """Texture tables of a material with a normal map, on a mesh of the given UV map, or of tangents by corner."""
    rng = np.random.default_rng(1)
    n = len(faces)
    uv = (vertices[faces][..., :2] + 0.1 * rng.normal(size=(n, 3, 2))).astype(np.float32)
    attributes = {"uv": uv}
    if tangents:
        along = np.concatenate([rng.normal(size=(n, 3, 3)) + (2.0, 0.0, 0.0), np.ones((n, 3, 1))], axis=2)
        attributes["uv.tangent"] = along.astype(np.float32)
    mesh = Mesh(vertices, faces, ("m",), attributes=attributes)
    material = Material(normal_uv="uv", textures={"normal": e.Attribute("uv")})
    scene = Scene(Camera(np.eye(4)), {"mesh": mesh}, {"m": material}, {}, World())
    return compile_textures(scene)


class Probe:
    """Arrays of a scene and of points in it: the given ones, and random values for all others."""

    def __init__(self, kind: int, *, smooth: bool = True, instances: bool = False, tangents: bool = False,
                 camera: int = PERSPECTIVE, lens: float = 0.0, blades: int = 0, image: bool = True,
                 flags: int = 0) -> None:  # fmt: skip
        rng = np.random.default_rng(9)
        self.kind = kind
        corners = rng.normal(size=(FACES, 1, 3)) + np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        vertices = (corners + 0.15 * rng.normal(size=(FACES, 3, 3))).reshape(-1, 3)
        faces = np.arange(3 * FACES, dtype=np.int32).reshape(-1, 3)
        matrix = 1.3 * ROTATION @ np.diag([1.0, -1.0, 1.0]) + 0.1 * rng.normal(size=(2, 3, 3))
        row = np.concatenate([
            rng.normal(size=3), *ROTATION, [120.0, 1.1, 31.0, 17.0], [-2.5, 2.7, -1.2, 1.3],
            [0.01, 1.1, 0.2, -0.1, 0.05, 90.0], [lens, 3.0, 0.4, 1.2],
        ])  # fmt: skip
        lights = rng.uniform(0.3, 1.0, (6, LIGHT_WIDTH))
        lights[:, AXIS_X], lights[:, AXIS_Y], lights[:, SHINES_TO] = ROTATION[0], ROTATION[1], -ROTATION[2]
        lights[:, EDGE] = 0.5 if flags & SMOOTH_CONE else 1.2
        lights[:, EDGE_SCALE] = 0.9
        self.scene = SimpleNamespace(
            vertices=vertices, faces=faces, face_material=np.zeros(FACES, np.int32),
            corner_normal=faces if smooth else np.zeros((0, 3), np.int32),
            normals=units(rng, 3 * FACES) + 0.0,
            instance_to_world=np.concatenate([matrix, rng.normal(size=(2, 3, 1))], axis=2).reshape(2, 12),
            light_params=lights, light_flags=np.full(6, flags, np.int32),
            environment_pixels=rng.uniform(0.2, 1.0, (7 * 12 * 3 if image else 0)),
            environment_size=np.array([12, 7], np.int32), environment=rng.uniform(0.5, 1.0, 3),
            environment_rotation=ROTATION, camera=row,
            camera_sizes=np.array([camera, 64, 32, 3, 2, blades], np.int32),
            textures=normal_mapped(faces, vertices, tangents))  # fmt: skip
        a = np.stack([rng.uniform(0.1, 0.45, POINTS), rng.uniform(0.1, 0.45, POINTS), rng.uniform(0.5, 0.9, POINTS)], 1)
        b = rng.normal(size=(POINTS, 3))
        if kind == BENT_NORMAL:
            b = rng.uniform(0.2, 0.8, (POINTS, 3))
        elif kind == CAMERA:
            a = rng.uniform(1.0, 30.0, (POINTS, 3))
            b = rng.uniform(0.1, 0.9, (POINTS, 3))
        elif kind == LIGHT:
            b = units(rng, POINTS) @ ROTATION
        index = rng.integers(0, 6 if kind == LIGHT else FACES, POINTS)
        self.points = SimpleNamespace(a=a, b=b, index=index.astype(np.int32), instance=np.full(POINTS, -1, np.int32))
        if instances:
            self.points.instance[:] = rng.integers(-1, 2, POINTS)
        for holder in (self.scene, self.points):
            for name in TABLES:
                if hasattr(holder, name):
                    setattr(holder, name, np.ascontiguousarray(getattr(holder, name), np.float32))

    def table(self, name: str) -> NDArray[np.float32]:
        holder = self.points if name in ("a", "b") else self.scene.textures if name == "attributes" else self.scene
        return np.asarray(getattr(holder, name))

    def tangents(self, **given: F64) -> SimpleNamespace:
        return SimpleNamespace(**{name: given.get(name, np.zeros(self.table(name).size)) for name in TABLES})

    def along(self, tangents: SimpleNamespace, h: float) -> F64:
        """(n, 9) values where all tables have moved by h times the tangents."""
        scene, where = SimpleNamespace(**vars(self.scene)), SimpleNamespace(**vars(self.points))
        scene.textures = SimpleNamespace(**vars(scene.textures))
        for name in TABLES:
            holder = where if name in ("a", "b") else scene.textures if name == "attributes" else scene
            v = getattr(holder, name)
            setattr(holder, name, (v + h * getattr(tangents, name).reshape(v.shape)).astype(np.float32))
        value, _ = _native.scene_probe_forward(self.kind, scene, where, self.tangents(), "")
        return np.asarray(value, float)

    def forward(self, tangents: SimpleNamespace, instruction_set: str = "") -> F64:
        _, tangent = _native.scene_probe_forward(self.kind, self.scene, self.points, tangents, instruction_set)
        return np.asarray(tangent, float)

    def check(self, names: tuple[str, ...], step: float = 1e-3) -> None:
        """Both sweeps, and differences by each of the tables named; the others have no derivative."""
        rng = np.random.default_rng(3)
        adjoint = rng.normal(size=(POINTS, 9)).astype(np.float32)
        gradients = _native.scene_probe_backward(self.kind, self.scene, self.points, adjoint, "")
        for name in TABLES:
            size = self.table(name).size
            if name not in names:
                assert not np.any(gradients[name]), name
                continue
            direction = rng.choice([-1.0, 1.0], size)
            if name == "camera" and self.scene.camera[APERTURE] == 0.0:
                direction[APERTURE:] = 0.0  # a pinhole has no lens to change
            tangents = self.tangents(**{name: direction})
            found = self.forward(tangents)
            assert np.any(found), name
            terms, pulled = adjoint * found, gradients[name] * direction
            size_of_sum = np.sum(np.abs(terms)) + np.sum(np.abs(pulled))
            assert abs(np.sum(terms) - np.sum(pulled)) <= DOT_PRODUCT * size_of_sum, name
            decided = check_derivative(found, partial(self.along, tangents), step)
            assert decided > 0.6, name
        for instruction_set in _native.instruction_sets():
            tangents = self.tangents(**{name: np.ones(self.table(name).size) for name in names})
            same = self.forward(tangents)
            error = np.abs(self.forward(tangents, instruction_set) - same)
            assert np.mean(error > 1e-4 * np.abs(same) + 1e-4 * np.sqrt(np.mean(same**2))) < 0.01
