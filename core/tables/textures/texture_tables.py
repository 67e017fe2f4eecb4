"""The tables of a scene's textures, as native/texture reads them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
F32 = NDArray[np.float32]


@dataclass(frozen=True)
class StoredImage:
    """An image's place in `TextureTables.pixels`.

    Attributes
    ----------
    name
        In the scene.
    offset
        First float.
    channels
        How many of its channels are kept.
    multiplied
        Whether the colour has been multiplied by alpha.
    """

    name: str
    offset: int
    channels: int
    multiplied: bool


@dataclass(frozen=True)
class NumberPlaces:
    """Where the numbers of an expression (`expression.numbers`) are; what no program reads is nowhere.

    Attributes
    ----------
    count
        Numbers of the expression.
    constants, lookups
        (n, 2) a number's position in its expression, and its place in `TextureTables.constants` or `lookups`.
    """

    count: int
    constants: I64
    lookups: I64


@dataclass
class TextureTables:
    """What native/scene/textures/texture_view.h points to. P programs, L closures, S meshes of the scene.

    Closures have the order of `scene.materials`, each material's parts after each other. Area lights follow, which have
    no textures (core/tables/materials.py).
    """

    code: I32  # (n, 16) op, data, out[4], in[10]
    program_first: I32  # (P + 1)
    constants: F32
    closure_program: I32  # (L) -1: none
    closure_weight_program: I32  # (L) -1: none
    closure_normal_program: I32  # (L) of the material's displaced normal, -1: none
    closure_uv: I32  # (L) attribute that the normal map is relative to, -1: none
    closure_tangent: I32  # (L) attribute that has its tangents, -1: none
    image_offset: I64  # (I) first float in `pixels`
    image_shape: I32  # (I, 3) width, height, channels
    image_mode: I32  # (I, 3) interpolation, extension, whether the result is divided by alpha
    pixels: F32
    table_shape: I32  # (T, 5) offset, rows, columns, interpolate, extrapolate
    lookups: F32
    attribute_offset: I64  # (A * S) where the data of face 0, or of instance 0, would be in `attributes`
    attribute_components: I32  # (A * S) 0: the mesh has no such attribute; -c: c values of each instance
    grid_offset: I64  # (A * K) first float of the attribute's grid on each of K fields
    grid_shape: I32  # (A * K, 4) sizes along the axes, and numbers of each value; 0: the field has no such attribute
    attributes: F32
    face_mesh: I32  # (F) mesh of each face
    mesh_extent: I32  # (S, 2, 4) places in `vertices`: ends and size of the bounding box along x and y
    stored_images: tuple[StoredImage, ...]  # what `pixels` consists of
    least_blue: dict[str, float]  # by image: least value of its third or only channel, where it was asked for
    attribute_names: tuple[str, ...]  # (A)
    numbers: Mapping[tuple[str, str], NumberPlaces]  # by material and field: where requested numbers are
    with_alpha: frozenset[str]  # images that were stored with an alpha though it is 1 everywhere
    with_tangents: frozenset[str]  # materials that have tangents though their anisotropy is 0

    def grid_place(self, name: str, field: int) -> int | None:
        """Index in `attributes` of the first float of an attribute of a field; None: no texture reads it."""
        if name not in self.attribute_names:
            return None
        return int(self.grid_offset.reshape(len(self.attribute_names), -1)[self.attribute_names.index(name), field])
