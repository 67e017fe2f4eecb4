"""Expressions beside the shader nodes that they stand for."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from edgegrad import expression as e
from tests.support.node_cases.operands import PX, PY, PZ, QX, QY, QZ, Cases, P, Q

if TYPE_CHECKING:
    from tests.support.node_cases.blender_nodes import Nodes


def inputs() -> Cases:
    """The operands themselves, and implicit conversions between kinds of sockets."""
    return {
        "vector": (lambda n: n.p, P),
        "component": (lambda n: n.component(n.q, 2), QZ),
        "vector as number": (lambda n: n.node("Math", {0: n.p, 1: 0.0}).outputs[0], e.Average(P)),
        "color as number": (
            lambda n: n.node("Math", {0: n.node("Gamma", {0: n.p, 1: 1.0}).outputs[0], 1: 0.0}).outputs[0],
            e.Luminance(P)),
        "RGB to BW": (lambda n: n.node("RGBToBW", {0: n.p}).outputs[0], e.Luminance(P)),
        "combine": (lambda n: n.node("CombineXYZ", {k: n.component(v, i) for k, (v, i) in
                                                    enumerate([(n.q, 1), (n.p, 0), (n.q, 2)])}).outputs[0],
                    e.Combine(QY, PX, QZ)),
    }


def math() -> Cases:
    """The Math node."""

    def case(operation: str, clamp: bool = False) -> Any:
        return (
            lambda n: n.node("Math", {0: n.component(n.p, 0), 1: n.component(n.p, 1), 2: n.component(n.p, 2)},
                             operation=operation, use_clamp=clamp).outputs[0],
            e.Math(operation, PX, PY, PZ, clamp),
        )

    return {f"math {op}": case(op) for op in e.MATH_OPERATIONS} | {"math clamped": case("MULTIPLY", True)}


def vector_math() -> Cases:
    """The Vector Math node; its third operand is 0.7 of the first."""

    def case(operation: str) -> Any:
        def node(n: Nodes) -> Any:
            third = n.node("VectorMath", {0: n.p, "Scale": 0.7}, operation="SCALE").outputs[0]
            values = {0: n.p, 1: n.q, 2: third, "Scale": n.component(n.q, 0)}
            made = n.node("VectorMath", values, operation=operation)
            return made.outputs[1 if operation in ("DOT_PRODUCT", "DISTANCE", "LENGTH") else 0]

        return node, e.VectorMath(operation, P, Q, e.VectorMath("SCALE", P, scale=0.7), QX)

    return {f"vector {op}": case(op) for op in e.VECTOR_OPERATIONS}


def mapping() -> Cases:
    """The Mapping node's types as affine maps."""
    location, rotation, scale = np.array([0.3, -0.7, 1.1]), (0.4, -0.8, 1.3), np.array([1.5, 0.5, -2.0])
    a, b, c = rotation
    x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    turn = z @ y @ x
    parts = {
        "POINT": (turn * scale, location),
        "TEXTURE": (turn.T / scale[:, None], -(turn.T / scale[:, None]) @ location),
        "VECTOR": (turn * scale, np.zeros(3)),
        "NORMAL": (turn / scale, np.zeros(3)),
    }
    out: Cases = {}
    for kind, (linear, offset) in parts.items():
        rows: Any = tuple(tuple(float(v) for v in row) for row in np.column_stack([linear, offset]))
        out[f"mapping {kind}"] = (
            partial(lambda kind, n: n.node("Mapping", {0: n.p, 1: location, 2: rotation, 3: scale},
                                           vector_type=kind).outputs[0], kind),
            e.Transform(P, rows, kind == "NORMAL"),
        )
    return out


def mix() -> Cases:
    """The Mix node."""

    def colors(blend: str, clamp_factor: bool, clamp_result: bool) -> Any:
        def node(n: Nodes) -> Any:
            made = n.node("Mix", data_type="RGBA", blend_type=blend, clamp_factor=clamp_factor,
                          clamp_result=clamp_result)
            for socket, value in ((0, n.component(n.p, 2)), (6, n.p), (7, n.q)):
                n.tree.links.new(value, made.inputs[socket])
            return made.outputs[2]

        return node, e.Mix(PZ, P, Q, blend, clamp_factor, clamp_result)

    def vectors(uniform: bool) -> Any:
        def node(n: Nodes) -> Any:
            made = n.node("Mix", data_type="VECTOR", factor_mode="UNIFORM" if uniform else "NON_UNIFORM")
            for socket, value in ((0, n.component(n.p, 2)), (1, n.p), (4, n.p), (5, n.q)):
                n.tree.links.new(value, made.inputs[socket])
            return made.outputs[1]

        return node, e.Mix(PZ if uniform else P, P, Q)

    def floats(n: Nodes) -> Any:
        values = {0: n.component(n.p, 2), 2: n.component(n.p, 0), 3: n.component(n.p, 1)}
        return n.node("Mix", values, data_type="FLOAT", clamp_factor=False).outputs[0]

    return {
        **{f"mix {blend}": colors(blend, True, False) for blend in e.BLENDS},
        **{f"mix {blend} over": colors(blend, False, True) for blend in e.BLENDS},
        "mix vectors": vectors(True),
        "mix components": vectors(False),
        "mix floats": (floats, e.Mix(PZ, PX, PY, clamp_factor=False)),
    }


def colors() -> Cases:
    """Nodes of colours."""

    def model(mode: str, separate: bool) -> Any:
        def node(n: Nodes) -> Any:
            if separate:
                made = n.node("SeparateColor", {0: n.p}, mode=mode)
                return n.node("CombineXYZ", {k: made.outputs[k] for k in range(3)}).outputs[0]
            return n.node("CombineColor", {k: n.component(n.p, k) for k in range(3)}, mode=mode).outputs[0]

        return node, e.ColorModel(P, "RGB", mode) if separate else e.ColorModel(P, mode, "RGB")

    return {
        "RGB to HSV": model("HSV", True), "HSV to RGB": model("HSV", False),
        "RGB to HSL": model("HSL", True), "HSL to RGB": model("HSL", False),
        "hue saturation": (
            lambda n: n.node("HueSaturation", {"Hue": n.component(n.q, 0), "Saturation": n.component(n.q, 1),
                                               "Value": n.component(n.q, 2), "Factor": 0.8, "Color": n.p}).outputs[0],
            e.HueSaturation(P, QX, QY, QZ, 0.8)),
        "bright contrast": (
            lambda n: n.node("BrightContrast", {0: n.p, 1: n.component(n.q, 0), 2: n.component(n.q, 1)}).outputs[0],
            e.BrightContrast(P, QX, QY)),
        "gamma": (lambda n: n.node("Gamma", {0: n.p, 1: n.component(n.q, 0)}).outputs[0], e.Gamma(P, QX)),
        "gamma 0": (lambda n: n.node("Gamma", {0: n.p, 1: 0.0}).outputs[0], e.Gamma(P, 0.0)),
        "invert": (lambda n: n.node("Invert", {0: 0.3, 1: n.p}).outputs[0], e.Invert(P, 0.3)),
    }  # fmt: skip


