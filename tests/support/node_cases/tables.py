"""Map Range, Clamp, ramps and curves."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from edgegrad import expression as e
from tests.support.node_cases.operands import PX, PY, PZ, Cases, P, Q

if TYPE_CHECKING:
    from tests.support.node_cases.blender_nodes import Nodes


def ranges() -> Cases:
    """Map Range and Clamp."""
    out: Cases = {}
    for kind in e.RANGE_STEPS:
        for clamp in (False, True):
            limits = (-0.5, 0.8, 2.0, -1.0)

            def number(n: Nodes, kind: str = kind, clamp: bool = clamp, limits: Any = limits) -> Any:
                values = dict(enumerate((n.component(n.p, 0), *limits, 3.0)))
                return n.node("MapRange", values, interpolation_type=kind, clamp=clamp).outputs[0]

            def triple(n: Nodes, kind: str = kind, clamp: bool = clamp) -> Any:
                made = n.node("MapRange", data_type="FLOAT_VECTOR", interpolation_type=kind, clamp=clamp)
                n.tree.links.new(n.p, made.inputs["Vector"])
                n.tree.links.new(n.q, made.inputs[8])  # from max
                made.inputs[7].default_value = (-0.4, 0.1, 0.2)
                made.inputs[9].default_value = (2.0, 0.0, -1.0)
                made.inputs[10].default_value = (-1.0, 3.0, 1.0)
                made.inputs[11].default_value = (3.0, 4.0, 5.0)
                return made.outputs["Vector"]

            name = f"map range {kind}{' clamped' if clamp else ''}"
            out[name] = (number, e.MapRange(PX, *limits, kind, 3.0, clamp))
            out[f"{name}, vector"] = (triple, e.MapRange(P, (-0.4, 0.1, 0.2), Q, (2.0, 0.0, -1.0), (-1.0, 3.0, 1.0),
                                                         kind, (3.0, 4.0, 5.0), clamp, True))
    out["map range empty"] = (
        lambda n: n.node("MapRange", {0: n.component(n.p, 0), 1: 0.5, 2: 0.5, 3: 1.0}).outputs[0],
        e.MapRange(PX, 0.5, 0.5, 1.0))
    for swap in (False, True):
        out[f"clamp {swap}"] = (
            partial(lambda swap, n: n.node("Clamp", {k: n.component(n.p, k) for k in range(3)},
                                           clamp_type="RANGE" if swap else "MINMAX").outputs[0], swap),
            e.Clamp(PX, PY, PZ, swap))
    return out


def tables() -> Cases:
    """Ramps and curves, by the tables that Cycles makes of them."""
    stops = [(0.1, (0.2, 0.8, 0.1, 1.0)), (0.35, (1.0, 0.0, 0.5, 0.3)), (0.8, (0.0, 0.4, 2.0, 0.7))]

    def ramp(n: Nodes, kind: str) -> Any:
        made = n.node("ValToRGB", {0: n.component(n.p, 0)})
        made.color_ramp.interpolation = kind
        elements = made.color_ramp.elements
        elements.new(0.5)
        for element, (position, color) in zip(elements, stops, strict=True):
            element.position, element.color = position, color
        return made.outputs[0], made.outputs[1]

    def curves(n: Nodes) -> Any:
        made = n.node("RGBCurve", {0: 0.7, 1: n.p})
        curve = made.mapping.curves[1]
        curve.points.new(0.3, 0.7)
        made.mapping.curves[3].points.new(0.6, 0.4)
        made.mapping.update()
        return made.outputs[0]

    import bpy

    out: Cases = {}
    for kind in ("LINEAR", "CONSTANT", "EASE", "CARDINAL", "B_SPLINE"):
        out[f"ramp {kind}"] = (partial(lambda kind, n: ramp(n, kind), kind), _ramp_like(bpy, ramp, kind))
    out["curves"] = (curves, _curves_like(bpy, curves))
    return out


def _scratch(bpy: Any) -> Nodes:
    from tests.support.node_cases.blender_nodes import Nodes

    material = bpy.data.materials.new("scratch")
    material.use_nodes = True
    return Nodes(material.node_tree)


def _ramp_like(bpy: Any, build: Any, kind: str) -> e.Expression:
    color = build(_scratch(bpy), kind)[0].node.color_ramp
    table = tuple(tuple(color.evaluate(k / 256)) for k in range(257))
    return e.Ramp(PX, table, kind != "CONSTANT")


def _curves_like(bpy: Any, build: Any) -> e.Expression:
    m = build(_scratch(bpy)).node.mapping
    m.initialize()
    rows = [tuple(m.evaluate(m.curves[c], m.evaluate(m.curves[3], k / 256)) for c in range(3)) for k in range(257)]
    return e.Curves(P, tuple(rows), 0.7)
