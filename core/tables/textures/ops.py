"""Steps of texture programs: the operations on single numbers that all expressions come down to.

A `Builder` collects steps; a value is a constant or one output of a step. Equal steps are built once, and
steps on constants are computed at once where `_FOLDED` knows how.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# In the order of native/scene/textures/opcodes.h.
OPCODES = (
    "OUTPUT", "POSITION", "NORMAL", "TRUE_NORMAL", "INCOMING", "BACKFACING", "RAY_KIND", "ATTRIBUTE", "IMAGE", "LOOKUP",
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "AFFINE", "MINIMUM", "MAXIMUM", "CLAMP", "LESS_THAN",
    "GREATER_THAN", "EQUAL", "SELECT", "ABSOLUTE", "SIGN", "FLOOR", "CEIL", "SQRT", "INVERSE_SQRT", "POWER", "LOG",
    "EXPONENT", "MODULO", "SINE", "COSINE", "TANGENT", "ARCSINE", "ARCCOSINE", "ARCTAN2", "SINH", "COSH", "TANH",
    "FRESNEL", "RGB_TO_HSV", "HSV_TO_RGB", "RGB_TO_HSL", "HSL_TO_RGB", "CHECKER", "BRICK", "WHITE_NOISE", "NOISE",
    "VORONOI", "SURFACE_TANGENT", "BARYCENTRICS", "ATTRIBUTE_AT", "BUMP", "NORMAL_MAP",
    "SQUARE_SCALE", "RAY_BOUNCES", "RAY_LENGTH",
)  # fmt: skip


class Output(NamedTuple):
    """One output of a step."""

    step: int
    place: int


class Number(float):
    """A constant that stays one of its own, since it is a parameter: equal to itself alone, and never folded."""

    def __eq__(self, other: object) -> bool:
        return self is other

    def __ne__(self, other: object) -> bool:
        return self is not other

    def __hash__(self) -> int:
        return id(self)


Value = float | Output


@dataclass(frozen=True)
class Step:
    """One operation; `data` is what is no number: of an image, table, column, or a choice."""

    op: str
    data: int
    inputs: tuple[Value, ...]


def _fmod(a: float, b: float) -> float:
    return float(np.fmod(a, b)) if b != 0.0 else 0.0


def _power(a: float, b: float) -> float:
    if b == 0.0:
        return 1.0
    if a == 0.0 or (a < 0.0 and b != np.trunc(b)):
        return 0.0
    return float(np.power(np.float64(a), b))


def _square_scale(*v: float) -> float:
    with np.errstate(over="ignore"):
        square = np.float32(sum(np.square(np.asarray(v, np.float32))))
    return 1.0 if square < 2.0**64 else 2.0**-32 if np.isfinite(square) else 0.0


# What native/texture/interpreter.cpp computes, of constants.
_FOLDED: dict[str, Callable[..., float]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b != 0.0 else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "AFFINE": lambda x, a, y, b, z, c, d: x * a + y * b + z * c + d,
    "MINIMUM": min,
    "MAXIMUM": max,
    "CLAMP": lambda a, low, high: min(max(a, low), high),
    "LESS_THAN": lambda a, b: float(a < b),
    "GREATER_THAN": lambda a, b: float(a > b),
    "EQUAL": lambda a, b: float(a == b),
    "SELECT": lambda m, a, b: a if m != 0.0 else b,
    "ABSOLUTE": abs,
    "SIGN": lambda a: float(np.sign(a)),
    "FLOOR": lambda a: float(np.floor(a)),
    "CEIL": lambda a: float(np.ceil(a)),
    "SQRT": lambda a: float(np.sqrt(max(a, 0.0))),
    "INVERSE_SQRT": lambda a: float(1.0 / np.sqrt(a)) if a > 0.0 else 0.0,
    "SQUARE_SCALE": _square_scale,
    "POWER": _power,
    "LOG": lambda a: float(np.log(a)) if a > 0.0 else 0.0,
    "EXPONENT": lambda a: float(np.exp(a)),
    "MODULO": _fmod,
    "SINE": lambda a: float(np.sin(a)),
    "COSINE": lambda a: float(np.cos(a)),
    "TANGENT": lambda a: float(np.tan(a)),
    "ARCSINE": lambda a: float(np.arcsin(np.clip(a, -1.0, 1.0))),
    "ARCCOSINE": lambda a: float(np.arccos(np.clip(a, -1.0, 1.0))),
    "ARCTAN2": lambda a, b: float(np.arctan2(a, b)),
    "SINH": lambda a: float(np.sinh(a)),
    "COSH": lambda a: float(np.cosh(a)),
    "TANH": lambda a: float(np.tanh(a)),
}


def _same(op: str, inputs: tuple[Value, ...]) -> Value | None:
    """The operand, or constant, that a step changes nothing about."""
    a, b = inputs[0], inputs[1] if len(inputs) > 1 else None
    if op == "SELECT" and isinstance(a, float) and not isinstance(a, Number):
        return inputs[1] if a != 0.0 else inputs[2]
    if op == "SELECT" and inputs[1] == inputs[2]:
        return inputs[1]
    if op == "MULTIPLY_ADD" and inputs[2] == 0.0:
        return _same("MULTIPLY", (inputs[0], inputs[1]))
    if (op in ("ADD", "SUBTRACT") and b == 0.0) or (op in ("MULTIPLY", "DIVIDE", "POWER") and b == 1.0):
        return a
    if (op == "ADD" and a == 0.0) or (op == "MULTIPLY" and a == 1.0):
        return b
    if op == "MULTIPLY" and (a == 0.0 or b == 0.0):
        return 0.0
    return None


class Builder:
    """The steps of one program, each after those that it needs."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self._known: dict[Step, int] = {}

    def emit(self, op: str, *inputs: Value, data: int = 0) -> Value:
        """The first output of a step."""
        return self.emit_all(op, *inputs, data=data, count=1)[0]

    def emit_all(self, op: str, *inputs: Value, data: int = 0, count: int = 4) -> tuple[Value, ...]:
        """All outputs of a step."""
        inputs = tuple(v if isinstance(v, (Output, Number)) else float(np.float32(v)) for v in inputs)
        if op in _FOLDED:
            constants = [v for v in inputs if not isinstance(v, (Output, Number))]
            if len(constants) == len(inputs):
                with np.errstate(all="ignore"):
                    return (float(np.float32(_FOLDED[op](*constants))),)
            same = _same(op, inputs)
            if same is not None:
                return (same,)
        step = Step(op, data, inputs)
        if step not in self._known:
            self._known[step] = len(self.steps)
            self.steps.append(step)
        return tuple(Output(self._known[step], k) for k in range(count))
