"""Compiles the expressions of a scene's materials into flat tables for native/texture.

Each closure (shader) with textures gets one program, which writes their values over the closure's parameters
(core/tables/materials.py); a textured weight of a mixture gets another. A program is a list of instructions on
scalar registers: what is constant has been computed, what occurs twice is computed once, and what nobody
reads is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...expression import EXTENSIONS, INTERPOLATIONS, Expression
from ...expression.numbers import numbers, with_numbers
from ...scene.image import Image
from ...scene.light import AreaLight
from ...scene.material import SMOOTH_NORMAL, Material, Mixture
from ...scene.mesh import Mesh
from ...scene.placement import has_uv_tangents
from ...scene.scene import Scene
from ..materials import COLUMNS, is_padded
from . import lower_color, lower_image, lower_math, lower_normal, lower_procedural  # noqa: F401  (their rules are registered)
from .lowering import Lowering, Resources
from .ops import OPCODES, Builder, Number, Output, Value

REGISTERS = 128  # kTextureRegisters in native/scene/textures/texture_view.h
_OUTPUTS, _INPUTS = 4, 10
# Lookups read four floats at once: so many lie behind the last one.
_PADDING = 4
# Of boxes that radial tangents are relative to, along each axis (BKE_mesh_texspace_calc), metres.
_LEAST_SIZE = 2e-5

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
    """Where the numbers of an expression (`expression_numbers`) are; what no program reads is nowhere.

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

    Leaves are the shaders of `scene.materials` in order, each material's parts after each other; area lights
    follow, which have no textures (core/tables/materials.py).
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
    attributes: F32
    face_mesh: I32  # (F) mesh of each face
    mesh_box: F32  # (S, 2, 3) centre and size of the bounding box, relative to the origin
    stored_images: tuple[StoredImage, ...]  # what `pixels` consists of
    attribute_names: tuple[str, ...]  # (A)
    numbers: Mapping[tuple[str, str], NumberPlaces]  # by material and field: where requested numbers are
    with_alpha: frozenset[str]  # images that were stored with an alpha though it is 1 everywhere
    with_tangents: frozenset[str]  # materials that have tangents though their anisotropy is 0


def compile_textures(
    scene: Scene,
    origin: NDArray[np.float64] | None = None,
    meshes: Sequence[Mesh] | None = None,
    requested: Collection[tuple[str, str]] = (),
    with_alpha: Collection[str] = (),
    with_tangents: Collection[str] = (),
    earlier: TextureTables | None = None,
) -> TextureTables:
    """Tables of all textures of a validated scene.

    Parameters
    ----------
    origin
        (3,) what positions are relative to; None: the world's origin.
    meshes
        The scene's meshes in order, as they are flattened; None: as they are in the scene.
    requested
        Materials and fields whose expressions' numbers are parameters: each of these gets a place of its own, and
        nothing is computed from them beforehand.
    with_alpha
        Images whose alpha is kept even if it is 1 everywhere.
    with_tangents
        Materials that have tangents even if their anisotropy is 0.
    earlier
        Tables of the same scene whose images and attributes have not changed since: their arrays are used again, so
        that engines do not copy them.

    Raises
    ------
    ValueError
        Naming the material and the field whose expression can't be compiled.
    """
    placed = list(scene.meshes.values()) if meshes is None else meshes
    start = np.zeros(3) if origin is None else np.asarray(origin, np.float64)
    scene, tracked = _tracked(scene, requested)
    resources = Resources(origin=(float(start[0]), float(start[1]), float(start[2])))
    programs = _Programs(resources)
    closure_program: list[int] = []
    closure_weight_program: list[int] = []
    closure_normal_program: list[int] = []
    closure_uv: list[int] = []
    closure_tangent: list[int] = []

    def untextured() -> None:
        for column in (closure_program, closure_weight_program, closure_normal_program, closure_uv, closure_tangent):
            column.append(-1)

    for name, material in scene.materials.items():
        for k, closure in enumerate(scene.closures(name)):
            part = material.parts[k] if isinstance(material, Mixture) else name
            closure_program.append(programs.of_closure(part, closure))
            weight = material.textures.get(str(k)) if isinstance(material, Mixture) else None
            closure_weight_program.append(-1 if weight is None else programs.of_weight(name, k, weight))
            closure_normal_program.append(programs.of_normal(part, closure))
            has_tangents = part in with_tangents or has_uv_tangents(closure)
            uv, tangent = _tangent_attributes(closure, resources) if has_tangents else (-1, -1)
            closure_uv.append(uv)
            closure_tangent.append(tangent)
        if is_padded(material):
            untextured()
    for light in scene.lights.values():
        if isinstance(light, AreaLight):
            untextured()
    return TextureTables(
        code=np.array(programs.code, np.int32).reshape(-1, 2 + _OUTPUTS + _INPUTS),
        program_first=np.array(programs.first, np.int32),
        constants=np.array(list(programs.constants), np.float32),
        closure_program=np.array(closure_program, np.int32),
        closure_weight_program=np.array(closure_weight_program, np.int32),
        closure_normal_program=np.array(closure_normal_program, np.int32),
        closure_uv=np.array(closure_uv, np.int32),
        closure_tangent=np.array(closure_tangent, np.int32),
        **_images(scene.images, resources, with_alpha, earlier),
        **_lookup_tables(resources),
        **_attributes(placed, resources, earlier),
        mesh_box=_boxes(placed, start),
        numbers={key: _places(own, programs, resources) for key, own in tracked.items()},
        with_alpha=frozenset(with_alpha),
        with_tangents=frozenset(with_tangents),
    )


