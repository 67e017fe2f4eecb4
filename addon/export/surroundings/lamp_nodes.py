"""Reading of the nodes of lights: the factor that they apply to the power of the light."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad import expression as e

from ..geometry.attributes import ObjectValues
from ..materials.shaders import Part, parts
from ..nodes.constants import Place, Values, constants_of, on_object, with_values
from ..nodes.expressions import Reader, Unreadable, folded, number, rgb
from ..nodes.links import Groups, feed, label
from ..nodes.ray_kinds import SAMPLED, RayReader

F64 = NDArray[np.float64]


@dataclass
class LampEmission:
    """What the nodes of a light say.

    Attributes
    ----------
    factor
        (3,) factor of the power. What varies or can't be read counts as 1.
    decay, smooth
        As the fields of Edgegrad's lights, from Light Falloff nodes.
    varying
        One sentence for each part that varies with position or direction, or can't be read.
    notes
        One sentence for each other approximation.
    constants
        What its nodes read from the light's object, which a copy of the light does not have.
    """

    factor: F64
    decay: str = "QUADRATIC"
    smooth: float = 0.0
    varying: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    constants: dict[Place, Values] = field(default_factory=dict)


def has_nodes(light: Any) -> bool:
    """Whether the nodes of a light are used; from 5.1 on, they always are, and `use_nodes` is deprecated."""
    return light.node_tree is not None and (bpy.app.version >= (5, 1, 0) or bool(light.use_nodes))


def own_color(light: Any) -> NDArray[np.float64]:
    """(3,) colour of a light without its nodes."""
    color = np.array(light.color, np.float64)
    return color * np.array(light.temperature_color) if getattr(light, "use_temperature", False) else color


def read_emission(light: Any, of: ObjectValues) -> LampEmission:
    """Read the nodes of a light (its data), whose object has these values."""
    if not has_nodes(light):
        return LampEmission(np.ones(3))
    out, decays = _read_emission(light, of, 1.0)
    if not decays:
        return out
    # All of the emission must be a multiple of the same falloff.
    others = [(gain, _read_emission(light, of, gain)[0].factor) for gain in (0.5, 3.0)]
    if len(decays) > 1 or not all(np.allclose(factor, gain * out.factor) for gain, factor in others):
        out.varying.append("its Light Falloff is not a factor of all of its emission")
    elif light.type == "SUN":
        out.varying.append("its Light Falloff acts on a light at infinity")
    else:
        (out.decay, out.smooth), = decays
    return out


def _read_emission(light: Any, of: ObjectValues, gain: float) -> tuple[LampEmission, set[tuple[str, float]]]:
    """Read the nodes of a light, with falloffs times `gain`; also return the decay and smoothing of each."""
    output = light.node_tree.get_output_node("CYCLES")
    out = LampEmission(np.zeros(3))
    if output is None:
        return out, set()
    reader, surface = _LampReader(of, gain), feed(output.inputs["Surface"])
    for part in parts(reader, surface):
        weight = number(part.weight)
        name = label(part.node, part.groups)
        if weight is None:
            out.varying.append(f"the weight of its shader node '{name}' varies")
        elif part.node.type in ("EMISSION", "BACKGROUND"):
            color, strength = (_constant(reader, part, name, out) for name in ("Color", "Strength"))
            out.factor += weight * color * strength[0]
        else:
            out.varying.append(f"its shader node '{name}' can't be read")
    out.notes += [*reader.approximations, *reader.notes]
    if surface.output is not None:
        out.constants = on_object(constants_of(reader, surface.output, surface.groups), {})
    return out, reader.decays


def _constant(reader: Reader, part: Part, name: str, out: LampEmission) -> F64:
    """(3,) value of an input of an Emission node; 1 if it varies or can't be read."""
    try:
        value = rgb(folded(reader.value(part.node.inputs[name], part.groups)))
    except Unreadable as error:
        out.varying.append(f"{error} can't be read")
        return np.ones(3)
    if value is None:
        out.varying.append(f"its {name.lower()} varies with position or direction")
    return np.ones(3) if value is None else value


class _LampReader(RayReader):
    """Translates the nodes of a light. A Light Falloff has its strength at 1 m, times `gain`.

    Attributes
    ----------
    of
        The light's object, whose values are constants.
    decays
        Decay and smoothing of each falloff but those of physical lights.
    """

    def __init__(self, of: ObjectValues, gain: float) -> None:
        super().__init__(None, SAMPLED)
        self.of = of
        self.gain = gain
        self.decays: set[tuple[str, float]] = set()

    def _read(self, output: Any, groups: Groups) -> e.Operand:
        node = output.node
        if node.type != "LIGHT_FALLOFF":
            return with_values(super()._read(output, groups), self.of.value)
        smooth = number(self.get(node, "Smooth", groups))
        if smooth is None:
            raise Unreadable(f"'Smooth' of node '{label(node, groups)}'")
        strength, decay = self.get(node, "Strength", groups), (output.identifier.upper(), max(smooth, 0.0))
        if decay == ("QUADRATIC", 0.0):
            return strength
        self.decays.add(decay)
        return e.Math("MULTIPLY", strength, self.gain)
