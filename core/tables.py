"""The scene as flat tables: what both engines read, and the one place that maps derivatives to parameters.

`flatten` turns a `Scene` into `Tables`. The tables' values that engines differentiate are gathered in
`Derivative`; `push_forward` carries a tangent of scene parameters to the tables (forward mode) and
`pull_back` carries gradients of the tables back to the parameters (reverse mode). The two are each
other's transpose.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import parameters, topology
from .camera import Camera
from .light import AreaLight, PointLight, SunLight
from .scene import Scene

F32 = NDArray[np.float32]

# An elliptic light is a polygon of this many sides with the ellipse's area.
ELLIPSE_SIDES = 64


@dataclass
class Derivative:
    """A tangent of, or a gradient with respect to, the differentiable tables; shapes as in `Tables`."""

    vertices: NDArray[np.float64]
    albedo: NDArray[np.float64]
    emission: NDArray[np.float64]
    point_intensity: NDArray[np.float64]
    sun_irradiance: NDArray[np.float64]
    environment: NDArray[np.float64]


@dataclass
class Asked:
    """Which derivatives a call is asked for; the rest is skipped."""

    moving: NDArray[np.uint8]  # (S,) 1: the mesh's vertices
    emitting: NDArray[np.uint8]  # (M,) 1: the material's emission
    colors: bool = False  # any colour, radiance or intensity at all
    lights: bool = False  # the strength of any point light or sun
    environment: bool = False


@dataclass
class Tables:
    """A scene as arrays. V vertices, F faces, S meshes (area lights included, last), M materials.

    World positions are relative to `origin`, so that float32 keeps its precision far from the
    world's origin.
    """

    origin: NDArray[np.float64]  # (3,)
    vertices: F32  # (V, 3) relative to origin
    faces: NDArray[np.uint32]  # (F, 3) into vertices
    face_material: NDArray[np.int32]  # (F,)
    mesh_first_vertex: NDArray[np.int64]  # (S + 1,)
    mesh_first_face: NDArray[np.int64]  # (S + 1,)
    mesh_names: tuple[str, ...]  # of the scene's meshes; the area lights' meshes have none
    visible: NDArray[np.uint8]  # (S,) 1: rays hit it; 0: an area light, which only gives light
    albedo: F32  # (M, 3)
    emission: F32  # (M, 3)
    emission_two_sided: NDArray[np.uint8]  # (M,)
    point_position: F32  # (P, 3) relative to origin
    point_intensity: F32  # (P, 3) W/sr
    sun_direction: F32  # (D, 3) unit, direction of travel
    sun_irradiance: F32  # (D, 3)
    environment: F32  # (3,) radiance
    camera_position: F32  # (3,) relative to origin
    camera_axes: F32  # (3, 3) rows: right X, up Y, backwards Z
    focal: float  # pixels
    principal_point: F32  # (2,) pixels
    width: int
    height: int
    clip_start: float
    clip_end: float

    def zero_derivative(self) -> Derivative:
        """A `Derivative` of zeros."""
        return Derivative(**{f.name: np.zeros(getattr(self, f.name).shape) for f in fields(Derivative)})

    def same_geometry(self, other: Tables) -> bool:
        """Whether meshes, their vertices and their materials' slots are the same as in other tables."""
        names = ("origin", "vertices", "faces", "face_material", "mesh_first_vertex", "mesh_first_face", "visible")
        return self.mesh_names == other.mesh_names and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in names
        )

    def edges(self) -> topology.Edges:
        """Edges of all meshes that rays can hit, area lights left out."""
        parts = []
        for k in range(len(self.mesh_names)):
            v = slice(self.mesh_first_vertex[k], self.mesh_first_vertex[k + 1])
            f = slice(self.mesh_first_face[k], self.mesh_first_face[k + 1])
            faces = self.faces[f].astype(np.int64) - self.mesh_first_vertex[k]
            parts.append(topology.edges(faces.astype(np.int32), topology.weld(self.vertices[v].astype(np.float64))))
        return topology.join(parts, self.mesh_first_vertex, self.mesh_first_face)


def camera_fields(camera: Camera, origin: NDArray[np.float64]) -> dict[str, Any]:
    """The fields of `Tables` that depend on the camera."""
    return {
        "camera_position": (camera.to_world[:3, 3] - origin).astype(np.float32),
        "camera_axes": np.ascontiguousarray(camera.to_world[:3, :3].T, np.float32),
        "focal": camera.focal,
        "principal_point": camera.principal_point.astype(np.float32),
        "width": camera.width,
        "height": camera.height,
        "clip_start": camera.clip_start,
        "clip_end": camera.clip_end,
    }


