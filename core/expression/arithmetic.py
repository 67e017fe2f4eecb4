"""Nodes that compute with numbers and vectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .nodes import Expression, Operand, Row

MATH_OPERATIONS = (
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "POWER", "LOGARITHM", "SQRT", "INVERSE_SQRT", "ABSOLUTE",
    "EXPONENT", "MINIMUM", "MAXIMUM", "LESS_THAN", "GREATER_THAN", "SIGN", "COMPARE", "SMOOTH_MIN", "SMOOTH_MAX",
    "ROUND", "FLOOR", "CEIL", "TRUNC", "FRACT", "MODULO", "FLOORED_MODULO", "WRAP", "SNAP", "PINGPONG",
    "SINE", "COSINE", "TANGENT", "ARCSINE", "ARCCOSINE", "ARCTANGENT", "ARCTAN2", "SINH", "COSH", "TANH",
    "RADIANS", "DEGREES",
)  # fmt: skip
VECTOR_OPERATIONS = (
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "CROSS_PRODUCT", "PROJECT", "REFLECT", "REFRACT",
    "FACEFORWARD", "DOT_PRODUCT", "DISTANCE", "LENGTH", "SCALE", "NORMALIZE", "ABSOLUTE", "POWER", "SIGN",
    "MINIMUM", "MAXIMUM", "FLOOR", "CEIL", "FRACTION", "MODULO", "WRAP", "SNAP", "SINE", "COSINE", "TANGENT",
)  # fmt: skip
RANGE_STEPS = ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP")


@dataclass(frozen=True)
class Math(Expression):
    """Blender's Math node, applied to each component.

    Attributes
    ----------
    operation
        One of `MATH_OPERATIONS`, in Blender's names.
    clamp
        Whether the result is clamped to [0, 1].
    """

    operation: str
    a: Operand
    b: Operand = 0.0
    c: Operand = 0.0
    clamp: bool = False
    choices: ClassVar = {"operation": MATH_OPERATIONS}


@dataclass(frozen=True)
class VectorMath(Expression):
    """Blender's Vector Math node. A scalar result is repeated in all components.

    Attributes
    ----------
    operation
        One of `VECTOR_OPERATIONS`, in Blender's names.
    scale
        Factor of SCALE, or ratio of the refractive indices of REFRACT.
    """

    operation: str
    a: Operand
    b: Operand = 0.0
    c: Operand = 0.0
    scale: Operand = 1.0
    choices: ClassVar = {"operation": VECTOR_OPERATIONS}


@dataclass(frozen=True)
class Transform(Expression):
    """An affine map of a vector; represents all types of Blender's Mapping node.

    Attributes
    ----------
    matrix
        Three rows of four numbers; the last column is the translation.
    normalize
        Whether the result is normalised (Mapping of type NORMAL).
    """

    vector: Operand
    matrix: tuple[Row, Row, Row]
    normalize: bool = False


@dataclass(frozen=True)
class Channel(Expression):
    """One component (index 0 to 3), repeated in all components."""

    value: Operand
    index: int


@dataclass(frozen=True)
class Combine(Expression):
    """A vector or colour from the first components of three or four values."""

    x: Operand
    y: Operand
    z: Operand
    w: Operand = 1.0


@dataclass(frozen=True)
class Average(Expression):
    """(x + y + z) / 3, repeated: Blender's implicit conversion of a vector to a number."""

    value: Operand


@dataclass(frozen=True)
class MapRange(Expression):
    """Blender's Map Range node, applied to each component.

    Attributes
    ----------
    interpolation
        ``"LINEAR"``, ``"STEPPED"`` (in `steps` steps), ``"SMOOTHSTEP"`` or ``"SMOOTHERSTEP"``.
    vector
        Whether the data type of the node is a vector. An empty range [from_min, from_max] returns `to_min` for
        vectors, and 0 for numbers.
    """

    value: Operand
    from_min: Operand = 0.0
    from_max: Operand = 1.0
    to_min: Operand = 0.0
    to_max: Operand = 1.0
    interpolation: str = "LINEAR"
    steps: Operand = 4.0
    clamp: bool = True
    vector: bool = False
    choices: ClassVar = {"interpolation": RANGE_STEPS}


@dataclass(frozen=True)
class Clamp(Expression):
    """min(max(value, minimum), maximum), for each component.

    Attributes
    ----------
    swap
        Whether the limits are swapped if minimum > maximum (Blender's type RANGE).
    """

    value: Operand
    minimum: Operand = 0.0
    maximum: Operand = 1.0
    swap: bool = False
