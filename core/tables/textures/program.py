"""Compiles the expressions of a scene's materials into flat tables for native/texture.

Each closure (shader) with textures gets one program, which writes their values over the closure's parameters
(core/tables/materials.py); a textured weight of a mixture gets another. A program is a list of instructions on
scalar registers: what is constant has been computed, what occurs twice is computed once, and what nobody
reads is left out.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...expression import Expression
from ...expression.numbers import numbers, with_numbers
from ...scene.light import AreaLight
from ...scene.material import SMOOTH_NORMAL, Material, Mixture
from ...scene.mesh import Mesh
from ...scene.placement import has_uv_tangents
from ...scene.scene import Scene
from ..materials import COLUMNS, is_padded
from . import lower_color, lower_image, lower_math, lower_normal, lower_procedural  # noqa: F401  (their rules are registered)
from .data import attribute_tables, image_tables, lookup_tables, mesh_extents
from .lowering import Lowering, Resources
from .ops import OPCODES, Builder, Number, Output, Value
from .texture_tables import NumberPlaces, TextureTables

REGISTERS = 128  # kTextureRegisters in native/scene/textures/texture_view.h
_OUTPUTS, _INPUTS = 4, 10


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
        **image_tables(scene.images, resources, with_alpha, earlier),
        **lookup_tables(resources),
        **attribute_tables(placed, list(scene.fields.values()), resources, earlier),
        mesh_extent=mesh_extents(placed, start),
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
