"""Expressions: values that differ from point to point of a surface, as Blender's shader nodes compute them.

An expression is a tree of frozen dataclasses, which may share branches; a number, or a tuple of three or four
numbers, stands for a constant wherever an expression may. Each value has four components: a colour with alpha,
a vector, or one number repeated. Where a number is asked for, the first component counts: Blender's implicit
conversions are nodes of their own here (`Luminance` from a colour, `Average` from a vector). Only `Attribute`,
`ImageTexture`, `Ramp` and `Combine` give an alpha; the fourth component of all other nodes is 1.

Each node does what the node of the same name does in Cycles (Blender 5.0), including its treatment of
infinities: division by zero gives 0, roots and logarithms of negative numbers give 0.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from dataclasses import dataclass, field, fields
from functools import cache
from typing import Any, ClassVar

import numpy as np

from .._check import choice, flag, number, text, whole
from .._fields import Check, by, optional


def _operand(where: str, name: str, value: Any) -> Any:
    if isinstance(value, (Expression, bool, np.bool_)):
        return value
    if not isinstance(value, tuple):
        return number(where, f"operand {name}", value)
    if len(value) not in (3, 4):
        raise ValueError(f"{where}: operand {name} must be a number, a tuple of three or four, or an expression, "
                         f"not a tuple of {len(value)}")
    return tuple(number(where, f"operand {name}", one) for one in value)


# By a field's type, what it may be. Tables and matrices are checked where they become a program's (`lowering`).
_CHECKS: dict[str, Check] = {
    "Operand": _operand, "Operand | None": optional(_operand), "str": text, "bool": flag, "float": number,
    "int": by(whole, -(2**31), 2**31 - 1),
}


@cache
def _checked_fields(kind: Any) -> tuple[tuple[str, Check], ...]:
    return tuple((f.name, _CHECKS[str(f.type)]) for f in fields(kind) if f.type in _CHECKS)


class Expression:
    """Base of all nodes."""

    # Field to the words that it may be.
    choices: ClassVar[dict[str, tuple[str, ...]]] = {}

    def __post_init__(self) -> None:
        where = f"expression {type(self).__name__}"
        kind: Any = type(self)
        for name, check in _checked_fields(kind):
            check(where, name, getattr(self, name))
        for name, among in self.choices.items():
            choice(where, name, getattr(self, name), among)


Operand = Expression | float | tuple[float, ...]
Row = tuple[float, float, float, float]

COORDINATES = ("POSITION", "NORMAL", "TRUE_NORMAL", "INCOMING", "REFLECTION")
LIGHT_PATHS = ("CAMERA", "DIFFUSE", "GLOSSY", "TRANSMISSION", "SHADOW")
INTERPOLATIONS = ("LINEAR", "CLOSEST", "CUBIC")
EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")
PROJECTIONS = ("FLAT", "BOX", "SPHERE", "TUBE", "EQUIRECTANGULAR", "MIRROR_BALL")
ALPHA_MODES = ("STRAIGHT", "PREMULTIPLIED", "CHANNEL_PACKED", "NONE")
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
BLENDS = (
    "MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "OVERLAY", "SOFT_LIGHT",
    "LINEAR_LIGHT", "DIFFERENCE", "EXCLUSION", "SUBTRACT", "DIVIDE", "HUE", "SATURATION", "COLOR", "VALUE",
)  # fmt: skip
COLOR_MODELS = ("RGB", "HSV", "HSL")
RANGE_STEPS = ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP")


# ---- Where the ray has met the surface ----
@dataclass(frozen=True)
class Attribute(Expression):
    """A mesh's attribute, interpolated: UV map, colour, any values; 0 where the mesh has none of that name.

    One value per corner is repeated, two are (u, v, 0, 1), three (x, y, z, 1).

    Attributes
    ----------
    required
        Whether a scene is refused in which no mesh with the material has the attribute; False: it is 0 there, as in
        Blender.
    """

    name: str
    required: bool = field(default=True, compare=False)


@dataclass(frozen=True)
class Coordinates(Expression):
    """A vector that the hit itself gives, in world space.

    Attributes
    ----------
    kind
        ``"POSITION"``; ``"NORMAL"`` (smooth, without normal maps) and ``"TRUE_NORMAL"`` (of the triangle), unit
        vectors on the viewer's side; ``"INCOMING"``, the unit vector to where the ray came from;
        ``"REFLECTION"``, that one mirrored at the normal. Generated and object coordinates are attributes.
    """

    kind: str
    choices: ClassVar = {"kind": COORDINATES}


@dataclass(frozen=True)
class Backfacing(Expression):
    """1 where the ray has met the back (clockwise) side, else 0."""


@dataclass(frozen=True)
class LightPath(Expression):
    """1 for rays of one kind, else 0.

    Attributes
    ----------
    kind
        ``"CAMERA"``, ``"DIFFUSE"``, ``"GLOSSY"``, ``"TRANSMISSION"`` or ``"SHADOW"``.
    """

    kind: str
    choices: ClassVar = {"kind": LIGHT_PATHS}


@dataclass(frozen=True)
class Fresnel(Expression):
    """Reflectance of a smooth dielectric of some IOR, seen from where the ray came from.

    Attributes
    ----------
    ior
        Relative to the outside; inside (backfacing) its inverse is used.
    normal
        Unit vector, or None for the smooth normal.
    """

    ior: Operand = 1.5
    normal: Operand | None = None


@dataclass(frozen=True)
class LayerWeight(Expression):
    """Weight that depends on the angle between normal and viewer.

    Attributes
    ----------
    output
        ``"FRESNEL"`` or ``"FACING"``.
    """

    output: str
    blend: Operand = 0.5
    normal: Operand | None = None
    choices: ClassVar = {"output": ("FRESNEL", "FACING")}


# ---- Images and tables ----
@dataclass(frozen=True)
class ImageTexture(Expression):
    """An image of the scene at `vector` (x to the right, y upwards, [0, 1] is the image once).

    Attributes
    ----------
    image
        Name in `Scene.images`.
    interpolation
        ``"LINEAR"``, ``"CLOSEST"`` or ``"CUBIC"``.
    extension
        ``"REPEAT"``, ``"EXTEND"``, ``"CLIP"`` (transparent black outside) or ``"MIRROR"``.
    projection
        ``"FLAT"``; ``"BOX"`` (the three sides of a cube by the object-space `normal`, mixed over the width
        `blend`); ``"SPHERE"`` or ``"TUBE"`` in the cube [0, 1]; ``"EQUIRECTANGULAR"`` or ``"MIRROR_BALL"``
        (the vector is a direction).
    alpha
        What a transparent pixel's colour is: ``"STRAIGHT"``, interpolated in proportion to alpha and not darkened
        by it (Cycles, where the alpha output is in use); ``"PREMULTIPLIED"``, multiplied by alpha (Cycles, where
        it is not); ``"CHANNEL_PACKED"``, colour and alpha have nothing to do with each other; ``"NONE"``, the same
        with alpha 1. They differ for images of four channels only.
    """

    image: str
    vector: Operand
    interpolation: str = "LINEAR"
    extension: str = "REPEAT"
    projection: str = "FLAT"
    alpha: str = "STRAIGHT"
    blend: float = 0.0
    normal: Operand = (0.0, 0.0, 1.0)
    choices: ClassVar = {"interpolation": INTERPOLATIONS, "extension": EXTENSIONS, "projection": PROJECTIONS,
                         "alpha": ALPHA_MODES}


@dataclass(frozen=True)
class Ramp(Expression):
    """A colour ramp, sampled: row i of the table is its colour at i / (n - 1). Blender 5.0's
    Cycles takes 257 rows.

    Attributes
    ----------
    factor
        Clamped to [0, 1].
    table
        n >= 2 rows of four numbers.
    interpolate
        False for Blender's CONSTANT ramps: the row below.
    """

    factor: Operand
    table: tuple[Row, ...]
    interpolate: bool = True


@dataclass(frozen=True)
class Curves(Expression):
    """RGB, vector and float curves, sampled: row i of the table is at minimum + i / (n - 1) (maximum - minimum).

    Attributes
    ----------
    table
        n >= 2 rows of three numbers, one for each component; 257 in Blender 5.0's Cycles.
    factor
        0: `value` itself, 1: the curve.
    extrapolate
        Whether the curve goes on straight outside of its range, or level.
    """

    value: Operand
    table: tuple[tuple[float, float, float], ...]
    factor: Operand = 1.0
    minimum: float = 0.0
    maximum: float = 1.0
    extrapolate: bool = True


# ---- Numbers and vectors ----
@dataclass(frozen=True)
class Math(Expression):
    """Blender's Math node, on each component by itself.

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
    """Blender's Vector Math node; operations with a number as result repeat it.

    Attributes
    ----------
    operation
        One of `VECTOR_OPERATIONS`, in Blender's names.
    scale
        Of SCALE; the ratio of refractive indices of REFRACT.
    """

    operation: str
    a: Operand
    b: Operand = 0.0
    c: Operand = 0.0
    scale: Operand = 1.0
    choices: ClassVar = {"operation": VECTOR_OPERATIONS}


