"""How each expression is computed: its four components as steps of a texture program.

The formulas are those of Cycles' shader nodes (intern/cycles/kernel/svm, Blender 5.0), which its manual
describes; names of operands follow the expressions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ... import expression as e
from ..._check import array
from .lowering import Components, Lowering, colored, constant, repeated, rule, vector
from .ops import Value


# ---- Where the ray has met the surface ----
@rule(e.Attribute)
def _attribute(low: Lowering, node: e.Attribute) -> Components:
    number = low.resources.attribute(node.name)
    if low.shift is None:
        return low.build.emit_all("ATTRIBUTE", data=number)
    shift, mirrored = low.displacement(), not node.is_position
    place = low.build.emit_all("BARYCENTRICS", *shift, data=int(mirrored), count=2)
    return low.build.emit_all("ATTRIBUTE_AT", *place, *shift, float(mirrored), data=number)


@rule(e.Coordinates)
def _coordinates(low: Lowering, node: e.Coordinates) -> Components:
    if node.kind == "REFLECTION":
        incoming = vector(*low.build.emit_all("INCOMING", count=3))
        normal = vector(*low.build.emit_all("NORMAL", count=3))
        mirrored = low.reflected(incoming, normal)
        return vector(*(low.mul(-1.0, x) for x in mirrored[:3]))
    found = low.build.emit_all(node.kind, count=3)
    if node.kind == "POSITION":
        # The origin is added last: it may be large, and shifts are small.
        found = tuple(low.add(low.add(x, d), o)
                      for x, o, d in zip(found, low.resources.origin, low.displacement(), strict=True))
    return vector(*found)


@rule(e.Backfacing)
def _backfacing(low: Lowering, node: e.Backfacing) -> Components:
    return repeated(low.build.emit("BACKFACING"))


@rule(e.LightPath)
def _light_path(low: Lowering, node: e.LightPath) -> Components:
    return repeated(low.build.emit("RAY_KIND", data=e.LIGHT_PATHS.index(node.kind)))


@rule(e.RayBounces)
def _ray_bounces(low: Lowering, node: e.RayBounces) -> Components:
    return repeated(low.build.emit("RAY_BOUNCES", data=e.BOUNCES.index(node.kind)))


@rule(e.RayLength)
def _ray_length(low: Lowering, node: e.RayLength) -> Components:
    return repeated(low.build.emit("RAY_LENGTH"))


def _cosine(low: Lowering, normal: e.Operand | None) -> Value:
    n = vector(*low.build.emit_all("NORMAL", count=3)) if normal is None else low.components(normal)
    return low.dot(vector(*low.build.emit_all("INCOMING", count=3)), n)


@rule(e.Fresnel)
def _fresnel(low: Lowering, node: e.Fresnel) -> Components:
    ior = low.build.emit("MAXIMUM", low.number(node.ior), 1e-5)
    relative = low.select(low.build.emit("BACKFACING"), low.div(1.0, ior), ior)
    return repeated(low.build.emit("FRESNEL", _cosine(low, node.normal), relative))


@rule(e.LayerWeight)
def _layer_weight(low: Lowering, node: e.LayerWeight) -> Components:
    cosine, blend = _cosine(low, node.normal), low.number(node.blend)
    if node.output == "FRESNEL":
        eta = low.build.emit("MAXIMUM", low.sub(1.0, blend), 1e-5)
        relative = low.select(low.build.emit("BACKFACING"), eta, low.div(1.0, eta))
        return repeated(low.build.emit("FRESNEL", cosine, relative))
    b = low.clamp(blend, 0.0, 1.0 - 1e-5)
    exponent = low.select(low.less(b, 0.5), low.mul(2.0, b), low.div(0.5, low.sub(1.0, b)))
    return repeated(low.sub(1.0, low.build.emit("POWER", low.build.emit("ABSOLUTE", cosine), exponent)))


# ---- Images and tables ----
@rule(e.Ramp)
def _ramp(low: Lowering, node: e.Ramp) -> Components:
    table = low.resources.table(_checked_table("Ramp", node.table, 4), node.interpolate, False)
    return low.build.emit_all("LOOKUP", low.number(node.factor), data=table)


@rule(e.Curves)
def _curves(low: Lowering, node: e.Curves) -> Components:
    table, factor = _checked_table("Curves", node.table, 3), low.number(node.factor)
    if node.maximum <= node.minimum:
        raise ValueError("expression Curves: maximum must be above minimum")
    out = []
    for k, x in enumerate(low.components(node.value)[:3]):
        position = low.div(low.sub(x, node.minimum), low.sub(node.maximum, node.minimum))
        column = low.resources.table(tuple((row[k],) for row in table), True, node.extrapolate)
        out.append(low.lerp(x, low.build.emit("LOOKUP", position, data=column), factor))
    return vector(*out)


def _checked_table(kind: str, table: tuple[Any, ...], columns: int) -> tuple[tuple[float, ...], ...]:
    if len(array(f"expression {kind}", "table", table, (None, columns), np.float64)) < 2:
        raise ValueError(f"expression {kind}: table must have at least two rows")
    return tuple(tuple(constant(x) for x in row) for row in table)


# ---- Numbers and vectors ----
@rule(e.Math)
def _math(low: Lowering, node: e.Math) -> Components:
    operation = MATH[node.operation]
    columns = zip(*(low.components(v)[:3] for v in (node.a, node.b, node.c)), strict=True)
    out = [operation(low, a, b, c) for a, b, c in columns]
    if node.clamp:
        out = [low.clamp(x) for x in out]
    return colored(out)


def _wrap(low: Lowering, a: Value, high: Value, low_end: Value) -> Value:
    width = low.sub(high, low_end)
    turns = low.floor(low.div(low.sub(a, low_end), width))
    return low.select(low.build.emit("EQUAL", width, 0.0), low_end, low.sub(a, low.mul(width, turns)))


def _floored_modulo(low: Lowering, a: Value, b: Value) -> Value:
    inside = low.sub(a, low.mul(low.floor(low.div(a, b)), b))
    return low.select(low.build.emit("EQUAL", b, 0.0), 0.0, inside)


def _ping_pong(low: Lowering, a: Value, b: Value) -> Value:
    turn = low.mul(low.mul(low.fract(low.div(low.sub(a, b), low.mul(b, 2.0))), b), 2.0)
    return low.select(low.build.emit("EQUAL", b, 0.0), 0.0, low.build.emit("ABSOLUTE", low.sub(turn, b)))


def _smooth_minimum(low: Lowering, a: Value, b: Value, k: Value) -> Value:
    apart = low.build.emit("ABSOLUTE", low.sub(a, b))
    h = low.div(low.build.emit("MAXIMUM", low.sub(k, apart), 0.0), k)
    dip = low.mul(low.mul(low.mul(low.mul(h, h), h), k), 1.0 / 6.0)
    return low.sub(low.build.emit("MINIMUM", a, b), dip)


def _logarithm(low: Lowering, a: Value, b: Value) -> Value:
    # LOG is 0 where its operand is not positive, and DIVIDE is 0 where b's is.
    return low.div(low.build.emit("LOG", a), low.build.emit("LOG", b))


def _compare(low: Lowering, a: Value, b: Value, c: Value) -> Value:
    apart = low.build.emit("ABSOLUTE", low.sub(a, b))
    within = low.build.emit("MAXIMUM", c, float(np.finfo(np.float32).eps))
    return low.sub(1.0, low.build.emit("GREATER_THAN", apart, within))


def _truncated(low: Lowering, a: Value) -> Value:
    return low.select(low.less(a, 0.0), low.build.emit("CEIL", a), low.floor(a))


Operation = Callable[[Lowering, Value, Value, Value], Value]


def _step(op: str, count: int) -> Operation:
    return lambda low, *operands: low.build.emit(op, *operands[:count])


MATH: Mapping[str, Operation] = {
    **{op: _step(op, 1) for op in ("SQRT", "INVERSE_SQRT", "ABSOLUTE", "EXPONENT", "SIGN", "FLOOR", "CEIL", "SINE",
                                   "COSINE", "TANGENT", "ARCSINE", "ARCCOSINE", "SINH", "COSH", "TANH")},
    **{op: _step(op, 2) for op in ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "POWER", "MINIMUM", "MAXIMUM", "LESS_THAN",
                                   "GREATER_THAN", "MODULO", "ARCTAN2")},
    "MULTIPLY_ADD": _step("MULTIPLY_ADD", 3),
    "LOGARITHM": lambda low, a, b, c: _logarithm(low, a, b),
    "COMPARE": _compare,
    "SMOOTH_MIN": _smooth_minimum,
    "SMOOTH_MAX": lambda low, a, b, c: low.mul(-1.0, _smooth_minimum(low, low.mul(-1.0, a), low.mul(-1.0, b), c)),
    "ROUND": lambda low, a, b, c: low.floor(low.add(a, 0.5)),
    "TRUNC": lambda low, a, b, c: _truncated(low, a),
    "FRACT": lambda low, a, b, c: low.fract(a),
    "FLOORED_MODULO": lambda low, a, b, c: _floored_modulo(low, a, b),
    "WRAP": _wrap,
    "SNAP": lambda low, a, b, c: low.mul(low.floor(low.div(a, b)), b),
    "PINGPONG": lambda low, a, b, c: _ping_pong(low, a, b),
    "ARCTANGENT": lambda low, a, b, c: low.build.emit("ARCTAN2", a, 1.0),
    "RADIANS": lambda low, a, b, c: low.mul(a, np.pi / 180.0),
    "DEGREES": lambda low, a, b, c: low.mul(a, 180.0 / np.pi),
}  # fmt: skip

# Vector operations that are the number's on each component.
_BY_COMPONENT = {
    **{op: op for op in ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "ABSOLUTE", "POWER", "SIGN",
                         "MINIMUM", "MAXIMUM", "FLOOR", "CEIL", "MODULO", "SNAP", "SINE", "COSINE", "TANGENT")},
    "FRACTION": "FRACT",
}  # fmt: skip


@rule(e.VectorMath)
def _vector_math(low: Lowering, node: e.VectorMath) -> Components:
    a, b, c = (low.components(v)[:3] for v in (node.a, node.b, node.c))
    op, emit = node.operation, low.build.emit
    if op in _BY_COMPONENT:
        operation = MATH[_BY_COMPONENT[op]]
        return vector(*(operation(low, *xs) for xs in zip(a, b, c, strict=True)))
    if op == "WRAP":
        return vector(*(low.add(_floored_modulo(low, low.sub(x, z), low.sub(y, z)), z)
                        for x, y, z in zip(a, b, c, strict=True)))
    if op == "DOT_PRODUCT":
        return repeated(low.dot(a, b))
    if op == "LENGTH":
        return repeated(emit("SQRT", low.dot(a, a)))
    if op == "DISTANCE":
        d = vector(*(low.sub(x, y) for x, y in zip(a, b, strict=True)))
        return repeated(emit("SQRT", low.dot(d, d)))
    if op == "SCALE":
        scale = low.number(node.scale)
        return vector(*(low.mul(x, scale) for x in a))
    if op == "NORMALIZE":
        return low.normalized(a)
    if op == "CROSS_PRODUCT":
        return vector(*low.crossed(a, b))
    if op == "PROJECT":
        share = low.div(low.dot(a, b), low.dot(b, b))
        return vector(*(low.mul(share, y) for y in b))
    if op == "REFLECT":
        return low.reflected(a, low.normalized(b))
    if op == "FACEFORWARD":
        flip = low.select(low.less(low.dot(c, b), 0.0), 1.0, -1.0)
        return vector(*(low.mul(flip, x) for x in a))
    # REFRACT: eta a - (eta (n . a) + sqrt(k)) n with k = 1 - eta² (1 - (n . a)²), 0 where k < 0.
    n, eta = low.normalized(b), low.number(node.scale)
    cosine = low.dot(n, a)
    k = low.sub(1.0, low.mul(low.mul(eta, eta), low.sub(1.0, low.mul(cosine, cosine))))
    along = low.mad(eta, cosine, emit("SQRT", k))
    keep = low.select(low.less(k, 0.0), 0.0, 1.0)
    return vector(*(low.mul(keep, low.sub(low.mul(eta, x), low.mul(along, y))) for x, y in zip(a, n[:3], strict=True)))


@rule(e.Transform)
def _transform(low: Lowering, node: e.Transform) -> Components:
    array("expression Transform", "matrix", node.matrix, (3, 4), np.float64)
    x, y, z = low.components(node.vector)[:3]
    out = vector(*(affine(low, (x, y, z), [constant(c) for c in row]) for row in node.matrix))
    return low.normalized(out) if node.normalize else out


def affine(low: Lowering, v: tuple[Value, Value, Value], row: list[float]) -> Value:
    """row[:3] . v + row[3], with no more steps than its zeros leave over."""
    used = [(x, c) for x, c in zip(v, row[:3], strict=True) if c != 0.0]
    if not used:
        return row[3]
    if len(used) == 1:
        return low.add(low.mul(used[0][0], used[0][1]), row[3]) if used[0][1] == 1.0 else low.mad(*used[0], row[3])
    pairs = [*used, (0.0, 0.0)][:3]
    return low.build.emit("AFFINE", *(item for pair in pairs for item in pair), row[3])


@rule(e.Channel)
def _channel(low: Lowering, node: e.Channel) -> Components:
    if not 0 <= node.index <= 3:
        raise ValueError(f"expression Channel: index must be between 0 and 3, not {node.index}")
    return repeated(low.components(node.value)[node.index])


@rule(e.Combine)
def _combine(low: Lowering, node: e.Combine) -> Components:
    return tuple(low.number(v) for v in (node.x, node.y, node.z, node.w))


@rule(e.Average)
def _average(low: Lowering, node: e.Average) -> Components:
    x, y, z = low.components(node.value)[:3]
    return repeated(x if x == y == z else low.mul(low.add(low.add(x, y), z), 1.0 / 3.0))


@rule(e.Clamp)
def _clamp(low: Lowering, node: e.Clamp) -> Components:
    columns = zip(*(low.components(v)[:3] for v in (node.value, node.minimum, node.maximum)), strict=True)
    out = [_clamp_between(low, *column) if node.swap else low.clamp(*column) for column in columns]
    return colored(out)


def _clamp_between(low: Lowering, x: Value, a: Value, b: Value) -> Value:
    return low.clamp(x, low.build.emit("MINIMUM", a, b), low.build.emit("MAXIMUM", a, b))


@rule(e.MapRange)
def _map_range(low: Lowering, node: e.MapRange) -> Components:
    operands = (node.value, node.from_min, node.from_max, node.to_min, node.to_max, node.steps)
    out = [_map_number(low, node, *column) for column in zip(*(low.components(v)[:3] for v in operands), strict=True)]
    return colored(out)


def _map_number(low: Lowering, node: e.MapRange, x: Value, from_min: Value, from_max: Value, to_min: Value,
                to_max: Value, steps: Value) -> Value:  # fmt: skip
    width = low.sub(from_max, from_min)
    factor = low.div(low.sub(x, from_min), width)
    if node.interpolation == "STEPPED":
        stair = low.div(low.floor(low.mul(factor, low.add(steps, 1.0))), steps)
        factor = low.select(low.build.emit("GREATER_THAN", steps, 0.0), stair, 0.0)
    elif node.interpolation != "LINEAR":
        t = low.clamp(factor)
        square = low.mul(t, t)
        if node.interpolation == "SMOOTHSTEP":
            factor = low.mul(low.sub(3.0, low.mul(2.0, t)), square)
        else:
            factor = low.mul(low.mul(square, t), low.mad(t, low.mad(t, 6.0, -15.0), 10.0))
    out = low.mad(factor, low.sub(to_max, to_min), to_min)
    if not node.vector:
        out = low.select(low.build.emit("EQUAL", width, 0.0), 0.0, out)
    # Cycles clamps smooth steps of vectors no further, but those of numbers, which matters for an empty range.
    if node.clamp and (not node.vector or node.interpolation in ("LINEAR", "STEPPED")):
        out = _clamp_between(low, out, to_min, to_max)
    return out
