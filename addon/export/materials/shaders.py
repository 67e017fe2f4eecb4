"""Translation of trees of Mix and Add shaders to weighted sums of closures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

import edgegrad
from edgegrad import expression as e
from edgegrad.expression import Expression, Operand, nodes_of

from ..geometry import attributes
from ..nodes.expressions import Reader, Unreadable, converted, folded, number, rgb
from ..nodes.links import Feed, Groups, by_identifier, feed, label, own_value_of

# Ranges of fields; all other numbers are in [0, 1].
RANGES = {"ior": (1e-3, 1e3), "coat_ior": (1.0, 1e3), "anisotropy": (-1.0, 1.0), "anisotropy_rotation": (-1e6, 1e6),
          "specular_ior_level": (0.0, 1e3), "specular_tint": (0.0, 1e3), "emission": (0.0, 1e9),
          "normal_strength": (0.0, 1e3), "coat_tint": (0.0, 1e3), "sheen_tint": (0.0, 1e3),
          "thin_film_thickness": (0.0, 1e6), "thin_film_ior": (1e-3, 1e3)}  # fmt: skip
# Kinds of rays, other than the camera's, for which light sampling never sees emission.
BY_SAMPLING = ("DIFFUSE", "GLOSSY", "TRANSMISSION")
COLORS = ("base_color", "specular_tint", "coat_tint", "sheen_tint", "emission", "normal")
FLAT = (0.5, 0.5, 1.0)  # the color of a normal map that bends nothing


@dataclass(frozen=True)
class Part:
    """An output that is linked to the surface, and its weight in the sum.

    The output is that of a shader node, or a colour or number, which Cycles renders as emission.
    """

    output: Any
    groups: Groups
    weight: Operand

    @property
    def node(self) -> Any:
        """The node of the output."""
        return self.output.node


def parts(reader: Reader, surface: Feed, weight: Operand = 1.0) -> Iterator[Part]:
    """Yield the shaders in a tree of Mix and Add shaders, each with the product of the weights on its path."""
    if surface.output is None:
        return
    node, groups = surface.output.node, surface.groups
    if node.type == "ADD_SHADER":
        for socket in node.inputs[:2]:
            yield from parts(reader, feed(socket, groups), weight)
    elif node.type == "MIX_SHADER":
        try:
            factor = folded(reader.value(node.inputs[0], groups))
        except Unreadable as error:
            reader.note(f"node '{label(node, groups)}' uses its socket's value as factor, since {error} can't be read")
            factor = float(node.inputs[0].default_value)
        if not isinstance(factor, Expression):
            factor = float(np.clip(number(factor) or 0.0, 0.0, 1.0))
            weights: tuple[Operand, Operand] = (1.0 - factor, factor)
        else:
            second = e.Clamp(factor)
            weights = (e.Math("SUBTRACT", 1.0, second), second)
        for socket, part in zip(node.inputs[1:3], weights, strict=True):
            if part != 0.0:
                yield from parts(reader, feed(socket, groups), product(weight, part))
    else:
        yield Part(surface.output, groups, weight)


def product(a: Operand, b: Operand) -> Operand:
    """Return the product of two numbers or expressions."""
    if not isinstance(a, Expression) and not isinstance(b, Expression):
        return float(number(a) or 0.0) * float(number(b) or 0.0)
    if a == 1.0 or b == 1.0:
        return b if a == 1.0 else a
    return e.Math("MULTIPLY", a, b)


def mixture(layers: Mapping[str, Operand]) -> edgegrad.Mixture:
    """Return the sum of closures with these names and weights."""
    weights = [0.5 if isinstance(weight, Expression) else number(weight) or 0.0 for weight in layers.values()]
    textures = {str(k): weight for k, weight in enumerate(layers.values()) if isinstance(weight, Expression)}
    return edgegrad.Mixture(tuple(layers), np.array(weights), textures)


def weighted(value: edgegrad.Material | edgegrad.Mixture,
             closures: Iterable[edgegrad.Material]) -> list[tuple[edgegrad.Material, Operand]]:  # fmt: skip
    """List the closures of a material with their weights."""
    if isinstance(value, edgegrad.Material):
        return [(value, 1.0)]
    weights = [value.textures.get(str(k), float(weight)) for k, weight in enumerate(value.weights)]
    return list(zip(closures, weights, strict=True))


@dataclass
class Closure:
    """Fills the `Material` of one closure from the inputs of its shader node.

    Attributes
    ----------
    output
        Output of the node that is linked to the surface.
    bake_normal
        Called with the feed of a Normal input that is not a normal map; returns the expression of a baked normal
        map.
    """

    reader: Reader
    node: Any
    groups: Groups
    material: edgegrad.Material
    output: Any = None
    bake_normal: Callable[[Feed], Expression | None] | None = None

    def note(self, text: str) -> None:
        """Add a note on an approximation of this node."""
        self.reader.note(f"node '{label(self.node, self.groups)}': {text}")

    def has(self, name: str) -> bool:
        """Whether the node has this input (Blender's versions differ)."""
        return by_identifier(self.node.inputs, name) is not None

    def read(self, name: str) -> Operand:
        """Translate an input; if that fails, use the value set at its socket and add a note."""
        socket = by_identifier(self.node.inputs, name)
        try:
            return folded(self.reader.value(socket, self.groups))
        except Unreadable as error:
            self.note(f"'{name}' is its socket's value, since {error} can't be read")
            return own_value_of(socket)

    def constant(self, name: str, rest: float) -> float:
        """Read an input that must not vary: its own value if it does, `rest` if the node does not have it."""
        if not self.has(name):
            return rest
        found = number(self.read(name))
        if found is None:
            self.note(f"'{name}' varies; subsurface scattering uses its socket's value")
            found = number(self.own(name))
        return rest if found is None else found

    def own(self, name: str) -> Operand:
        """Return the value that is set at an input, even if it is linked."""
        return own_value_of(by_identifier(self.node.inputs, name))

    def set(self, field: str, name: str) -> None:
        """Set a field of the material from an input."""
        self.put(field, self.read(name), self.own(name))

    def put(self, field: str, value: Operand, fallback: Operand) -> None:
        """Set a field to a value, or to an expression that replaces the constant `fallback`."""
        if isinstance(value, Expression):
            self.material.textures = {**self.material.textures, field: value}
            value = fallback
        found = rgb(value)
        assert found is not None
        if field not in COLORS:
            found = found[:1]
        # Only an expression of a colour may be above 1, and one of emission below 0.
        wide = np.maximum(found, 0.0) if field == "base_color" else found
        beyond = (field == "base_color" and found.max() > 1.0) or (field == "emission" and found.min() < 0.0)
        if beyond and field not in self.material.textures:
            self.material.textures = {**self.material.textures, field: e.Combine(*map(float, wide))}
        clipped = np.clip(found, *RANGES.get(field, (0.0, 1.0)))
        # `np.allclose` would take a fourth of an export's time
        if field not in self.material.textures and (np.abs(clipped - found) > 1e-5 * np.abs(found) + 1e-8).any():
            self.note(f"{field.replace('_', ' ')} is clipped to the range {RANGES.get(field, (0, 1))[0]:g} to "
                      f"{RANGES.get(field, (0, 1))[1]:g}")  # fmt: skip
        setattr(self.material, field, clipped if field in COLORS else float(clipped[0]))

    def set_all(self, names: dict[str, str]) -> None:
        """Call `set` for each pair field -> input whose input the node has."""
        for field, name in names.items():
            if self.has(name):
                self.set(field, name)

    def emission(self, color: str, strength: str, least: float = -np.inf) -> None:
        """Set the emission to the product of a colour input and a strength input.

        Where one of the two is a constant of at most `least`, also if it is negative, nothing is emitted.
        """
        own = rgb(self.own(color)) * (number(self.own(strength)) or 0.0)  # type: ignore[operator]
        a, b = self.read(color), self.read(strength)
        constant, factor = rgb(a), number(b)
        if factor == 0.0 or (constant is not None and not constant.any()):
            return
        if (factor is not None and factor <= least) or (constant is not None and constant.max() <= least):
            return
        if constant is not None and factor is not None:
            self.put("emission", tuple(map(float, constant * factor)), 0.0)
            return
        radiance = e.VectorMath("MULTIPLY", a, b)
        if any(isinstance(part, e.LightPath) and part.kind in BY_SAMPLING for part in nodes_of(radiance)):
            self.note("its emission for diffuse, glossy or transmission rays reaches other surfaces only by the rays "
                      "that meet it, not by light sampling; as in Cycles, how much that is depends on the sampling, "
                      "and so differs a little")  # fmt: skip
        self.put("emission", radiance, tuple(np.maximum(own, 0.0)))

    def emit(self, output: Any) -> None:
        """Make a black surface that emits an output of the node, which is not a shader."""
        self.material.kind, self.material.base_color = "DIFFUSE", np.zeros(3)
        try:
            value = converted(self.reader.output(output, self.groups), output.type, "RGBA")
        except Unreadable as error:
            self.note(f"is linked to the surface as emission, but {error} can't be read; it is black")
            return
        self.put("emission", value, 0.0)

    def normal(self, name: str = "Normal") -> None:
        """Set the shading normal. What no expression can represent is baked as a normal map in tangent space."""
        socket = by_identifier(self.node.inputs, name)
        found = None if socket is None else feed(socket, self.groups)
        if found is None or found.output is None:
            return
        node = found.output.node
        if node.type == "NORMAL_MAP" and node.space == "TANGENT":
            self._map_normal(node, found.groups)
            return
        if self.node.type == "BSDF_PRINCIPLED" and node.type != "BUMP":
            # Cycles counts the densities of diffuse samples there in some of the estimates of gloss only.
            self.note(f"where the normals of node '{label(node, found.groups)}' point below the surface, Cycles itself "
                      "makes the gloss over a diffuse base too bright")  # fmt: skip
        try:
            value = self.reader.value(socket, self.groups)
        except Unreadable as error:
            baked = None if self.bake_normal is None else self.bake_normal(found)
            if baked is None:
                self.note(f"the effect of node '{label(node, found.groups)}' on its normal is left out, since "
                          f"{error} can't be read")  # fmt: skip
                return
            self.put("normal", baked, FLAT)
            self.material.normal_uv = attributes.BAKED_UV
            return
        if value != e.Coordinates("NORMAL"):
            self._bend(value if isinstance(value, Expression) else e.VectorMath("ADD", value))

    def _bend(self, normal: Expression) -> None:
        """Use a normal in world space."""
        self.put("normal", normal, FLAT)
        self.material.normal_space = "WORLD"

    def _map_normal(self, node: Any, groups: Groups) -> None:
        """Use a normal map in tangent space."""
        inner = Closure(self.reader, node, groups, self.material)
        color, strength = inner.read("Color"), inner.read("Strength")
        constant = np.array(FLAT) if number(strength) == 0.0 else rgb(color)
        flat = constant is not None and np.allclose(constant, FLAT)
        # Normal maps interpolate normals in object space. Under a non-uniform scale, even a map that bends nothing thus
        # differs from the smooth normals, which Cycles interpolates in world space. Maps also take the place of bump by
        # displacement.
        if flat and not (self.reader.stretched or self.reader.displaced):
            return
        if not flat:
            inner.put("normal_strength", strength, inner.own("Strength"))
        # The material uses a normal map only if it is a texture, so a constant becomes an expression.
        if constant is not None:
            color = e.Combine(*map(float, constant))
        inner.put("normal", color, FLAT)
        self.material.normal_uv = node.uv_map or attributes.ACTIVE_UV

    def tangent(self) -> None:
        """Set the tangents for anisotropy: those of a UV map, or those around an axis of the object."""
        if self.material.anisotropy == 0.0 and "anisotropy" not in self.material.textures:
            return
        socket = by_identifier(self.node.inputs, "Tangent")
        found = None if socket is None else feed(socket, self.groups)
        node = None if found is None or found.output is None else found.output.node
        uv = attributes.AROUND["Z"]
        if node is not None and node.type == "TANGENT" and node.direction_type == "UV_MAP":
            uv = node.uv_map or attributes.ACTIVE_UV
        elif node is not None and node.type == "TANGENT":
            uv = attributes.AROUND[node.axis]
        elif node is not None:
            self.note("its tangent can't be read; anisotropy uses tangents around the object's Z axis")
        if "normal" not in self.material.textures or self.material.normal_space == "WORLD":
            self.material.normal_uv = uv
        elif uv != self.material.normal_uv and self.material.normal_uv != attributes.BAKED_UV:
            # A closure has tangents of one UV map, so the normal map becomes an expression with tangents of its own.
            textures = dict(self.material.textures)
            strength = textures.pop("normal_strength", self.material.normal_strength)
            bent = e.NormalMap(textures["normal"], strength, self.material.normal_uv)
            self.material.textures = textures
            self.material.normal_strength = 1.0
            self._bend(bent)
            self.material.normal_uv = uv
        elif uv != self.material.normal_uv:
            self.note(f"its anisotropy is relative to the UV map of its normal map, {self.material.normal_uv}")
