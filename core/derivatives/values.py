"""Derivatives of the tables with respect to materials, lights, the world and the camera."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..scene.material import Mixture
from ..scene.medium import Medium
from ..scene.parameters import MEDIUM, TEXTURES
from ..scene.scene import Scene
from ..tables import lights as light_table
from ..tables import materials as material_table
from ..tables.camera import camera_row
from ..tables.lights import light_row
from ..tables.media import MEDIUM_WIDTH, coefficients
from ..tables.tables import Tables
from ..tables.textures.texture_tables import NumberPlaces
from .complex_step import jacobian
from .linear_map import F64, Piece, by_matrix, same


def material_pieces(scene: Scene, tables: Tables, name: str, field: str) -> list[Piece]:
    """Return the derivative of all closures made from a material; of a mixture, that of its closures' weights."""
    material = scene.materials[name]
    if field.startswith(MEDIUM):
        # A mixture has the medium of its first part
        rows = [k for k, other in enumerate(scene.materials) if scene.closures(other)[0] is material]
        matrix = _medium_matrix(scene.closures(name)[0].medium, f"material '{name}'", field[len(MEDIUM) :])
        return [piece for k in rows for piece in by_matrix("media", k * MEDIUM_WIDTH, matrix)]
    if field.startswith(TEXTURES):
        return _number_pieces(tables, name, field[len(TEXTURES) :])
    if isinstance(material, Mixture):
        return [piece for k, closure in enumerate(tables.materials.closures_of[name]) if str(k) not in material.textures
                for piece in _weight(closure, k, len(material.parts))]
    if field in material.textures:
        return []
    place, count = material_table.COLUMNS[field]
    first = [closure * material_table.WIDTH + place for closure in tables.materials.closures_of[name]]
    return [same("closure_params", k, k + count, (count,), np.shape(getattr(material, field))) for k in first]


def _medium_matrix(medium: Medium | None, where: str, field: str) -> F64:
    """Return the derivative of a medium's row of coefficients.

    Raises
    ------
    ValueError
        If the medium has no effect, so that no path finds where it is.
    """
    assert medium is not None  # the path names it
    if not any(medium.scattering) and not any(medium.absorption):
        raise ValueError(f"{where}: all coefficients of its medium are 0, where they have no derivatives; start from "
                         "small positive ones")
    return jacobian(coefficients, medium, field)


def _weight(closure: int, k: int, parts: int) -> list[Piece]:
    place = closure * material_table.WIDTH + material_table.COLUMNS["weight"][0]
    return by_matrix("closure_params", place, np.eye(parts)[k : k + 1])


def _number_pieces(tables: Tables, name: str, field: str) -> list[Piece]:
    if tables.textures is None or (name, field) not in tables.textures.numbers:
        raise RuntimeError(f"the tables were compiled without the numbers of material '{name}', textures['{field}']; "
                           "take those of table_derivatives.with_requested")
    found = tables.textures.numbers[name, field]
    return [piece for table in ("constants", "lookups") for piece in _scattered(f"texture_{table}", found, table)]


def _scattered(table: str, found: NumberPlaces, which: str) -> list[Piece]:
    places = getattr(found, which)
    if not len(places):
        return []
    number, row = places.T
    first, last = int(row.min()), int(row.max()) + 1

    def push(v: F64) -> F64:
        out = np.zeros(last - first)
        out[row - first] = v[number]
        return out

    def pull(g: F64) -> F64:
        out = np.zeros(found.count)
        out[number] = g[row - first]
        return out

    return [Piece(table, first, last, push, pull)]


def light_pieces(scene: Scene, tables: Tables, name: str, field: str) -> list[Piece]:
    """Return the derivative of the row of a light.

    A light of size 0 (radius, angle) is of another kind, so the derivative by its size is 0. So are those by a spread
    of 180 degrees and by a `smooth` of 0 with quadratic decay.
    """
    matrix = jacobian(lambda light: light_row(light, tables.origin), scene.lights[name], field)
    return by_matrix("light_params", tables.lights.row_of[name] * light_table.WIDTH, matrix)


def world_pieces(scene: Scene, _tables: Tables, _name: str, field: str) -> list[Piece]:
    """Return the derivative of the environment's radiance, colour times strength, of its rotation or its medium."""
    world = scene.world
    if field.startswith(MEDIUM):
        return by_matrix("world_medium", 0, _medium_matrix(world.medium, "world", field[len(MEDIUM) :]))
    if field == "rotation":
        return [same("environment_rotation", 0, 9, (9,), (3, 3))]
    factor: Any = world.strength * np.eye(3) if field == "color" else world.color
    return by_matrix("environment", 0, np.array(factor, np.float64))


def camera_pieces(scene: Scene, tables: Tables, _name: str, field: str) -> list[Piece]:
    """Return the derivative of the row of the scene's camera; pictures of other cameras do not depend on it."""
    matrix: F64 = jacobian(lambda camera: camera_row(camera, tables.origin), scene.camera, field)
    return by_matrix("camera", 0, matrix)
