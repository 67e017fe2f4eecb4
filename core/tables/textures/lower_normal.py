"""How bump and normal maps are computed."""

from __future__ import annotations

from ...expression import Operand
from ...expression import normals as n
from .lowering import Components, Lowering, Shift, rule, vector
from .ops import Value


def _positive(low: Lowering, node: n.Bump | n.DisplacedBump) -> Value:
    """The distance of the points at which heights are taken."""
    step = low.number(node.step)
    if isinstance(step, float) and not step > 0.0:
        raise ValueError(f"expression {type(node).__name__}: step must be above 0, not {step:g}")
    return step


@rule(n.Bump)
def _bump(low: Lowering, node: n.Bump) -> Components:
    # A bump in the height of another bump keeps its own three points, as in Cycles.
    with low.at(None):
        normal = low.build.emit_all("NORMAL", count=3) if node.normal is None else low.components(node.normal)[:3]
        strength = low.build.emit("MAXIMUM", low.number(node.strength), 0.0)
        distance, step = low.number(node.distance), _positive(low, node)
        height = low.number(node.height)
    scale = low.div(low.mul(distance, -1.0) if node.invert else distance, step)
    slopes = []
    for axis in (0, 1):
        with low.at(Shift(axis, step)):
            beside = low.number(node.height)
        slopes.append(0.0 if beside == height else low.mul(low.sub(beside, height), scale))
    if slopes == [0.0, 0.0]:
        return vector(*normal) if node.normal is None else low.normalized(vector(*normal))
    return vector(*low.build.emit_all("BUMP", *normal, *slopes, strength, count=3))


@rule(n.AtHitPoint)
def _at_hit_point(low: Lowering, node: n.AtHitPoint) -> Components:
    with low.at(None):
        return low.components(node.value)


@rule(n.DisplacedBump)
def _displaced_bump(low: Lowering, node: n.DisplacedBump) -> Components:
    with low.at(None):
        normal, true = (low.build.emit_all(kind, count=3) for kind in ("NORMAL", "TRUE_NORMAL"))
        step, side, height = _positive(low, node), low.number(node.side), low.number(node.height)
    # Steps beside the hit point, in the object's space, and the change of the height
    steps_before, steps_after = (_steps(low, one, step) for one in (node.before, node.after))
    rises = []
    for axis in (0, 1):
        with low.at(Shift(axis, step)):
            rises.append(low.div(low.sub(low.number(node.height), height), step))
    # The same steps after displacement, in the object's space and in the world's, tell the object's rotation and scale
    square = low.dot(steps_after[0], steps_after[0])
    inverse = low.build.emit("INVERSE_SQRT", square)
    across = low.crossed(*steps_after)
    own = (*steps_after, tuple(low.mul(low.mul(side, inverse), x) for x in across))
    tangent = low.build.emit_all("SURFACE_TANGENT", count=3)
    frame = (tangent, low.crossed(true, tangent), true)
    # Steps before displacement, in the world's space and in parts of `step`
    along, beside = (_turned(low, one, own, frame, low.mul(inverse, inverse)) for one in steps_before)
    first, second = low.crossed(beside, normal), low.crossed(normal, along)
    area = low.dot(along, first)
    # Cycles' heights are in the world's space, and its steps in the object's
    scale = low.mul(low.mul(step, inverse), low.build.emit("SIGN", area))
    slope = [low.mul(scale, rise) for rise in rises]
    size = low.build.emit("ABSOLUTE", area)
    bent = low.normalized(tuple(
        low.sub(low.mul(size, c), low.add(low.mul(slope[0], a), low.mul(slope[1], b)))
        for a, b, c in zip(first, second, normal, strict=True)))  # fmt: skip
    known = low.dot(bent, bent)
    return vector(*(low.select(known, a, b) for a, b in zip(bent[:3], normal, strict=True)))


def _turned(low: Lowering, v: Components, own: tuple[Components, ...], frame: tuple[Components, ...],
            scale: Value) -> Components:  # fmt: skip
    """A vector by its parts along the axes `own`, as a sum of the axes `frame`, times `scale`."""
    parts = tuple(low.mul(scale, low.dot(v, axis)) for axis in own)
    return tuple(low.dot(parts, axis) for axis in zip(*frame, strict=True))


def _steps(low: Lowering, place: Operand, step: Value) -> tuple[Components, Components]:
    """How a place changes along both tangents."""
    with low.at(None):
        here = low.components(place)
    found = []
    for axis in (0, 1):
        with low.at(Shift(axis, step)):
            found.append(tuple(low.sub(x, y) for x, y in zip(low.components(place)[:3], here[:3], strict=True)))
    return found[0], found[1]


@rule(n.DisplacedPosition)
def _displaced_position(low: Lowering, node: n.DisplacedPosition) -> Components:
    shift = low.shift
    with low.at(None):
        here = low.components(node.before)
    if shift is None:
        return here
    before, after = (_steps(low, one, shift.step) for one in (node.before, node.after))
    lengths = [low.build.emit("SQRT", low.dot(one, one)) for one in (*before, after[0])]
    scale = low.div(low.mul(0.5, low.add(lengths[0], lengths[1])), lengths[2])
    return vector(*(low.mad(scale, d, x) for d, x in zip(after[shift.axis], here[:3], strict=True)))


@rule(n.NormalMap)
def _normal_map(low: Lowering, node: n.NormalMap) -> Components:
    uv, tangent = low.resources.attribute(node.uv), low.resources.attribute(f"{node.uv}.tangent")
    if max(uv, tangent) >= 1 << 15:
        raise ValueError("expression NormalMap: the materials read more than 32,768 attributes")
    strength = low.build.emit("MAXIMUM", low.number(node.strength), 0.0)
    return vector(*low.build.emit_all("NORMAL_MAP", *low.components(node.color)[:3], strength,
                                      data=uv | tangent << 16, count=3))
