"""Light sampling of the native engine by itself: samples from points, densities along directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import edgegrad
from edgegrad.rendering.native_engine import Engine
from edgegrad.scene.light import Light
from edgegrad.tables.tables import flatten
from tests.support.small_scenes import camera, matte, rectangle

Floats = NDArray[np.float64]


def lit(lights: Mapping[str, Light], meshes: Mapping[str, edgegrad.Mesh] | None = None,
        materials: Mapping[str, edgegrad.Material] | None = None, **more: Any) -> edgegrad.Scene:
    """A scene of these lights and meshes, and a floor that needs not matter."""
    floor = {"floor": rectangle((0, 0, -9), (1, 0, 0), (0, 1, 0), "floor")}
    return edgegrad.Scene(camera(), {**floor, **(meshes or {})}, {"floor": matte(), **(materials or {})}, dict(lights),
                          **more)  # fmt: skip


class Probe:
    """Light sampling by the kernels of one instruction set."""

    def __init__(self, scene: edgegrad.Scene, instruction_set: str = "") -> None:
        self.tables = flatten(scene, np.zeros(3))
        self._scene = Engine(self.tables, 1, instruction_set)._scene

    def sample(self, position: ArrayLike, normal: ArrayLike, uv: Floats, both_sides: bool = False) -> dict[str, Any]:
        """Samples for (n, 2) random numbers: w, radiance, r, pdf, geometry. Radiance 0: none."""
        n = len(uv)
        u, v = _column(uv[:, 0]), _column(uv[:, 1])
        return dict(self._scene.sample_lights(_rows(position, n), _rows(normal, n), u, v, both_sides))

    def radiance(self, position: ArrayLike, normal: ArrayLike, w: Floats, bsdf_pdf: float = 0.0) -> Floats:
        """(n, 3) radiance of the sized lights along (n, 3) directions, weighted against samples of them."""
        nothing, far = np.full(len(w), -1), np.full(len(w), np.inf)
        return np.asarray(self._meet(position, normal, w, nothing, far, bsdf_pdf)["radiance"], np.float64)

    def density(self, position: ArrayLike, normal: ArrayLike, w: Floats) -> Floats:
        """(n,) density with which samples find directions: that of sized lights follows from the power heuristic's
        weights, that of faces is asked for at the first one met."""
        own = self.radiance(position, normal, w)
        weighed = self.radiance(position, normal, w, bsdf_pdf=1.0)
        lights = np.sqrt(np.maximum(own[:, 0] / np.maximum(weighed[:, 0], 1e-30) - 1.0, 0.0)) * (own[:, 0] > 0.0)
        face, r = self._first_face(np.asarray(position, np.float64), w)
        return np.asarray(lights + self._meet(position, normal, w, face, r, 1.0)["pdf"], np.float64)

    def sky(self, uv: Floats) -> dict[str, Any]:
        """Samples of the environment's image: w, radiance, pdf."""
        return dict(self._scene.sample_environment_light(_column(uv[:, 0]), _column(uv[:, 1])))

    def look(self, w: Floats) -> dict[str, Any]:
        """Radiance and density of the environment along (n, 3) directions."""
        return dict(self._scene.look_at_environment(np.ascontiguousarray(w, np.float32)))

    def _meet(self, position: ArrayLike, normal: ArrayLike, w: Floats, face: NDArray[Any], r: Floats,
              bsdf_pdf: float) -> dict[str, Any]:  # fmt: skip
        n = len(w)
        return dict(
            self._scene.meet_lights(
                _rows(position, n), _rows(normal, n), np.ascontiguousarray(w, np.float32),
                np.ascontiguousarray(face, np.int32), _column(r), np.full(n, bsdf_pdf, np.float32),
                1,  # as a diffuse ray
                False,
            )
        )  # fmt: skip

    def _first_face(self, position: Floats, w: Floats) -> tuple[NDArray[Any], Floats]:
        """Number of the first emitting face that each ray meets (-1: none), and its distance."""
        t = self.tables
        face, nearest = np.full(len(w), -1), np.full(len(w), np.inf)
        visible = int(t.mesh_first_face[int(t.visible.sum())])
        for f in np.flatnonzero(t.emission[t.face_material[:visible]].any(axis=1)):
            a, b, c = t.vertices[t.faces[f]].astype(np.float64) - position
            e1, e2 = b - a, c - a
            p = np.cross(w, e2)
            det = p @ e1
            with np.errstate(divide="ignore", invalid="ignore"):
                u = p @ -a / det
                q = np.cross(-a, e1)
                v, r = w @ q / det, (e2 @ q) / det
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (r > 0) & (r < nearest)
            face[hit], nearest[hit] = f, r[hit]
        return face, nearest


def _rows(value: ArrayLike, n: int) -> NDArray[np.float32]:
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, np.float32), (n, 3)))


def _column(value: ArrayLike) -> NDArray[np.float32]:
    return np.ascontiguousarray(value, np.float32)
