"""Expressions evaluated natively at points of a surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edgegrad import Camera, Image, Material, Mesh, Scene, World, _native
from edgegrad.expression import Channel, Combine, Expression
from edgegrad.tables.materials import COLUMNS, WIDTH
from edgegrad.tables.textures.program import compile_textures
from edgegrad.tables.textures.texture_tables import TextureTables


@dataclass
class Points:
    """Points of the first mesh: face and barycentrics of its second and third corner, and the ray's frame."""

    face: NDArray[np.int32]
    b1: NDArray[np.float32]
    b2: NDArray[np.float32]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    true_normal: NDArray[np.float32]
    view: NDArray[np.float32]
    ray_kind: NDArray[np.int32]
    backside: NDArray[np.int32]
    program: NDArray[np.int32]


def points(count: int, **given: Any) -> Points:
    """Points with the given values, and zeros for all others."""
    values: dict[str, Any] = {
        f.name: np.zeros((count, 3) if f.name in ("position", "normal", "true_normal", "view") else count,
                         np.int32 if f.name in ("face", "ray_kind", "backside", "program") else np.float32)
        for f in fields(Points)
    }
    for name, value in given.items():
        values[name] = np.ascontiguousarray(np.broadcast_to(value, values[name].shape), values[name].dtype)
    return Points(**values)


def corners_mesh(**attributes: NDArray[np.float64]) -> Mesh:
    """Triangles all of whose corners have one value of each attribute, (n, c)."""
    n = len(next(iter(attributes.values())))
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    values = {name: np.repeat(v[:, None, :], 3, axis=1).astype(np.float32) for name, v in attributes.items()}
    return Mesh(vertices, np.tile(np.arange(3, dtype=np.int32), (n, 1)), ("m0",), attributes=values)


def scene_of(
    expressions: Sequence[Expression], meshes: Mapping[str, Mesh], images: Mapping[str, Image] | None = None
) -> Scene:
    """Materials "m0", "m1", ..., each with an expression as emission, and its alpha as roughness."""
    materials = {
        f"m{k}": Material(textures={"emission": node, "roughness": Combine(*[Channel(node, 3)] * 3)})
        for k, node in enumerate(expressions)
    }
    scene = Scene(Camera(np.eye(4)), meshes, materials, {}, World(), images or {})
    scene.validate()
    return scene


def evaluate(
    scene: Scene, where: Points, instruction_set: str = "", tables: TextureTables | None = None
) -> NDArray[np.float32]:
    """(materials, points, 4) colour and alpha of each material's expression at each point; `tables` or the scene's."""
    tables = compile_textures(scene) if tables is None else tables
    out = np.zeros((len(tables.closure_program), len(where.face), 4), np.float32)
    for k, program in enumerate(tables.closure_program):
        where.program[:] = program
        rows = np.zeros((len(where.face), WIDTH), np.float32)
        _native.evaluate_textures(tables, where, rows, instruction_set)
        first = COLUMNS["emission"][0]
        out[k, :, :3] = rows[:, first : first + 3]
        out[k, :, 3] = rows[:, COLUMNS["roughness"][0]]
    return out


def at_values(
    expressions: Sequence[Expression],
    p: NDArray[np.float64],
    q: NDArray[np.float64] | None = None,
    images: Mapping[str, Image] | None = None,
    instruction_set: str = "",
) -> NDArray[np.float32]:
    """(expressions, n, 4): expressions of Attribute("P") and ("Q") where these have the values (n, c)."""
    where, meshes = corner_points(p, q)
    return evaluate(scene_of(expressions, meshes, images), where, instruction_set)


def corner_points(p: NDArray[np.float64], q: NDArray[np.float64] | None = None) -> tuple[Points, dict[str, Mesh]]:
    """Points at which Attribute("P") and ("Q") have the values (n, c), and the mesh that they are on."""
    up = np.array([0.0, 0.0, 1.0])
    where = points(len(p), face=np.arange(len(p)), b1=np.float32(0.25), b2=np.float32(0.5), normal=up,
                   true_normal=up, view=up)
    mesh = corners_mesh(P=p, Q=np.zeros_like(p) if q is None else q)
    return where, {"mesh": mesh}