@dataclass(frozen=True)
class Transform(Expression):
    """An affine map of a vector: Blender's Mapping node of any type is one.

    Attributes
    ----------
    matrix
        Three rows of four numbers, the last column is added.
    normalize
        Whether the result is made a unit vector (Mapping of type NORMAL).
    """

    vector: Operand
    matrix: tuple[Row, Row, Row]
    normalize: bool = False


@dataclass(frozen=True)
class Channel(Expression):
    """One component (0 to 3), repeated."""

    value: Operand
    index: int


@dataclass(frozen=True)
class Combine(Expression):
    """A vector or colour of the first components of three (four) values."""

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
    """Blender's Map Range node, on each component by itself.

    Attributes
    ----------
    interpolation
        ``"LINEAR"``, ``"STEPPED"`` (in `steps` steps), ``"SMOOTHSTEP"`` or ``"SMOOTHERSTEP"``.
    vector
        Whether the node's data type is a vector: an empty range then gives `to_min`, else 0.
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
    """min(max(value, minimum), maximum), on each component by itself.

    Attributes
    ----------
    swap
        Whether the limits are swapped where minimum > maximum (Blender's type RANGE).
    """

    value: Operand
    minimum: Operand = 0.0
    maximum: Operand = 1.0
    swap: bool = False


# ---- Colours ----
@dataclass(frozen=True)
class Mix(Expression):
    """Blender's Mix node; of floats and vectors too, as blend ``"MIX"``.

    Attributes
    ----------
    factor
        0: `a`; one number, or one for each component (non-uniform vector mix).
    blend
        One of `BLENDS`, in Blender's names.
    """

    factor: Operand
    a: Operand
    b: Operand
    blend: str = "MIX"
    clamp_factor: bool = True
    clamp_result: bool = False
    choices: ClassVar = {"blend": BLENDS}


@dataclass(frozen=True)
class ColorModel(Expression):
    """A colour in other coordinates, each in [0, 1]: RGB to or from HSV or HSL.

    Attributes
    ----------
    source, target
        ``"RGB"``, ``"HSV"`` or ``"HSL"``; one of them is ``"RGB"``.
    """

    color: Operand
    source: str
    target: str
    choices: ClassVar = {"source": COLOR_MODELS, "target": COLOR_MODELS}

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.source == "RGB") == (self.target == "RGB"):
            raise ValueError("expression ColorModel: one of source and target must be RGB")


@dataclass(frozen=True)
class HueSaturation(Expression):
    """Blender's Hue/Saturation/Value node; hue 0.5 changes nothing."""

    color: Operand
    hue: Operand = 0.5
    saturation: Operand = 1.0
    value: Operand = 1.0
    factor: Operand = 1.0


@dataclass(frozen=True)
class BrightContrast(Expression):
    """Blender's Brightness/Contrast node."""

    color: Operand
    brightness: Operand = 0.0
    contrast: Operand = 0.0


@dataclass(frozen=True)
class Gamma(Expression):
    """Each component, where it is positive, to the power of gamma."""

    color: Operand
    gamma: Operand = 1.0


@dataclass(frozen=True)
class Invert(Expression):
    """1 - color, in proportion to the factor."""

    color: Operand
    factor: Operand = 1.0


@dataclass(frozen=True)
class Luminance(Expression):
    """Rec.709 luminance, repeated: RGB to BW, and Blender's implicit conversion of a colour to a number."""

    color: Operand


def operands(node: Expression) -> Iterator[Expression]:
    """The nodes that feed a node."""
    for f in fields(node):  # type: ignore[arg-type]
        value = getattr(node, f.name)
        if isinstance(value, Expression):
            yield value


def nodes_of(node: Expression, but: Container[int] = ()) -> list[Expression]:
    """A node and all nodes below it, each once, operands before those that use them.

    Parameters
    ----------
    but
        Ids of nodes to leave out, with what only they use.

    Raises
    ------
    ValueError
        If a node is a part of itself.
    """
    # By identity and without recursion: trees may share branches many times over, and be deep.
    found: dict[int, Expression] = {}
    open_: set[int] = set()  # nodes between the root and the top of the stack
    stack: list[tuple[Expression, bool]] = [(node, False)]
    while stack:
        top, ready = stack.pop()
        key = id(top)
        if key in found or key in but:
            continue
        if ready:
            open_.discard(key)
            found[key] = top
            continue
        if key in open_:
            raise ValueError(f"expression {type(top).__name__} is a part of itself; expressions must not have cycles")
        open_.add(key)
        stack.append((top, True))
        stack.extend((operand, False) for operand in operands(top))
    return list(found.values())


def images_of(node: Expression) -> set[str]:
    """Names of all images that an expression reads."""
    return {found.image for found in nodes_of(node) if isinstance(found, ImageTexture)}


def required_attributes(node: Expression) -> set[str]:
    """Names of the attributes that some mesh must have."""
    return {found.name for found in nodes_of(node) if isinstance(found, Attribute) and found.required}
