"""Nodes that compute with colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .nodes import Expression, Operand

BLENDS = (
    "MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD", "OVERLAY", "SOFT_LIGHT",
    "LINEAR_LIGHT", "DIFFERENCE", "EXCLUSION", "SUBTRACT", "DIVIDE", "HUE", "SATURATION", "COLOR", "VALUE",
)  # fmt: skip
COLOR_MODELS = ("RGB", "HSV", "HSL")


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
