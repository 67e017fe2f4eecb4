"""The data that programs of textures look up: images, tables of ramps and curves, attributes, and extents of meshes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...expression import EXTENSIONS, INTERPOLATIONS
from ...scene.field import Field
from ...scene.image import Image
from ...scene.mesh import Mesh
from .lowering import Resources
from .texture_tables import F32, I32, StoredImage, TextureTables

# Lookups read four floats at once: so many lie behind the last one.
_PADDING = 4


def is_opaque(pixels: F32) -> bool:
    """Whether an image's alpha is 1 everywhere, or it has none."""
    return pixels.shape[2] < 4 or bool(np.all(pixels[..., 3] == 1.0))


def image_tables(
    images: Mapping[str, Image], resources: Resources, with_alpha: Collection[str], earlier: TextureTables | None
) -> dict[str, Any]:
    """Each picture's pixels once; twice only if nodes read them both with and without their alpha."""
    parts: list[tuple[F32, bool]] = []
    held: dict[tuple[str, int, bool], int] = {}
    end = 0
    offsets, shapes, modes = [], [], []
    for name, interpolation, extension, alpha in resources.images:
        pixels = images[name].pixels
        # An alpha that is 1 everywhere, or that nobody wants, takes no memory.
        ones = name not in with_alpha and is_opaque(pixels)
        opaque = pixels.shape[2] == 4 and (alpha == "NONE" or ones)
        multiply = pixels.shape[2] == 4 and not opaque and alpha in ("STRAIGHT", "PREMULTIPLIED")
        if opaque:
            pixels = pixels[..., :3]
        key = (name, pixels.shape[2], multiply)
        if key not in held:
            held[key] = end
            parts.append((pixels, multiply))
            end += pixels.size
        offsets.append(held[key])
        shapes.append((pixels.shape[1], pixels.shape[0], pixels.shape[2]))
        modes.append((INTERPOLATIONS.index(interpolation), EXTENSIONS.index(extension),
                      int(alpha == "STRAIGHT" and (multiply or extension == "CLIP"))))
    stored = tuple(StoredImage(name, offset, channels, multiplied)
                   for (name, channels, multiplied), offset in held.items())
    same = earlier is not None and stored == earlier.stored_images and len(earlier.pixels) == end + _PADDING
    return {
        "image_offset": np.array(offsets, np.int64),
        "image_shape": np.array(shapes, np.int32).reshape(-1, 3),
        "image_mode": np.array(modes, np.int32).reshape(-1, 3),
        "pixels": earlier.pixels if earlier is not None and same else _joined(parts, end),
        "stored_images": stored,
        "least_blue": earlier.least_blue if earlier is not None and same else {},
    }


def _joined(parts: Sequence[tuple[F32, bool]], size: int) -> F32:
    """The pixels of all images, one image after the other; colours are multiplied by alpha where the flag says so."""
    out = np.zeros(size + _PADDING, np.float32)
    offset = 0
    for pixels, multiply in parts:
        place = out[offset : offset + pixels.size].reshape(pixels.shape)
        offset += pixels.size
        if multiply:
            np.multiply(pixels[..., :3], pixels[..., 3:], out=place[..., :3])
            place[..., 3] = pixels[..., 3]
        else:
            place[...] = pixels
    return out


def lookup_tables(resources: Resources) -> dict[str, Any]:
    shapes, rows = [], []
    end = 0
    for (table, interpolate, extrapolate) in resources.tables:
        values = np.array(table, np.float32)
        shapes.append((end, *values.shape, int(interpolate), int(extrapolate)))
        rows.append(values.reshape(-1))
        end += values.size
    return {
        "table_shape": np.array(shapes, np.int32).reshape(-1, 5),
        "lookups": np.concatenate([*rows, np.zeros(_PADDING, np.float32)]),
    }


def mesh_extents(meshes: Sequence[Mesh], origin: NDArray[np.float64]) -> I32:
    """Find the coordinates that tell place and size of each mesh's bounding box along x and y.

    A flat mesh that was turned into a plane of the axes has a thickness of rounding errors. With that as its size, the
    tangents would follow these errors. So a flat mesh counts as thick as it is long.

    Returns
    -------
    (S, 2, 4) places in the flattened `vertices`: of the least and the greatest coordinate along the axis, and of the
    two coordinates whose difference counts as the size.
    """
    extents, first = np.zeros((len(meshes), 2, 4), np.int32), 0
    for extent, mesh in zip(extents, meshes, strict=True):
        vertices = mesh.vertices - (0.0 if mesh.instances is not None else origin)
        ends = np.stack([vertices.argmin(axis=0), vertices.argmax(axis=0)])
        low, high = np.take(vertices, 3 * ends + np.arange(3))
        size = high - low
        rounding = 4.0 * np.finfo(np.float32).eps * max(np.abs(low).max(), np.abs(high).max())
        places = 3 * (first + ends) + np.arange(3)
        for axis in range(2):
            of_size = axis if size[axis] > rounding else int(size.argmax())
            extent[axis] = *places[:, axis], *places[:, of_size]
        first += len(vertices)
    return extents


def attribute_tables(
    meshes: Sequence[Mesh], fields: Sequence[Field], resources: Resources, earlier: TextureTables | None
) -> dict[str, Any]:
    """The attributes of meshes at corners, or one value of each instance, and those of fields on grids."""
    parts: list[F32] = []
    end = 0
    first_face = np.cumsum([0] + [len(mesh.faces) for mesh in meshes])
    first_instance = np.cumsum([0] + [0 if mesh.instances is None else len(mesh.instances) for mesh in meshes])
    offsets, components = [], []
    grid_offsets, grid_shapes = [], []
    for name in resources.attributes:
        for one in fields:
            grid = one.attributes.get(name)
            grid_offsets.append(end)
            grid_shapes.append((0, 0, 0, 0) if grid is None else grid.shape)
            if grid is not None:
                parts.append(grid)
                end += grid.size
        for mesh, face, instance in zip(meshes, first_face, first_instance, strict=False):
            values = mesh.attributes.get(name)
            count, before = (0, 0) if values is None else (values.shape[2], 3 * int(face))
            if values is None and (values := mesh.instance_attributes.get(name)) is not None:
                count, before = -values.shape[1], int(instance)
            offsets.append(end - before * abs(count))
            components.append(count)
            if values is not None:
                parts.append(values)
                end += values.size
    names = tuple(resources.attributes)
    same = earlier is not None and names == earlier.attribute_names and len(earlier.attributes) == end + _PADDING
    return {
        "attribute_offset": np.array(offsets, np.int64),
        "attribute_components": np.array(components, np.int32),
        "grid_offset": np.array(grid_offsets, np.int64),
        "grid_shape": np.array(grid_shapes, np.int32).reshape(-1, 4),
        "attributes": earlier.attributes if earlier is not None and same else np.concatenate(
            [*(np.ascontiguousarray(part, np.float32).reshape(-1) for part in parts), np.zeros(_PADDING, np.float32)]
        ),
        "face_mesh": np.repeat(np.arange(len(meshes), dtype=np.int32), np.diff(first_face)),
        "attribute_names": names,
    }
