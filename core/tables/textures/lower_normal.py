"""How bump and normal maps are computed."""

from __future__ import annotations

from ...expression import normals as n
from .lowering import Components, Lowering, Shift, rule, vector


@rule(n.Bump)
def _bump(low: Lowering, node: n.Bump) -> Components:
    # A bump in the height of another bump keeps its own three points, as in Cycles.
    with low.at(None):
        normal = low.build.emit_all("NORMAL", count=3) if node.normal is None else low.components(node.normal)[:3]
        strength = low.build.emit("MAXIMUM", low.number(node.strength), 0.0)
        distance, step = low.number(node.distance), low.number(node.step)
        if isinstance(step, float) and not step > 0.0:
            raise ValueError(f"expression Bump: step must be above 0, not {step:g}")
        height = low.number(node.height)
    scale = low.div(low.mul(distance, -1.0) if node.invert else distance, step)
    slopes = []
    for axis in (0, 1):
        with low.at(Shift(axis, step)):
            beside = low.number(node.height)
        slopes.append(0.0 if beside == height else low.mul(low.sub(beside, height), scale))
    if slopes == [0.0, 0.0]:
        return vector(*normal)
    return vector(*low.build.emit_all("BUMP", *normal, *slopes, strength, count=3))


@rule(n.NormalMap)
def _normal_map(low: Lowering, node: n.NormalMap) -> Components:
    uv, tangent = low.resources.attribute(node.uv), low.resources.attribute(f"{node.uv}.tangent")
    if max(uv, tangent) >= 1 << 15:
        raise ValueError("expression NormalMap: the materials read more than 32,768 attributes")
    strength = low.build.emit("MAXIMUM", low.number(node.strength), 0.0)
    return vector(*low.build.emit_all("NORMAL_MAP", *low.components(node.color)[:3], strength,
                                      data=uv | tangent << 16, count=3))