def _tracked(scene: Scene, requested: Collection[tuple[str, str]]) -> tuple[Scene, dict[tuple[str, str], list[Number]]]:
    """The scene with `Number`s in the requested expressions, and these."""
    materials, tracked = dict(scene.materials), {}
    for name, field in requested:
        textures = dict(materials[name].textures)
        own = [Number(x) for x in numbers(textures[field])]
        textures[field] = with_numbers(textures[field], own)
        materials[name] = replace(materials[name], textures=textures)
        tracked[name, field] = own
    return replace(scene, materials=materials), tracked


def _places(own: list[Number], programs: _Programs, resources: Resources) -> NumberPlaces:
    place = {id(value): at for value, at in programs.constants.items() if isinstance(value, Number)}
    in_table: dict[int, int] = {}
    end = 0
    for rows, _, _ in resources.tables:
        for row in rows:
            in_table |= {id(value): end + k for k, value in enumerate(row) if isinstance(value, Number)}
            end += len(row)
    found = [[(k, at[id(value)]) for k, value in enumerate(own) if id(value) in at] for at in (place, in_table)]
    return NumberPlaces(len(own), *(np.array(pairs, np.int64).reshape(-1, 2) for pairs in found))


def _tangent_attributes(closure: Material, resources: Resources) -> tuple[int, int]:
    return resources.attribute(closure.normal_uv), resources.attribute(f"{closure.normal_uv}.tangent")


