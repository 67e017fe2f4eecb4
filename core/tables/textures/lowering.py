"""From expressions to the steps of texture programs: what rules for each kind of expression are written with.

The rules themselves are in lower_math.py, lower_color.py, lower_image.py, lower_normal.py and lower_procedural.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from ... import expression as e
from ...expression import Expression, nodes_of
from .ops import Builder, Number, Value

Components = tuple[Value, ...]  # x, y, z, w


@dataclass
class Resources:
    """What programs refer to by number: images as nodes read them, tables, attributes, each once."""

    images: dict[tuple[str, str, str, str], int] = field(default_factory=dict)
    tables: dict[tuple[Any, bool, bool], int] = field(default_factory=dict)
    attributes: dict[str, int] = field(default_factory=dict)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def image(self, name: str, interpolation: str, extension: str, alpha: str) -> int:
        """Number of an image as one kind of node reads it."""
        return self.images.setdefault((name, interpolation, extension, alpha), len(self.images))

    def table(self, rows: tuple[Any, ...], interpolate: bool, extrapolate: bool) -> int:
        """Number of a lookup table."""
        return self.tables.setdefault((rows, interpolate, extrapolate), len(self.tables))

    def attribute(self, name: str) -> int:
        """Number of a mesh attribute."""
        return self.attributes.setdefault(name, len(self.attributes))


@dataclass(frozen=True)
class Shift:
    """A point beside the hit point, in the plane of the hit face.

    Attributes
    ----------
    axis
        Which of two orthogonal tangents leads to it.
    step
        Its distance, metres.
    """

    axis: int
    step: Value


class Lowering:
    """Turns expressions into a program's steps."""

    def __init__(self, build: Builder, resources: Resources) -> None:
        self.build = build
        self.resources = resources
        self.shift: Shift | None = None  # where values are computed; None: at the hit point
        self._done: dict[int, Components] = {}  # at `shift`
        self._done_at: dict[Shift | None, dict[int, Components]] = {None: self._done}
        self._kept: list[Expression] = []  # ids stay valid while their objects live

    @contextmanager
    def at(self, shift: Shift | None) -> Iterator[None]:
        """Compute values at another point within the block."""
        before = self.shift, self._done
        self.shift, self._done = shift, self._done_at.setdefault(shift, {})
        try:
            yield
        finally:
            self.shift, self._done = before

    def displacement(self) -> Components:
        """Vector from the hit point to the point of `shift`."""
        if self.shift is None:
            return (0.0, 0.0, 0.0)
        direction = self.build.emit_all("SURFACE_TANGENT", count=3)
        if self.shift.axis == 1:
            direction = self.crossed(self.build.emit_all("TRUE_NORMAL", count=3), direction)
        return tuple(self.mul(self.shift.step, x) for x in direction)

    def components(self, node: e.Operand) -> Components:
        """The components of an expression or constant."""
        if not isinstance(node, Expression):
            return _operand(node)
        # Rules ask for their operands' components, which are known by then: only what is new is walked through.
        for step in nodes_of(node, but=self._done):
            rule = RULES.get(type(step))
            if rule is None:
                raise ValueError(f"expression {type(step).__name__} has no rule to be computed by")
            self._done[id(step)] = rule(self, step)
            self._kept.append(step)
        return self._done[id(node)]

    def number(self, node: e.Operand) -> Value:
        """The first component."""
        return self.components(node)[0]

    # ---- Shorthands for steps ----
    def add(self, a: Value, b: Value) -> Value:
        return self.build.emit("ADD", a, b)

    def sub(self, a: Value, b: Value) -> Value:
        return self.build.emit("SUBTRACT", a, b)

    def mul(self, a: Value, b: Value) -> Value:
        return self.build.emit("MULTIPLY", a, b)

    def div(self, a: Value, b: Value) -> Value:
        return self.build.emit("DIVIDE", a, b)

    def mad(self, a: Value, b: Value, c: Value) -> Value:
        return self.build.emit("MULTIPLY_ADD", a, b, c)

    def floor(self, a: Value) -> Value:
        return self.build.emit("FLOOR", a)

    def fract(self, a: Value) -> Value:
        return self.sub(a, self.floor(a))

    def clamp(self, a: Value, low: Value = 0.0, high: Value = 1.0) -> Value:
        return self.build.emit("CLAMP", a, low, high)

    def less(self, a: Value, b: Value) -> Value:
        return self.build.emit("LESS_THAN", a, b)

    def select(self, mask: Value, a: Value, b: Value) -> Value:
        return self.build.emit("SELECT", mask, a, b)

    def lerp(self, a: Value, b: Value, t: Value) -> Value:
        return self.mad(t, self.sub(b, a), a)

    def dot(self, a: Components, b: Components) -> Value:
        return self.build.emit("AFFINE", a[0], b[0], a[1], b[1], a[2], b[2], 0.0)

    def crossed(self, a: Components, b: Components) -> Components:
        """Cross product."""
        return tuple(self.sub(self.mul(a[i], b[j]), self.mul(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1)))

    def normalized(self, v: Components) -> Components:
        """Unit vector; zero stays zero. If no float holds the vector's square, it becomes zero, as in Cycles."""
        scale = self.build.emit("SQUARE_SCALE", *v[:3])
        held = vector(*(self.mul(x, scale) for x in v[:3]))
        inverse = self.build.emit("INVERSE_SQRT", self.dot(held, held))
        return vector(*(self.mul(x, inverse) for x in held[:3]))

    def reflected(self, v: Components, n: Components) -> Components:
        """v - 2 (v . n) n."""
        twice = self.mul(-2.0, self.dot(v, n))
        return vector(*(self.mad(twice, b, a) for a, b in zip(v[:3], n[:3], strict=True)))


Rule = Callable[[Lowering, Any], Components]
RULES: dict[type[Expression], Rule] = {}


def rule(kind: type[Expression]) -> Callable[[Rule], Rule]:
    """Registers how a kind of expression is computed."""

    def register(function: Rule) -> Rule:
        RULES[kind] = function
        return function

    return register


def _operand(value: Any) -> Components:
    numbers = tuple(constant(v) for v in (value if isinstance(value, tuple) else (value,) * 4))
    return (*numbers, 1.0)[:4]


def constant(value: Any) -> float:
    """A float, unless it is a parameter: that stays a `Number`."""
    return value if isinstance(value, Number) else float(value)


def vector(x: Value, y: Value, z: Value) -> Components:
    """Three components and w = 1."""
    return (x, y, z, 1.0)


def colored(channels: Sequence[Value]) -> Components:
    """Three components, and as w that of a number if all are equal, else the 1 of a colour."""
    return (*channels, channels[0] if channels[0] == channels[1] == channels[2] else 1.0)


def repeated(a: Value) -> Components:
    """One number as a value."""
    return (a, a, a, a)
