"""Expressions: values that vary over a surface, computed like Blender's shader nodes.

An expression is a tree of frozen dataclasses, in which branches may be shared. A constant operand is a number, or a
tuple of three or four numbers. Each value has four components: a colour with alpha, a vector, or one repeated number.
An operand that should be a number uses the first component. Blender's implicit conversions are separate nodes here:
`Luminance` converts a colour to a number, `Average` a vector. Only `Attribute`, `ImageTexture`, `Ramp` and `Combine`
compute the fourth component (alpha); it is 1 for all other nodes.

Each node computes the same value as the node of the same name in Cycles (Blender 5.0). As there, division by zero and
roots and logarithms of negative numbers return 0.
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


# Check for each field type. Tables and matrices are checked when an expression is compiled
# (`tables.textures.lowering`).
_CHECKS: dict[str, Check] = {
    "Operand": _operand, "Operand | None": optional(_operand), "str": text, "bool": flag, "float": number,
    "int": by(whole, -(2**31), 2**31 - 1),
}


@cache
def _checked_fields(kind: Any) -> tuple[tuple[str, Check], ...]:
    return tuple((f.name, _CHECKS[str(f.type)]) for f in fields(kind) if f.type in _CHECKS)


class Expression:
    """Base class of all nodes."""

    # Maps a field to its allowed words.
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


# ---- Values at the surface point that the ray has hit ----
@dataclass(frozen=True)
class Attribute(Expression):
    """An interpolated attribute of the mesh (UV map, colour, other values); 0 if the mesh does not have it.

    Attributes of one value repeat it; two values become (u, v, 0, 1), three become (x, y, z, 1).

    Attributes
    ----------
    required
        True: a scene is invalid if no mesh with the material has the attribute. False: a missing attribute is 0,
        as in Blender.
    is_position
        Whether the attribute is a position of the surface. `Bump` takes the slope of positions on both sides of a
        surface alike. Bumps of other attributes that rise on the front sink on the back, as in Cycles.
    """

    name: str
    required: bool = field(default=True, compare=False)
    is_position: bool = False


@dataclass(frozen=True)
class Coordinates(Expression):
    """A geometric vector at the hit point, in world space.

    Attributes
    ----------
    kind
        ``"POSITION"``: the hit point, metres. ``"NORMAL"`` (smooth, without normal maps) and ``"TRUE_NORMAL"`` (of
        the triangle): unit normals on the viewer's side. ``"INCOMING"``: unit vector towards the origin of the
        ray. ``"REFLECTION"``: the incoming vector, reflected about the normal. Generated and object coordinates
        are attributes.
    """

    kind: str
    choices: ClassVar = {"kind": COORDINATES}


@dataclass(frozen=True)
class Backfacing(Expression):
    """1 if the ray has hit the back (clockwise) side, else 0."""


@dataclass(frozen=True)
class LightPath(Expression):
    """1 for rays of one kind, else 0.

    Light sampling evaluates emission for no kind at all, as Cycles does. So emission for diffuse rays, say, is found
    only by the share of diffuse rays that multiple importance sampling leaves to rays that meet the surface.

    Attributes
    ----------
    kind
        ``"CAMERA"``, ``"DIFFUSE"``, ``"GLOSSY"``, ``"TRANSMISSION"`` or ``"SHADOW"``.
    """

    kind: str
    choices: ClassVar = {"kind": LIGHT_PATHS}


@dataclass(frozen=True)
class Fresnel(Expression):
    """Reflectance of a smooth dielectric in the direction of the incoming ray.

    Attributes
    ----------
    ior
        Index of refraction relative to the outside; its inverse is used on back faces.
    normal
        Unit vector, or None for the smooth normal.
    """

    ior: Operand = 1.5
    normal: Operand | None = None


@dataclass(frozen=True)
class LayerWeight(Expression):
    """Weight from the angle between the normal and the direction to the viewer.

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
    """A lookup in an image of the scene at `vector`: x to the right, y upwards, both in [0, 1] within the image.

    Attributes
    ----------
    image
        Name in `Scene.images`.
    interpolation
        ``"LINEAR"``, ``"CLOSEST"`` or ``"CUBIC"``.
    extension
        ``"REPEAT"``, ``"EXTEND"``, ``"CLIP"`` (transparent black outside) or ``"MIRROR"``.
    projection
        ``"FLAT"``; ``"BOX"`` (projection from three sides, chosen by the object-space `normal` and mixed over
        the width `blend`); ``"SPHERE"`` or ``"TUBE"`` within the cube [0, 1]^3; ``"EQUIRECTANGULAR"`` or
        ``"MIRROR_BALL"``, for which the vector is a direction.
    alpha
        How alpha affects the colour, for images of four channels. ``"STRAIGHT"``: the interpolation of the colour
        is weighted by alpha, then alpha is divided out (Cycles, if the alpha output is used).
        ``"PREMULTIPLIED"``: the colour is multiplied by alpha (Cycles, if the alpha output is unused).
        ``"CHANNEL_PACKED"``: colour and alpha are independent. ``"NONE"``: like CHANNEL_PACKED, with alpha 1.
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
    """A sampled colour ramp: row i of the table is the colour at i / (n - 1).

    Cycles in Blender 5.0 samples 257 rows.

    Attributes
    ----------
    factor
        Position in the ramp; clamped to [0, 1].
    table
        n >= 2 rows of four numbers.
    interpolate
        Whether to interpolate between rows linearly; False, for Blender's CONSTANT ramps: use the lower row.
    """

    factor: Operand
    table: tuple[Row, ...]
    interpolate: bool = True


@dataclass(frozen=True)
class Curves(Expression):
    """Sampled RGB, vector or float curves: row i is the value at minimum + i / (n - 1) (maximum - minimum).

    Attributes
    ----------
    table
        n >= 2 rows of three numbers, one for each component; 257 in Blender 5.0's Cycles.
    factor
        Interpolation weight: 0 returns `value` itself, 1 the curve.
    extrapolate
        Outside the range, continue the curve linearly (True) or with its end value (False).
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


