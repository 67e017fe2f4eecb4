"""Translation of shader node graphs to `edgegrad.expression` trees.

The modules `read_inputs`, `read_colors`, `read_mappings`, `read_normals`, `read_tangents` and `read_textures` register
one function for each type of node.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from edgegrad import expression as e
from edgegrad.expression import Expression, Operand, operands
from edgegrad.tables.textures.lowering import RULES, Lowering, Resources
from edgegrad.tables.textures.ops import Builder

from ..inventory.naming import node_sentences
from .camera_view import CameraView
from .images import Images
from .links import Groups, by_identifier, feed, is_computed_by_blender, is_implicit, label, upstream

SCALARS = ("VALUE", "INT", "BOOLEAN")
# Whether Blender resolves groups before Cycles sees them. Their sockets then convert constants that Blender itself
# computes, and nothing else.
INLINES = bpy.app.version >= (5, 0, 0)
REC709_LUMINANCE = (0.2126, 0.7152, 0.0722)

NodeReader = Callable[["Reader", Any, Groups, Any], Operand]
READERS: dict[str, NodeReader] = {}


def reads(*types: str) -> Callable[[NodeReader], NodeReader]:
    """Register the decorated function (reader, node, groups, output) as the translation of these node types."""

    def register(function: NodeReader) -> NodeReader:
        for one in types:
            READERS[one] = function
        return function

    return register


class Unreadable(Exception):
    """Raised for a node that no expression can represent; its text is the label of the node and the reason.

    Attributes
    ----------
    bakeable
        Whether an image of the values on the surface can replace the node.
    """

    def __init__(self, text: str, bakeable: bool = True) -> None:
        super().__init__(text)
        self.bakeable = bakeable


class UnreadableNormal(Unreadable):
    """Raised for a node whose normal no expression can represent. It is baked as a normal map, not as a colour."""


@dataclass
class Reader:
    """Translates the sockets of one material, light or world.

    Attributes
    ----------
    images
        Receives the images that the nodes read; None: image textures are unreadable.
    bake
        Called with an output that no expression can represent, and the groups around its node. Returns an
        expression that reads the baked image, or None if the output cannot be baked.
    material_index
        Blender's pass index of the material.
    view
        What nodes know of the camera; None: there is none.
    notes
        One short text for each approximation.
    owner
        Blender's material.
    codes
        Whether environment textures may interpolate code values; False where an image itself is needed.
    stretched
        Whether an object with the material has a non-uniform scale.
    displaced
        Whether displacement bends the normals of the material.
    scatters
        Whether a shader that has been read scatters light below the surface.
    moves
        Whether displacement is read to move vertices; False: to bend normals.
    """

    images: Images | None = None
    bake: Callable[[Any, Groups], Expression | None] | None = None
    material_index: int = 0
    view: CameraView | None = None
    notes: list[str] = field(default_factory=list)
    owner: Any = None
    codes: bool = True
    stretched: bool = False
    displaced: bool = False
    scatters: bool = False
    moves: bool = False
    _known: dict[tuple[Any, ...], Operand] = field(default_factory=dict, repr=False)

    def value(self, socket: Any, groups: Groups = ()) -> Operand:
        """Translate the value that an input receives, converted to the type of the input.

        Raises
        ------
        Unreadable
            If no expression can represent it.
        """
        found = feed(socket, groups)
        if found.output is not None:
            value, kind = self.output(found.output, found.groups), found.output.type
        elif found.input is not None:
            value, kind = own_value(found.input), found.input.type
        else:
            return 0.0
        given = found.output is None or is_computed_by_blender(found.output.node, found.groups)
        for target in (*(reversed(found.through) if given or not INLINES else ()), socket.type):
            if given and INLINES:
                value = whole(folded(value), kind, target)
            value, kind = converted(value, kind, target), target
        return value

    def get(self, node: Any, identifier: str, groups: Groups) -> Operand:
        """Translate the input of a node with this identifier or name."""
        return self.value(by_identifier(node.inputs, identifier), groups)

    def get_or(self, node: Any, identifier: str, groups: Groups, default: Operand | None) -> Any:
        """Translate an input like `get`, but return `default` if it keeps the default that Cycles has for it."""
        socket = by_identifier(node.inputs, identifier)
        return default if is_implicit(socket, feed(socket, groups)) else self.value(socket, groups)

    def output(self, output: Any, groups: Groups) -> Operand:
        """Translate the output of a node."""
        key = (output, groups)
        if key not in self._known:
            self._known[key] = self._read(output, groups)
        return self._known[key]

    def note(self, text: str) -> None:
        """Note an approximation, once."""
        if text not in self.notes:
            self.notes.append(text)

    def _read(self, output: Any, groups: Groups) -> Operand:
        node = output.node
        for sentence in node_sentences(node):
            self.note(f"node '{label(node, groups)}': {sentence}")
        try:
            read = READERS.get(node.type)
            if read is None:
                raise Unreadable(f"node '{label(node, groups)}' ({node.bl_label})")
            if has_texture_mapping(node):
                raise Unreadable(f"node '{label(node, groups)}' (its own mapping)")
            value = read(self, node, groups, output)
            if isinstance(value, Expression) and type(value) not in RULES:
                raise Unreadable(f"node '{label(node, groups)}' ({node.bl_label})")
        except Unreadable as error:
            if isinstance(error, UnreadableNormal) and output.type == "VECTOR":
                raise
            baked = self.bake(output, groups) if self.bake is not None and error.bakeable else None
            if baked is None:
                raise
            self._note_bake(output, groups)
            return baked
        return folded(value) if isinstance(value, Expression) and not any(operands(value)) else value

    def _note_bake(self, output: Any, groups: Groups) -> None:
        """Note what a bake, which knows no camera and no ray, does not have."""
        found = [(output, groups), *upstream(output.node, groups)]
        for one, around in found:
            name = label(one.node, around)
            if one.node.type in OF_VIEW or (one.node.type, one.identifier) in OF_VIEW or _turns_to_camera(one.node):
                self.note(f"node '{label(output.node, groups)}' is baked, so it does not vary with the ray as "
                          f"'{one.name}' of node '{name}' does")  # fmt: skip


# Nodes or outputs that depend on the ray.
OF_VIEW = {"LIGHT_PATH", "FRESNEL", "LAYER_WEIGHT", "CAMERA", ("TEX_COORD", "Reflection"), ("TEX_COORD", "Camera"),
           ("TEX_COORD", "Window"), ("NEW_GEOMETRY", "Incoming"), ("NEW_GEOMETRY", "Backfacing")}  # fmt: skip


def _turns_to_camera(node: Any) -> bool:
    """Whether a node transforms vectors from or to the space of the camera."""
    return node.type == "VECT_TRANSFORM" and "CAMERA" in (node.convert_from, node.convert_to)


def has_texture_mapping(node: Any) -> bool:
    """Whether a texture node has its own mapping (a setting of Blender 2.7) that changes the coordinates."""
    mapping = getattr(node, "texture_mapping", None)
    if mapping is None:
        return False
    plain = ((mapping.translation, 0.0), (mapping.rotation, 0.0), (mapping.scale, 1.0))
    axes = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z)
    return axes != ("X", "Y", "Z") or not all(np.allclose(value, rest) for value, rest in plain)


def own_value(socket: Any) -> Operand:
    """Return the value that is set at an input."""
    if not hasattr(socket, "default_value"):
        return 0.0
    value = socket.default_value
    if socket.type in SCALARS:
        return float(value)
    if socket.type in ("VECTOR", "RGBA"):
        return tuple(float(c) for c in value)[:4]
    raise Unreadable(f"socket '{socket.name}' of node '{socket.node.name}' ({socket.type.lower()})")


def converted(value: Operand, source: str, target: str) -> Operand:
    """Apply Blender's implicit conversion from one socket type to another."""
    if target not in SCALARS or source in SCALARS:
        if isinstance(value, tuple) and source == "VECTOR" and target == "RGBA":
            return (*value[:3], 1.0)
        return value
    if isinstance(value, tuple):
        weights = REC709_LUMINANCE if source == "RGBA" else (1.0 / 3.0,) * 3
        return float(np.dot(weights, value[:3]))
    if not isinstance(value, Expression):
        return value
    return e.Luminance(value) if source == "RGBA" else e.Average(value)