def flatten(scene: Scene, origin: NDArray[np.float64] | None = None) -> Tables:
    """Tables of a scene, relative to `origin` (None: the centre of its bounding box).

    Raises ``ValueError`` as `Scene.validate` does.
    """
    scene.validate()
    material_index = {name: k for k, name in enumerate(scene.materials)}
    area_lights = [light for light in scene.lights.values() if isinstance(light, AreaLight)]
    points = [light for light in scene.lights.values() if isinstance(light, PointLight)]
    suns = [light for light in scene.lights.values() if isinstance(light, SunLight)]

    vertices = [mesh.vertices for mesh in scene.meshes.values()]
    faces = [mesh.faces for mesh in scene.meshes.values()]
    slots = []
    for mesh in scene.meshes.values():
        slot = np.array([material_index[name] for name in mesh.materials], np.int32)
        used = np.zeros(len(mesh.faces), np.int32) if mesh.face_material is None else mesh.face_material
        slots.append(slot[used])
    for k, light in enumerate(area_lights):
        light_vertices, light_faces = _area_light_mesh(light)
        vertices.append(light_vertices)
        faces.append(light_faces)
        slots.append(np.full(len(light_faces), len(scene.materials) + k, np.int32))

    first_vertex = np.cumsum([0] + [len(v) for v in vertices])
    first_face = np.cumsum([0] + [len(f) for f in faces])
    stacked = np.concatenate(vertices) if vertices else np.zeros((0, 3))
    if origin is None:
        origin = 0.5 * (stacked.min(axis=0) + stacked.max(axis=0)) if len(stacked) else np.zeros(3)
    materials = list(scene.materials.values())
    sun_directions = [light.direction / np.linalg.norm(light.direction) for light in suns]
    return Tables(
        origin=origin,
        vertices=(stacked - origin).astype(np.float32),
        faces=_rows([f.astype(np.int64) + v for f, v in zip(faces, first_vertex, strict=False)], np.uint32),
        face_material=np.concatenate(slots) if slots else np.zeros(0, np.int32),
        mesh_first_vertex=first_vertex,
        mesh_first_face=first_face,
        mesh_names=tuple(scene.meshes),
        visible=np.array([1] * len(scene.meshes) + [0] * len(area_lights), np.uint8),
        albedo=_rows([m.base_color for m in materials] + [np.zeros(3)] * len(area_lights)),
        emission=_rows([m.emission for m in materials] + [_area_radiance(a) for a in area_lights]),
        emission_two_sided=np.array([m.emission_two_sided for m in materials] + [False] * len(area_lights), np.uint8),
        point_position=_rows([p.position - origin for p in points]),
        point_intensity=_rows([p.power * p.color / (4.0 * np.pi) for p in points]),
        sun_direction=_rows(sun_directions),
        sun_irradiance=_rows([s.strength * s.color for s in suns]),
        environment=(scene.world.color * scene.world.strength).astype(np.float32),
        **camera_fields(scene.camera, origin),
    )


def _rows(rows: list[Any], dtype: Any = np.float32) -> NDArray[Any]:
    """Rows of three stacked into one (n, 3) array, also when there are none."""
    return np.ascontiguousarray(np.concatenate([np.reshape(r, (-1, 3)) for r in rows]) if rows
                                else np.zeros((0, 3)), dtype)


def _area_light_mesh(light: AreaLight) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices and faces of the flat emitter, facing along the light's -Z."""
    if light.shape == "RECTANGLE":
        flat = np.array([[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]])  # clockwise seen from +Z
    else:
        angle = -2.0 * np.pi * np.arange(ELLIPSE_SIDES) / ELLIPSE_SIDES
        # The polygon's area is n/2 sin(2 pi/n) r^2: this radius makes it that of the ellipse.
        radius = 0.5 * np.sqrt(np.pi / (0.5 * ELLIPSE_SIDES * np.sin(2.0 * np.pi / ELLIPSE_SIDES)))
        flat = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    local = np.concatenate([flat * light.size, np.zeros((len(flat), 1))], axis=1)
    fan = np.arange(1, len(flat) - 1, dtype=np.int32)
    faces = np.stack([np.zeros_like(fan), fan, fan + 1], axis=1)
    return local @ light.to_world[:3, :3].T + light.to_world[:3, 3], faces