# ---- Colours ----
@dataclass(frozen=True)
class Mix(Expression):
    """Blender's Mix node. Floats and vectors are mixed with the blend mode ``"MIX"``.

    Attributes
    ----------
    factor
        0 returns `a`. One number, or one for each component (non-uniform vector mix).
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
    """Conversion of a colour between RGB and HSV or HSL, with all coordinates in [0, 1].

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
            raise ValueError("expression ColorModel: exactly one of source and target must be RGB")


@dataclass(frozen=True)
class HueSaturation(Expression):
    """Blender's Hue/Saturation/Value node; hue 0.5 leaves the hue unchanged."""

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
    """Each positive component to the power of gamma."""

    color: Operand
    gamma: Operand = 1.0


@dataclass(frozen=True)
class Invert(Expression):
    """Interpolation between the colour (factor 0) and 1 - color (factor 1)."""

    color: Operand
    factor: Operand = 1.0


@dataclass(frozen=True)
class Luminance(Expression):
    """Rec.709 luminance, repeated: Blender's RGB to BW node and implicit conversion of a colour to a number."""

    color: Operand


def operands(node: Expression) -> Iterator[Expression]:
    """Yield the direct operands of a node that are expressions."""
    for f in fields(node):  # type: ignore[arg-type]
        value = getattr(node, f.name)
        if isinstance(value, Expression):
            yield value


def nodes_of(node: Expression, but: Container[int] = ()) -> list[Expression]:
    """List a node and all nodes below it, each once, with operands before the nodes that use them.

    Parameters
    ----------
    but
        Ids (`id`) of nodes to leave out, together with nodes that only they use.

    Raises
    ------
    ValueError
        If the expression has a cycle.
    """
    # Nodes are compared by identity, and the traversal has its own stack: equality tests and recursion would fail on
    # trees that are deep or share branches many times.
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
    """Names of the attributes that at least one mesh with the material must have."""
    return {found.name for found in nodes_of(node) if isinstance(found, Attribute) and found.required}