def whole(value: Operand, source: str, target: str) -> Operand:
    """Round a constant to the whole number, or the truth value, that Blender makes of it; others stay."""
    if target == source or target not in ("INT", "BOOLEAN") or isinstance(value, Expression):
        return value
    if target == "BOOLEAN" and source == "VECTOR" and isinstance(value, tuple):
        return float(any(value[:3]))
    found = converted(value, source, "VALUE")
    one = float(found[0] if isinstance(found, tuple) else found)  # type: ignore[arg-type]
    return float(one > 0.0) if target == "BOOLEAN" else float(int(one))


def folded(value: Operand) -> Operand:
    """Return the expression, or its four components if they are constants."""
    if not isinstance(value, Expression):
        return value
    numbers = [c for c in Lowering(Builder(), Resources()).components(value) if isinstance(c, (int, float))]
    if len(numbers) < 4 or not np.isfinite(numbers).all():
        return value
    return tuple(float(c) for c in numbers)


def rgb(value: Operand) -> NDArray[np.float64] | None:
    """(3,) first three components of a constant; None for an expression."""
    if isinstance(value, Expression):
        return None
    return np.array(value[:3], np.float64) if isinstance(value, tuple) else np.full(3, float(value))


def number(value: Operand) -> float | None:
    """First component of a constant; None for an expression."""
    found = rgb(value)
    return None if found is None else float(found[0])


def constant(socket: Any, groups: Groups = ()) -> NDArray[np.float64] | None:
    """(3,) constant value of an input; None if it varies or cannot be read."""
    try:
        return rgb(folded(Reader().value(socket, groups)))
    except Unreadable:
        return None
