"""Translation of nodes that move, turn and scale vectors: Mapping and Vector Rotate."""

from __future__ import annotations

from typing import Any

import numpy as np
from mathutils import Euler, Matrix, Vector

from edgegrad import expression as e
from edgegrad.expression import Operand

from .expressions import Reader, folded, reads, rgb
from .links import Groups
from .read_inputs import rows

NOWHERE = np.zeros(3)


@reads("MAPPING")
def _mapping(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    kind = node.vector_type
    vector, scale, angles = (reader.get(node, name, groups) for name in ("Vector", "Scale", "Rotation"))
    location = reader.get(node, "Location", groups) if kind in ("POINT", "TEXTURE") else (0.0, 0.0, 0.0)
    fixed = [rgb(folded(value)) for value in (location, angles, scale)]
    varies = any(rgb(folded(value)) is None for value in (vector, location, angles))
    if varies and fixed[2] is not None and not fixed[2].any():
        return (0.0, 0.0, 0.0)  # Cycles drops the location, too, unless it computes a constant
    if all(value is not None for value in fixed):
        return e.Transform(vector, rows(mapping_matrix(kind, *fixed)), kind == "NORMAL")
    if kind == "TEXTURE":
        return e.VectorMath("DIVIDE", _turned(e.VectorMath("SUBTRACT", vector, location), angles, back=True), scale)
    turned = _turned(e.VectorMath("DIVIDE" if kind == "NORMAL" else "MULTIPLY", vector, scale), angles)
    return e.VectorMath("NORMALIZE", turned) if kind == "NORMAL" else e.VectorMath("ADD", turned, location)


def mapping_matrix(kind: str, location: Any, angles: Any, scale: Any) -> Any:
    """(3, 4) affine map of a Mapping node."""
    turn = np.array(Euler(angles, "XYZ").to_matrix(), np.float64)
    inverse = np.divide(1.0, scale, out=np.zeros(3), where=np.asarray(scale) != 0.0)
    if kind == "TEXTURE":
        linear = inverse[:, None] * turn.T
        return np.column_stack([linear, -linear @ location])
    return np.column_stack([turn * (inverse if kind == "NORMAL" else scale), location])


@reads("VECTOR_ROTATE")
def _rotate(reader: Reader, node: Any, groups: Groups, output: Any) -> Operand:
    kind = node.rotation_type
    vector, center = reader.get(node, "Vector", groups), reader.get(node, "Center", groups)
    apart = e.VectorMath("SUBTRACT", vector, center)
    if kind == "EULER_XYZ":
        turned = _turned(apart, reader.get(node, "Rotation", groups), node.invert)
    else:
        angle = reader.get(node, "Angle", groups)
        axis = (reader.get(node, "Axis", groups) if kind == "AXIS_ANGLE"
                else tuple(float(kind[0] == letter) for letter in "XYZ"))  # fmt: skip
        turned = _around(apart, axis, e.Math("MULTIPLY", angle, -1.0) if node.invert else angle)
    return e.VectorMath("ADD", turned, center)


def _turned(vector: Operand, angles: Operand, back: bool = False) -> Operand:
    """Turn a vector around X, then Y, then Z; with `back`, undo that turn."""
    fixed = rgb(folded(angles))
    if fixed is not None:
        turn = np.array(Euler(fixed, "XYZ").to_matrix(), np.float64)
        return e.Transform(vector, rows(np.column_stack([turn.T if back else turn, NOWHERE])))
    for axis in (2, 1, 0) if back else (0, 1, 2):
        angle: Operand = e.Channel(angles, axis)
        angle = e.Math("MULTIPLY", angle, -1.0) if back else angle
        sine, cosine = e.Math("SINE", angle), e.Math("COSINE", angle)
        out: list[Operand] = [e.Channel(vector, k) for k in range(3)]
        a, b = (axis + 1) % 3, (axis + 2) % 3
        first, second = out[a], out[b]
        out[a] = e.Math("SUBTRACT", e.Math("MULTIPLY", cosine, first), e.Math("MULTIPLY", sine, second))
        out[b] = e.Math("ADD", e.Math("MULTIPLY", sine, first), e.Math("MULTIPLY", cosine, second))
        vector = e.Combine(*out)
    return vector


def _around(vector: Operand, axis: Operand, angle: Operand) -> Operand:
    """Turn a vector around an axis; an axis without length turns nothing."""
    fixed_axis, fixed = rgb(folded(axis)), rgb(folded(angle))
    if fixed_axis is not None and fixed is not None:
        direction = Vector(fixed_axis)
        turn = Matrix.Rotation(float(fixed[0]), 3, direction) if direction.length > 0.0 else Matrix.Identity(3)
        return e.Transform(vector, rows(np.column_stack([np.array(turn, np.float64), NOWHERE])))
    unit = e.VectorMath("NORMALIZE", axis)
    sine, cosine = e.Math("SINE", angle), e.Math("COSINE", angle)
    along = e.VectorMath("SCALE", unit, scale=e.VectorMath("DOT_PRODUCT", unit, vector))
    apart = e.VectorMath("SUBTRACT", vector, along)
    turned = e.VectorMath("ADD", e.VectorMath("SCALE", apart, scale=cosine),
                          e.VectorMath("SCALE", e.VectorMath("CROSS_PRODUCT", unit, vector), scale=sine))  # fmt: skip
    turned = e.VectorMath("ADD", along, turned)
    return e.Mix(e.Math("GREATER_THAN", e.VectorMath("LENGTH", axis), 0.0), vector, turned)
