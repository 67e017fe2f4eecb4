"""Conversion of derivatives for engines that support only flat-shaded, diffuse, directly lit scenes.

For such a narrow engine (`EngineLike.narrow`), a material is one colour and one radiance, and area lights are emissive
meshes. `narrowed` extracts its tangent from a `TableDerivative`; `widened`, the transpose, puts its gradient into one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..derivatives.table_derivatives import Requested, TableDerivative, shapes
from ..scene import parameters
from ..tables import lights as light_table
from ..tables import materials as material_table
from ..tables.lights import (
    CONE,
    DIRECTION,
    DISK,
    ELLIPSE,
    LINEAR_CONE,
    ONE_MINUS_COS,
    POINT,
    POSITION,
    RADIANCE,
    RADIUS,
    RECTANGLE,
    SHINES_TO,
    SMOOTH_CONE,
    SPHERE,
)
from ..tables.materials import COLUMNS, EMISSION
from ..tables.tables import Tables

_FIELDS = {
    "meshes": ("vertices",),
    "materials": ("base_color", "emission"),
    "lights": ("power", "strength", "color"),
    "world": ("color", "strength"),
}
# Number of floats in a row, for tables that are stored as flat arrays of rows.
_WIDTHS = {"closure_params": material_table.WIDTH, "light_params": light_table.WIDTH}
# Tables that both derivatives have in the same form.
_SAME = ("vertices", "environment", "camera", "instance_to_world")
_COLOR, _EMISSION = (slice(COLUMNS[field][0], COLUMNS[field][0] + 3) for field in ("base_color", "emission"))


class DiffuseTables:
    """Materials and lights of a flat-shaded, diffuse, directly lit scene, as views of its tables.

    Point lights and suns with a size count as lights without size, with the same total intensity or irradiance.
    """

    def __init__(self, tables: Tables) -> None:
        _, _, points, suns = _rows(tables)
        first = tables.materials.first_closure[:-1]
        lights = tables.lights.params
        self.albedo = tables.materials.params[first, _COLOR]  # (M, 3)
        self.emission = tables.emission  # (M, 3)
        self.two_sided = tables.emission_two_sided.astype(bool)  # (M,)
        self.point_position = lights[points, POSITION]  # (P, 3) relative to the origin
        radius = lights[points, RADIUS]
        disk = np.where(radius > 0.0, np.pi * radius**2, 1.0)
        self.point_intensity = lights[points, RADIANCE] * disk[:, None]  # (P, 3) W/sr
        self.sun_direction = lights[suns, SHINES_TO]  # (D, 3) unit, direction of travel
        # The disk of half angle a integrates the cosine to pi sin^2(a).
        height = lights[suns, ONE_MINUS_COS]
        cap = np.where(height > 0.0, np.pi * height * (2.0 - height), 1.0)
        self.sun_irradiance = lights[suns, RADIANCE] * cap[:, None]  # (D, 3)


@dataclass
class Derivative:
    """A tangent of, or a gradient with respect to, the tables of the same names in `Tables` and `DiffuseTables`."""

    vertices: NDArray[np.float64]
    albedo: NDArray[np.float64]
    emission: NDArray[np.float64]
    point_intensity: NDArray[np.float64]
    sun_irradiance: NDArray[np.float64]
    environment: NDArray[np.float64]
    camera: NDArray[np.float64]  # camera and instance_to_world: primary boundary term only
    instance_to_world: NDArray[np.float64]

    @staticmethod
    def zero(tables: Tables) -> Derivative:
        """A `Derivative` of zeros."""
        return Derivative(**{name: np.zeros(values.shape) for name, values in narrow_values(tables).items()})


def narrow_values(tables: Tables) -> dict[str, NDArray[np.float32]]:
    """Return the values of the tables that `Derivative` has tangents or gradients of, by the same names."""
    diffuse = DiffuseTables(tables)
    return {f.name: getattr(diffuse if hasattr(diffuse, f.name) else tables, f.name) for f in fields(Derivative)}


@dataclass
class Asked:
    """The requested derivatives; the engine skips all others."""

    moving: NDArray[np.uint8]  # (S,) 1: vertices of the mesh
    emitting: NDArray[np.uint8]  # (M,) 1: emission of the material
    colors: bool = False  # any colour, radiance or intensity
    lights: bool = False  # the strength of any point light or sun
    environment: bool = False
    camera: bool = False  # any float of the camera
    instances: bool = False  # any instance's transform


def check(wrt: Iterable[str]) -> None:
    """Raise ``ValueError`` for a parameter that narrow engines cannot differentiate."""
    for path in wrt:
        collection, _, field = parameters.split(path)
        if field not in _FIELDS.get(collection, ()):
            raise ValueError(f"parameter '{path}' has no derivative in this version; "
                             "vertices, base_color, emission, power, strength and color have one")


def asked(tables: Tables, wanted: Requested) -> Asked:
    """Translate the requested rows of the tables of `table_derivatives.with_requested`."""
    rows = {name: _inside(shape[0], wanted.get(name)) for name, shape in shapes(tables).items()}
    moving = [rows["vertices"][a:b].any() for a, b in zip(tables.mesh_first_vertex, tables.mesh_first_vertex[1:],
                                                          strict=False)]
    emitting = np.zeros(len(tables.emission), np.uint8)
    closure, area, points, suns = _rows(tables)
    closures, lights = (rows[name].reshape(-1, width).any(axis=1) for name, width in _WIDTHS.items())
    emitting[: len(closure)] = closures[closure] & ((tables.materials.flags[closure] & EMISSION) != 0)
    emitting[len(closure) :] = lights[area]
    return Asked(
        np.array(moving, np.uint8),
        emitting,
        colors=not {"closure_params", "light_params", "environment"}.isdisjoint(wanted),
        lights=bool(lights[np.concatenate([points, suns])].any()),
        environment="environment" in wanted,
        camera="camera" in wanted,
        instances="instance_to_world" in wanted,
    )


def narrowed(tables: Tables, tangent: TableDerivative) -> Derivative:
    """Extract the part of a tangent that narrow engines differentiate."""
    out = Derivative.zero(tables)
    for name, place, rows, columns in _places(tables):
        if name in tangent:
            getattr(out, place[0])[place[1]] = tangent[name].reshape(-1, _WIDTHS[name])[rows, columns]
    for name in _SAME:
        if name in tangent:
            getattr(out, name)[...] = tangent[name].reshape(getattr(out, name).shape)
    return out


def widened(tables: Tables, gradient: Derivative, wanted: Requested) -> TableDerivative:
    """Convert the gradient of a narrow engine to one by the requested tables: the transpose of `narrowed`."""
    size = shapes(tables)
    out = {name: np.zeros(size[name]) for name in wanted}
    for name, place, rows, columns in _places(tables):
        if name in out:
            out[name].reshape(-1, _WIDTHS[name])[rows, columns] = getattr(gradient, place[0])[place[1]]
    for name in _SAME:
        if name in out:
            out[name] = getattr(gradient, name).reshape(size[name])
    return out


Rows = NDArray[np.int64]


def _rows(tables: Tables) -> tuple[Rows, Rows, Rows, Rows]:
    """Rows of the first closures of materials, of area lights, of point lights and of suns."""
    kind = tables.lights.kind
    area = np.flatnonzero((kind == RECTANGLE) | (kind == ELLIPSE))
    closure = tables.materials.first_closure[: -1 - len(area)].astype(np.int64)
    spot = (tables.lights.flags & (SMOOTH_CONE | LINEAR_CONE)) != 0
    points = np.isin(kind, (POINT, SPHERE, DISK)) & ~spot
    return closure, area, np.flatnonzero(points), np.flatnonzero((kind == DIRECTION) | (kind == CONE))


def _places(tables: Tables) -> list[tuple[str, tuple[str, slice], Rows, slice]]:
    """List (table, narrow table and rows, rows of the table, columns of the table) for each converted value."""
    closure, area, points, suns = _rows(tables)
    return [
        ("closure_params", ("albedo", slice(0, len(closure))), closure, _COLOR),
        ("closure_params", ("emission", slice(0, len(closure))), closure, _EMISSION),
        ("light_params", ("emission", slice(len(closure), None)), area, RADIANCE),
        ("light_params", ("point_intensity", slice(None)), points, RADIANCE),
        ("light_params", ("sun_irradiance", slice(None)), suns, RADIANCE),
    ]


def _inside(count: int, spans: NDArray[np.int64] | None) -> NDArray[np.bool_]:
    out = np.zeros(count, bool)
    for first, last in () if spans is None else spans:
        out[first:last] = True
    return out
