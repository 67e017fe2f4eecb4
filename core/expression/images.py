"""Nodes that look up images and tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .nodes import Expression, Operand, Row, nodes_of

INTERPOLATIONS = ("LINEAR", "CLOSEST", "CUBIC")
EXTENSIONS = ("REPEAT", "EXTEND", "CLIP", "MIRROR")
PROJECTIONS = ("FLAT", "BOX", "SPHERE", "TUBE", "EQUIRECTANGULAR", "MIRROR_BALL")
ALPHA_MODES = ("STRAIGHT", "PREMULTIPLIED", "CHANNEL_PACKED", "NONE")


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


def images_of(node: Expression) -> set[str]:
    """Names of all images that an expression reads."""
    return {found.image for found in nodes_of(node) if isinstance(found, ImageTexture)}
