"""The chain rule between the parameters of a scene and the tables that kernels read.

`ParameterMap.push_forward` maps a tangent of the parameters to a tangent of the tables (forward mode). `pull_back` maps
gradients by the tables to gradients by the parameters (reverse mode). Each is the transpose of the other. `requested`
has the rows that depend on the requested parameters. The derivative by one parameter is a list of pieces
(`linear_map.Piece`), which the module of its kind makes.

A value that a texture replaces (a base colour with an image, a textured weight of a mixture) has the derivative 0,
since the picture does not depend on it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._check import array
from ..scene import parameters
from ..scene.material import Mixture
from ..scene.placement import placed_meshes
from ..scene.scene import Scene
from ..tables import lights as light_table
from ..tables import materials as material_table
from ..tables.camera import WIDTH as CAMERA_WIDTH
from ..tables.media import MEDIUM_WIDTH
from ..tables.tables import Tables, environment_pixels
from ..tables.textures.data import is_opaque
from ..tables.textures.program import compile_textures
from . import fields as field_map
from . import images as image_map
from . import meshes as mesh_map
from . import values as value_map
from .linear_map import Piece

# Name of a table -> tangent of its values, or gradient by them, in the shape that `shapes` returns.
TableDerivative = dict[str, NDArray[np.float64]]
# Name of a table -> (n, 2) spans of rows [first, last) by which derivatives are requested, sorted and disjoint. Tables
# of which no row is requested are absent. Rows count along the first axis of `shapes`.
Requested = dict[str, NDArray[np.int64]]


class ParameterRows(NamedTuple):
    """The rows of tables that each of some parameters changes, as spans [first, last), those of a parameter together.

    Attributes
    ----------
    tables
        Names of the tables.
    table
        (n,) of each span, the place of its table in `tables`.
    spans
        (n, 2), in any order.
    last
        (P,) of each parameter, the end of its spans.
    """

    tables: tuple[str, ...]
    table: NDArray[np.int64]
    spans: NDArray[np.int64]
    last: NDArray[np.int64]


_PIECES = {
    "meshes": mesh_map.pieces,
    "materials": value_map.material_pieces,
    "lights": value_map.light_pieces,
    "world": value_map.world_pieces,
    "camera": value_map.camera_pieces,
    "images": image_map.pieces,
    "fields": field_map.pieces,
}
_WITHOUT = {
    ("meshes", "terminator_offset"): "it only moves the origins of shadow rays",
    ("meshes", "terminator_shading"): "it corrects an artefact of shading",
    ("camera", "clip_start"): "clip distances only decide what is visible",
    ("camera", "clip_end"): "clip distances only decide what is visible",
    ("camera", "filter_width"): "pixels are weighted by a fixed filter",
}


def shapes(tables: Tables) -> dict[str, tuple[int, ...]]:
    """Return the names and shapes of all differentiable tables of a scene.

    ============================ ============ =====================================================================
    vertices                     (V, 3)       as `Tables.vertices`
    normals                      (N, 3)       unit shading normals; only custom ones depend on parameters here, since
                                              the engine itself maps normals of vertices to `vertices`
    instance_to_world            (I, 12)      rows of the transforms
    field_values                 (n,)         `FieldTable.values` of all distance fields, one after the other
    field_to_world               (F * 12,)    rows of `FieldTable.to_world`
    closure_params               (L * 40,)    rows of `material_table.COLUMNS`, one after the other
    texture_pixels               (n,)         `TextureTables.pixels`; absent like the next three without textures
    texture_attributes           (n,)         `TextureTables.attributes`
    texture_lookups              (n,)         `TextureTables.lookups`
    texture_constants            (n,)         `TextureTables.constants`
    media                        (M * 8,)     rows of `tables.media.coefficients`
    world_medium                 (8,)         that of the space around them
    light_params                 (R * 24,)    rows of `light_table`
    environment                  (3,)         colour times strength
    environment_pixels           (h, w, 3)    of the image, absent without one; not scaled by `environment`
    environment_rotation         (9,)         rows, world to image
    camera                       (24,)        `tables.camera.PLACES`
    ============================ ============ =====================================================================
    """
    out: dict[str, tuple[int, ...]] = {
        "vertices": tables.vertices.shape,
        "normals": (int(tables.mesh_first_normal[-1]), 3),
        "instance_to_world": (len(tables.instance_mesh), 12),
        "closure_params": (len(tables.materials.kind) * material_table.WIDTH,),
        "media": (tables.media.size,),
        "world_medium": (MEDIUM_WIDTH,),
        "light_params": (len(tables.lights.kind) * light_table.WIDTH,),
        "environment": (3,),
        "environment_rotation": (9,),
        "camera": (CAMERA_WIDTH,),
    }
    if tables.fields:
        out["field_values"] = (sum(table.values.size for table in tables.fields),)
        out["field_to_world"] = (12 * len(tables.fields),)
    if tables.environment_pixels is not None:
        out["environment_pixels"] = tables.environment_pixels.shape
    if tables.textures is not None:
        for name in ("pixels", "attributes", "lookups", "constants"):
            out[f"texture_{name}"] = getattr(tables.textures, name).shape
    return out


def without_derivative(path: str) -> str | None:
    """Why a parameter has no derivative, whatever the scene; None: it has one."""
    collection, _, field = parameters.split(path)
    return _WITHOUT.get((collection, field))


def pieces(scene: Scene, tables: Tables, path: str) -> list[Piece]:
    """Return the derivative of the tables with respect to one parameter.

    Raises
    ------
    ValueError
        For an unknown path, or a parameter that has no derivative, in one sentence.
    """
    parameters.owner(scene, path)
    return _pieces(scene, tables, path)


def _pieces(scene: Scene, tables: Tables, path: str) -> list[Piece]:
    """Likewise, for a known path."""
    collection, name, field = parameters.split(path)
    reason = _WITHOUT.get((collection, field))
    if reason is not None:
        raise ValueError(f"parameter '{path}' has no derivative: {reason}")
    return _PIECES[collection](scene, tables, name, field)


class ParameterMap:
    """The derivative of the tables with respect to some parameters, and its transpose, of the scene as it is now.

    The pixels of images are not copied, so they must not be changed in place before the last call of `pull_back`.

    Parameters
    ----------
    tables
        Result of `with_requested`.
    wrt
        Paths of the requested parameters.

    Attributes
    ----------
    requested
        The rows of the tables that depend on the parameters.
    rows
        Those that depend on each parameter by itself, in their order.

    Raises
    ------
    ValueError
        For an unknown path, or one that has no derivative.
    """

    def __init__(self, scene: Scene, tables: Tables, wrt: Iterable[str]) -> None:
        self._shapes = shapes(tables)
        self._pieces: dict[str, list[Piece]] = {}
        self._parameter_shapes: dict[str, tuple[int, ...]] = {}
        wrt = tuple(wrt)
        for path in wrt:
            value = parameters.value_of(*parameters.owner(scene, path))
            self._pieces[path] = _pieces(scene, tables, path)
            self._parameter_shapes[path] = np.shape(value)
        self.rows = _rows([self._pieces[path] for path in wrt])
        self.requested = _requested(self.rows)

    def push_forward(self, tangent: Mapping[str, Any]) -> TableDerivative:
        """Map a tangent of the parameters to a tangent of the tables.

        Parameters
        ----------
        tangent
            Path of a requested parameter -> array of the shape of the parameter.

        Returns
        -------
        The tangents of those tables that depend on the parameters; all other tangents are zero.

        Raises
        ------
        ValueError
            For an array of another shape.
        """
        out: TableDerivative = {}
        for path, value in tangent.items():
            dv = array("render_forward", f"tangent of '{path}'", value, self._parameter_shapes[path], np.float64)
            for piece in self._pieces[path]:
                table = out.setdefault(piece.table, np.zeros(self._shapes[piece.table]))
                table[piece.first : piece.last] += piece.push(dv)
        return out

    def pull_back(self, gradients: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
        """Map gradients by the tables to gradients by the requested parameters (the transpose of `push_forward`).

        Parameters
        ----------
        gradients
            Gradients by all tables that `requested` names.

        Returns
        -------
        Parameter path -> array of the parameter's shape.
        """
        out = {}
        for path, found in self._pieces.items():
            # Most parameters are one piece. It is not copied, since it may be a very large image.
            total: NDArray[np.float64] | None = None
            for piece in found:
                part = piece.pull(gradients[piece.table][piece.first : piece.last])
                total = part if total is None else total + part
            shape = self._parameter_shapes[path]
            out[path] = np.zeros(shape) if total is None else np.asarray(total, np.float64).reshape(shape)
        return out


def with_requested(scene: Scene, tables: Tables, wrt: Collection[str]) -> Tables:
    """Return the tables with everything that derivatives by `wrt` read; the same object if nothing is missing.

    Tables for pictures leave out whatever contributes nothing to the picture. Its derivative need not be zero, so these
    tables keep it if it is requested: lobes of weight 0, the tangents of surfaces of anisotropy 0, the image of a black
    environment, and an alpha channel that is 1 everywhere. Each requested number of an expression gets a place of its
    own among the constants of the texture programs.
    """
    fields: dict[str, set[str]] = {}
    expressions, with_alpha = set(), set()
    for path in wrt:
        parameters.owner(scene, path)
        collection, name, field = parameters.split(path)
        if collection == "materials" and field.startswith(parameters.TEXTURES):
            expressions.add((name, field[len(parameters.TEXTURES) :]))
        elif collection == "materials" and field in material_table.NEUTRAL:
            fields.setdefault(name, set()).add(field)
        elif collection == "images" and _loses_alpha(scene, tables, name):
            with_alpha.add(name)
    if fields:
        tables = _with_lobes(scene, tables, fields)
    if tables.environment_pixels is None and shows_environment(scene, wrt):
        tables = replace(tables, environment_pixels=environment_pixels(scene))
    # Tables for pictures already hold the tangents of materials whose anisotropy is not 0.
    with_tangents = {name for name, requested in fields.items()
                     if "anisotropy" in requested and getattr(scene.materials[name], "anisotropy", None) == 0.0}
    known = tables.textures
    if known is not None:
        expressions |= known.numbers.keys()
        with_alpha |= known.with_alpha
        with_tangents |= known.with_tangents
        if (expressions, with_alpha, with_tangents) == (set(known.numbers), known.with_alpha, known.with_tangents):
            return tables
    if expressions or with_alpha or with_tangents:
        compiled = compile_textures(scene, tables.origin, placed_meshes(scene), sorted(expressions), with_alpha,
                                    with_tangents, known)
        tables = replace(tables, textures=compiled)
    return tables


def _with_lobes(scene: Scene, tables: Tables, fields: Mapping[str, Collection[str]]) -> Tables:
    """Return the tables with the lobes whose weight may have a derivative: those of `fields` by material."""
    flags, kept = tables.materials.flags.copy(), ~material_table.excluded_flags(scene)
    for name, first in zip(scene.materials, tables.materials.first_closure, strict=False):
        material = scene.materials[name]
        for k, part in enumerate(material.parts if isinstance(material, Mixture) else (name,)):
            if part in fields:
                below = flags[first + k] & material_table.NORMAL_BELOW
                flags[first + k] = material_table.flags(scene.closures(name)[k], fields[part]) & kept | below
    if np.array_equal(flags, tables.materials.flags):
        return tables
    return replace(tables, materials=replace(tables.materials, flags=flags))


def shows_environment(scene: Scene, wrt: Collection[str]) -> bool:
    """Whether derivatives by `wrt` read the image of the environment even if its colour is black."""
    return scene.world.image is not None and not {"world.color", "world.strength"}.isdisjoint(wrt)


def _loses_alpha(scene: Scene, tables: Tables, name: str) -> bool:
    """Whether some texture reads the alpha channel of an image that is not stored, because it is 1 everywhere."""
    pixels = scene.images[name].pixels
    stored = tables.textures.stored_images if tables.textures is not None else ()
    return pixels.shape[2] == 4 and is_opaque(pixels) and any(image.name == name for image in stored)


def _rows(of_parameters: list[list[Piece]]) -> ParameterRows:
    """Return the rows of the tables that the pieces of each parameter cover."""
    found = [piece for pieces_of_one in of_parameters for piece in pieces_of_one]
    places: dict[str, int] = {}
    table = np.array([places.setdefault(piece.table, len(places)) for piece in found], np.int64)
    spans = np.array([(piece.first, piece.last) for piece in found], np.int64).reshape(-1, 2)
    return ParameterRows(tuple(places), table, spans, np.cumsum([len(one) for one in of_parameters], dtype=np.int64))


def _requested(rows: ParameterRows) -> Requested:
    """Return the rows that some parameter covers."""
    return {name: _united(rows.spans[rows.table == k]) for k, name in enumerate(rows.tables)}


def _united(spans: NDArray[np.int64]) -> NDArray[np.int64]:
    """Sort spans, and unite those that overlap or touch."""
    first, last = spans[np.argsort(spans[:, 0], kind="stable")].T
    last = np.maximum.accumulate(last)
    starts = np.flatnonzero(np.concatenate([[True], first[1:] > last[:-1]]))
    return np.stack([first[starts], last[np.append(starts[1:], len(last)) - 1]], axis=1)