def area(light: AreaLight) -> float:
    """Emitting area, m²."""
    full = float(light.size[0] * light.size[1])
    return full if light.shape == "RECTANGLE" else full * np.pi / 4.0


def _area_radiance(light: AreaLight) -> NDArray[np.float64]:
    """Radiance of a Lambertian one-sided emitter of this power: P / (pi A)."""
    return light.power * light.color / (np.pi * area(light))


def push_forward(scene: Scene, tables: Tables, tangent: Mapping[str, Any]) -> Derivative:
    """Tangent of the tables along a tangent of the scene's parameters.

    Parameters
    ----------
    tangent
        Parameter path to an array of the parameter's shape.

    Raises
    ------
    ValueError
        For an unknown path, one that has no derivative, or an array of another shape.
    """
    out = tables.zero_derivative()
    for path, value in tangent.items():
        shape = np.shape(parameters.get(scene, path))
        dv = np.asarray(value, np.float64)
        if dv.shape != shape:
            raise ValueError(f"tangent of '{path}' must have the shape {shape}, not {dv.shape}")
        if not np.isfinite(dv).all():
            raise ValueError(f"tangent of '{path}' has non-finite values")
        for name, rows, factor in _dependents(scene, tables, path):
            getattr(out, name)[rows] += factor * dv
    return out


def pull_back(scene: Scene, tables: Tables, gradient: Derivative, wrt: Iterable[str]) -> dict[str, NDArray[np.float64]]:
    """Gradients of the asked parameters from gradients of the tables (the transpose of `push_forward`)."""
    out = {}
    for path in wrt:
        value = np.asarray(parameters.get(scene, path), np.float64)
        total = np.zeros(value.shape)
        for name, rows, factor in _dependents(scene, tables, path):
            part = factor * getattr(gradient, name)[rows]
            total += part if part.shape == value.shape else part.sum()
        out[path] = total
    return out


def asked(scene: Scene, tables: Tables, wrt: Iterable[str]) -> Asked:
    """Which tables the parameters `wrt` reach.

    Raises
    ------
    ValueError
        For an unknown path, or one that has no derivative.
    """
    out = Asked(np.zeros(len(tables.visible), np.uint8), np.zeros(len(tables.albedo), np.uint8))
    for path in wrt:
        parameters.get(scene, path)
        for name, rows, _ in _dependents(scene, tables, path):
            if name == "vertices":
                out.moving[tables.mesh_names.index(parameters.split(path)[1])] = 1
            else:
                out.colors = True
            if name == "emission":
                out.emitting[rows] = 1
            out.lights |= name in ("point_intensity", "sun_irradiance")
            out.environment |= name == "environment"
    return out


def _dependents(scene: Scene, tables: Tables, path: str) -> list[tuple[str, Any, Any]]:
    """The tables' rows that depend on a parameter: (table, rows, factor) with d row = factor * d value."""
    collection, name, fieldname = parameters.split(path)
    if collection == "meshes" and fieldname == "vertices":
        k = tables.mesh_names.index(name)
        return [("vertices", slice(tables.mesh_first_vertex[k], tables.mesh_first_vertex[k + 1]), 1.0)]
    if collection == "materials" and fieldname in ("base_color", "emission"):
        table = "albedo" if fieldname == "base_color" else "emission"
        return [(table, list(scene.materials).index(name), 1.0)]
    if collection == "world" and fieldname == "color":
        return [("environment", slice(None), scene.world.strength)]
    if collection == "world" and fieldname == "strength":
        return [("environment", slice(None), scene.world.color)]
    if collection == "lights" and fieldname in ("power", "strength", "color"):
        light = scene.lights[name]
        row = [n for n, other in scene.lights.items() if type(other) is type(light)].index(name)
        strength = light.strength if isinstance(light, SunLight) else light.power
        factor = light.color if fieldname != "color" else strength
        if isinstance(light, SunLight):
            return [("sun_irradiance", row, factor)]
        if isinstance(light, PointLight):
            return [("point_intensity", row, factor / (4.0 * np.pi))]
        return [("emission", len(scene.materials) + row, factor / (np.pi * area(light)))]
    raise ValueError(f"parameter '{path}' has no derivative in this version; "
                     "vertices, base_color, emission, power, strength and color have one")