class _Programs:
    """All programs, and the constants that they share."""

    def __init__(self, resources: Resources) -> None:
        self.resources = resources
        self.code: list[list[int]] = []
        self.first = [0]
        self.constants: dict[float, int] = {}
        self._of_closure: dict[int, int] = {}
        self._of_normal: dict[int, int] = {}

    def of_closure(self, name: str, closure: Material) -> int:
        """Number of a closure's program, -1 if it has no textures."""
        if not closure.textures:
            return -1
        if id(closure) not in self._of_closure:
            fields = {key: value for key, value in closure.textures.items() if key in COLUMNS}
            self._of_closure[id(closure)] = self._compile(f"material '{name}'", fields)
        return self._of_closure[id(closure)]

    def of_weight(self, name: str, part: int, weight: Expression) -> int:
        """Number of the program of a part's weight in a mixture."""
        return self._compile(f"material '{name}', part {part}", {"weight": weight})

    def of_normal(self, name: str, closure: Material) -> int:
        """Number of the program of a closure's displaced normal, -1 if it has none."""
        normal = closure.textures.get(SMOOTH_NORMAL)
        if normal is None:
            return -1
        if id(normal) not in self._of_normal:
            self._of_normal[id(normal)] = self._compile(f"material '{name}', {SMOOTH_NORMAL}", {"normal": normal})
        return self._of_normal[id(normal)]

    def _compile(self, where: str, textures: Mapping[str, Expression]) -> int:
        build = Builder()
        lowering = Lowering(build, self.resources)
        for field, expression in textures.items():
            try:
                values = lowering.components(expression)
            except ValueError as error:
                raise ValueError(f"{where}: textures['{field}']: {error}") from None
            column, count = COLUMNS[field]
            for k in range(count):
                build.emit("OUTPUT", values[k], data=column + k)
        try:
            self._write(build)
        except _TooManyRegisters:
            raise ValueError(f"{where}: its textures need more than {REGISTERS} values at once; "
                             "bake some of them to an image") from None
        self.first.append(len(self.code))
        return len(self.first) - 2

    def _operand(self, value: Value, register: Mapping[Output, int]) -> int:
        if isinstance(value, Output):
            return register[value]
        return ~self.constants.setdefault(value, len(self.constants))

    def _write(self, build: Builder) -> None:
        """Appends the steps that an output needs; each value has a register until it is read last."""
        last: dict[Output, int] = {}
        needed = [False] * len(build.steps)
        for at in range(len(build.steps) - 1, -1, -1):
            step = build.steps[at]
            needed[at] = needed[at] or step.op == "OUTPUT"
            if needed[at]:
                for value in step.inputs:
                    if isinstance(value, Output):
                        needed[value.step] = True
                        last.setdefault(value, at)
        free = list(range(REGISTERS))[::-1]
        register: dict[Output, int] = {}
        ends: dict[int, list[Output]] = {}
        for value, at in last.items():
            ends.setdefault(at, []).append(value)
        for at, step in enumerate(build.steps):
            if not needed[at]:
                continue
            inputs = [self._operand(v, register) for v in step.inputs]
            # An output may take the place of an input that ends here: operations read all before they write.
            free.extend(register[value] for value in ends.get(at, ()))
            outputs = []
            for k in range(_OUTPUTS):
                value = Output(at, k)
                if value not in last:
                    outputs.append(REGISTERS)
                    continue
                if not free:
                    raise _TooManyRegisters
                register[value] = free.pop()
                outputs.append(register[value])
            none = self._operand(0.0, register)
            self.code.append([OPCODES.index(step.op), step.data, *outputs, *inputs,
                              *[none] * (_INPUTS - len(inputs))])


class _TooManyRegisters(Exception):
    pass


def is_opaque(pixels: F32) -> bool:
    """Whether an image's alpha is 1 everywhere, or it has none."""
    return pixels.shape[2] < 4 or bool(np.all(pixels[..., 3] == 1.0))


def _images(
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


def _lookup_tables(resources: Resources) -> dict[str, Any]:
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


def _boxes(meshes: Sequence[Mesh], origin: NDArray[np.float64]) -> F32:
    """Centre and size of each mesh's bounding box, in the floats that kernels have; as in Blender no size is below
    `_LEAST_SIZE`.

    A mesh that is turned into a plane of the axes is flat but for rounding, which must not pass for its size: what
    remains of a float's digits there would be the direction of the tangents. Flat meshes count as thick as they are
    long, so that this stays small (Blender's 1 m is large in one world and small in another).
    """
    boxes = np.zeros((len(meshes), 2, 3), np.float32)
    for box, mesh in zip(boxes, meshes, strict=True):
        vertices = mesh.vertices - (0.0 if mesh.instances is not None else origin)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        size = high - low
        rounding = 4.0 * np.finfo(np.float32).eps * max(np.abs(low).max(), np.abs(high).max())
        box[0] = 0.5 * (low + high)
        box[1] = np.maximum(np.where(size > rounding, size, size.max()), _LEAST_SIZE)
    return boxes


def _attributes(meshes: Sequence[Mesh], resources: Resources, earlier: TextureTables | None) -> dict[str, Any]:
    parts: list[F32] = []
    end = 0
    first_face = np.cumsum([0] + [len(mesh.faces) for mesh in meshes])
    first_instance = np.cumsum([0] + [0 if mesh.instances is None else len(mesh.instances) for mesh in meshes])
    offsets, components = [], []
    for name in resources.attributes:
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
        "attributes": earlier.attributes if earlier is not None and same else np.concatenate(
            [*(np.ascontiguousarray(part, np.float32).reshape(-1) for part in parts), np.zeros(_PADDING, np.float32)]
        ),
        "face_mesh": np.repeat(np.arange(len(meshes), dtype=np.int32), np.diff(first_face)),
        "attribute_names": names,
    }
