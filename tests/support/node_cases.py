"""Expressions beside the shader nodes that they stand for."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from edgegrad import expression as e
from edgegrad.expression import procedural as t

if TYPE_CHECKING:
    from tests.support.blender_nodes import Nodes

# Name to (what builds the node and returns its socket, the expression).
Cases = dict[str, tuple[Callable[["Nodes"], Any], e.Expression]]

P, Q = e.Attribute("P"), e.Attribute("Q")
PX, PY, PZ, QX, QY, QZ = (e.Channel(v, k) for v in (P, Q) for k in range(3))


def inputs() -> Cases:
    """The operands themselves, and what is implied between kinds of sockets."""
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
    from tests.support.blender_nodes import Nodes

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


def textures() -> Cases:
    """Procedural textures."""
    out: Cases = {
        "checker": (lambda n: n.node("TexChecker", {0: n.p, 1: (0.1, 0.7, 0.3, 1), 2: (0.9, 0.2, 0.4, 1),
                                                    3: 3.0}).outputs[0],
                    t.Checker(P, (0.1, 0.7, 0.3), (0.9, 0.2, 0.4), 3.0)),
    }
    for kind in t.GRADIENTS:
        out[f"gradient {kind}"] = (
            partial(lambda kind, n: n.node("TexGradient", {0: n.p}, gradient_type=kind).outputs[1], kind),
            t.Gradient(P, kind))
    for d in t.DIMENSIONS:
        for output in ("VALUE", "COLOR"):

            def white(n: Nodes, d: str = d, output: str = output) -> Any:
                made = n.node("TexWhiteNoise", {"Vector": n.p, "W": n.component(n.q, 0)}, noise_dimensions=d)
                return made.outputs["Value" if output == "VALUE" else "Color"]

            out[f"white noise {d} {output}"] = (white, t.WhiteNoise(P, QX, d, output))
    return out | _noises() | _waves() | _voronois() | _bricks()


def _noises() -> Cases:
    out: Cases = {}
    values = {"scale": 2.3, "detail": 3.4, "roughness": 0.6, "lacunarity": 2.2, "offset": 0.4, "gain": 1.3}

    def case(d: str, kind: str, normalize: bool, output: str, distortion: float) -> Any:
        def node(n: Nodes) -> Any:
            sockets = {key.capitalize(): value for key, value in values.items()}
            sockets |= {"Distortion": distortion, "Vector": n.p, "W": n.component(n.q, 0)}
            made = n.node("TexNoise", sockets, noise_dimensions=d, noise_type=kind, normalize=normalize)
            return made.outputs[0 if output == "FAC" else 1]

        return node, t.Noise(P, QX, **values, distortion=distortion, dimensions=d, kind=kind, normalize=normalize,
                             output=output)

    for d in t.DIMENSIONS:
        for kind in t.NOISES:
            out[f"noise {d} {kind}"] = case(d, kind, False, "FAC", 0.0)
        out[f"noise {d} color"] = case(d, "FBM", True, "COLOR", 0.5)
    return out


def _waves() -> Cases:
    out: Cases = {}

    def wave(kind: str, direction: str, profile: str, distortion: float) -> Any:
        def node(n: Nodes) -> Any:
            values = {"Vector": n.p, "Scale": 0.7, "Distortion": distortion, "Detail": 2.5, "Detail Scale": 1.2,
                      "Detail Roughness": 0.4, "Phase Offset": 0.3}
            made = n.node("TexWave", values, wave_type=kind, wave_profile=profile)
            setattr(made, f"{kind.lower()}_direction", direction)
            return made.outputs[1]

        return node, t.Wave(P, 0.7, distortion, 2.5, 1.2, 0.4, 0.3, kind, direction, profile)

    for profile in ("SIN", "SAW", "TRI"):
        for direction in ("X", "DIAGONAL"):
            out[f"wave bands {direction} {profile}"] = wave("BANDS", direction, profile, 0.0)
        for direction in ("Z", "SPHERICAL"):
            out[f"wave rings {direction} {profile}"] = wave("RINGS", direction, profile, 0.8)
    for depth in range(11):
        out[f"magic {depth}"] = (
            partial(lambda depth, n: n.node("TexMagic", {0: n.p, 1: 1.3, 2: 0.9}, turbulence_depth=depth).outputs[0],
                    depth),
            t.Magic(P, 1.3, 0.9, depth))
    return out


def _voronois() -> Cases:
    sockets = {"DISTANCE": "Distance", "COLOR": "Color", "POSITION": "Position", "W": "W", "RADIUS": "Radius"}

    def case(d: str, feature: str, metric: str, output: str, detail: float, normalize: bool) -> Any:
        values = {"scale": 1.7, "detail": detail, "roughness": 0.6, "lacunarity": 2.1, "smoothness": 0.7,
                  "exponent": 0.8, "randomness": 0.9}

        def node(n: Nodes) -> Any:
            named = {key.capitalize(): value for key, value in values.items()}
            made = n.node("TexVoronoi", {**named, "Vector": n.p, "W": n.component(n.q, 0)}, voronoi_dimensions=d,
                          feature=feature, distance=metric, normalize=normalize)
            return {socket.name: socket for socket in made.outputs}[sockets[output]]

        return node, t.Voronoi(P, QX, **values, dimensions=d, feature=feature, metric=metric, normalize=normalize,
                               output=output)

    out: Cases = {}
    for d in t.DIMENSIONS:
        for feature in ("F1", "F2", "SMOOTH_F1"):
            for output in ("DISTANCE", "COLOR", "W" if d == "1D" else "POSITION"):
                out[f"voronoi {d} {feature} {output}"] = case(d, feature, "EUCLIDEAN", output, 1.4, True)
            out[f"voronoi {d} {feature} one octave"] = case(d, feature, "EUCLIDEAN", "COLOR", 0.0, False)
        for metric in t.VORONOI_METRICS[1:]:
            out[f"voronoi {d} {metric}"] = case(d, "F1", metric, "DISTANCE", 0.0, True)
        out[f"voronoi {d} edge"] = case(d, "DISTANCE_TO_EDGE", "EUCLIDEAN", "DISTANCE", 0.0, False)
        out[f"voronoi {d} edge octaves"] = case(d, "DISTANCE_TO_EDGE", "EUCLIDEAN", "DISTANCE", 1.4, True)
        out[f"voronoi {d} radius"] = case(d, "N_SPHERE_RADIUS", "EUCLIDEAN", "RADIUS", 0.0, False)
    return out


def _bricks() -> Cases:
    colors = {"Color1": (0.8, 0.1, 0.2, 1), "Color2": (0.2, 0.6, 0.1, 1), "Mortar": (0.9, 0.9, 0.3, 1)}

    def case(output: str, smooth: float) -> Any:
        values = {"Scale": 3.0, "Mortar Size": 0.1, "Mortar Smooth": smooth, "Bias": 0.1, "Brick Width": 0.6,
                  "Row Height": 0.3}

        def node(n: Nodes) -> Any:
            made = n.node("TexBrick", {"Vector": n.p, **colors, **values}, offset=0.4, offset_frequency=3,
                          squash=1.3, squash_frequency=2)
            return made.outputs[0 if output == "COLOR" else 1]

        c: list[Any] = [tuple(float(x) for x in color[:3]) for color in colors.values()]
        return node, t.Brick(P, *c, *values.values(), offset=0.4,  # type: ignore[misc]
                             offset_frequency=3, squash=1.3, squash_frequency=2, output=output)

    return {"brick": case("COLOR", 0.2), "brick mortar": case("FAC", 0.0)}


def image_pixels() -> dict[str, Any]:
    """Small pictures, (height, width, channels) rows from the top; the colours of "clear" are straight."""
    rng = np.random.default_rng(5)
    opaque = rng.uniform(0.0, 1.0, (4, 5, 4)).astype(np.float32)
    opaque[..., 3] = 1.0
    clear = rng.uniform(0.0, 1.0, (3, 7, 4)).astype(np.float32)
    clear[1, 2, 3] = 0.0
    return {"opaque": opaque, "clear": clear}


def images() -> Cases:
    """Image and environment textures."""
    import bpy

    pictures = {}
    for name, pixels in image_pixels().items():
        height, width, _ = pixels.shape
        made = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True, is_data=False)
        made.colorspace_settings.name = "Linear Rec.709"
        made.alpha_mode = "STRAIGHT"
        stored = pixels.copy()
        stored[..., :3] *= pixels[..., 3:]  # buffers of floats are premultiplied
        made.pixels.foreach_set(stored[::-1].ravel())
        made.update()
        pictures[name] = made

    def image(name: str, alpha: bool, **settings: Any) -> Any:
        def node(n: Nodes) -> Any:
            made = n.node("TexImage", {0: n.p}, image=pictures[name], **settings)
            return (made.outputs[0], made.outputs[1]) if alpha else made.outputs[0]

        return node

    words = {"LINEAR": "Linear", "CLOSEST": "Closest", "CUBIC": "Cubic"}
    out: Cases = {}
    for interpolation in e.INTERPOLATIONS:
        for extension in e.EXTENSIONS:
            out[f"image {interpolation} {extension}"] = (
                image("opaque", True, interpolation=words[interpolation], extension=extension),
                e.ImageTexture("opaque", P, interpolation, extension))
        for alpha, mode in ((True, "STRAIGHT"), (False, "PREMULTIPLIED")):
            out[f"image {interpolation} {mode}"] = (
                image("clear", alpha, interpolation=words[interpolation]),
                e.ImageTexture("clear", P, interpolation, alpha=mode))
    for projection in ("SPHERE", "TUBE"):
        out[f"image {projection}"] = (image("opaque", True, projection=projection),
                                      e.ImageTexture("opaque", P, projection=projection))
    for blend in (0.0, 0.4):
        out[f"image BOX {blend}"] = (
            image("opaque", True, projection="BOX", projection_blend=blend),
            e.ImageTexture("opaque", P, projection="BOX", blend=blend, normal=(0.0, 0.0, 1.0)))
    for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        out[f"environment {projection}"] = (
            partial(lambda projection, n: n.node("TexEnvironment", {0: n.p}, image=pictures["opaque"],
                                                 projection=projection).outputs[0], projection),
            e.ImageTexture("opaque", P, projection=projection))
    return out


def shading() -> Cases:
    """Nodes of the angle to the viewer, who looks along -Z; the normal is P made a unit vector."""
    unit = e.VectorMath("NORMALIZE", P)

    def normal(n: Nodes) -> Any:
        return n.node("VectorMath", {0: n.p}, operation="NORMALIZE").outputs[0]

    out: Cases = {
        "fresnel": (lambda n: n.node("Fresnel", {0: n.component(n.q, 0), 1: normal(n)}).outputs[0],
                    e.Fresnel(QX, unit)),
        "normal": (lambda n: n.node("NewGeometry").outputs["Normal"], e.Coordinates("NORMAL")),
        "true normal": (lambda n: n.node("NewGeometry").outputs["True Normal"], e.Coordinates("TRUE_NORMAL")),
        "incoming": (lambda n: n.node("NewGeometry").outputs["Incoming"], e.Coordinates("INCOMING")),
        "reflection": (lambda n: n.node("TexCoord").outputs["Reflection"], e.Coordinates("REFLECTION")),
        "backfacing": (lambda n: n.node("NewGeometry").outputs["Backfacing"], e.Backfacing()),
        "camera ray": (lambda n: n.node("LightPath").outputs["Is Camera Ray"], e.LightPath("CAMERA")),
        "shadow ray": (lambda n: n.node("LightPath").outputs["Is Shadow Ray"], e.LightPath("SHADOW")),
    }
    for k, output in enumerate(("FRESNEL", "FACING")):
        out[f"layer weight {output}"] = (
            partial(lambda k, n: n.node("LayerWeight", {0: n.component(n.q, 0), 1: normal(n)}).outputs[k], k),
            e.LayerWeight(output, QX, unit))
    return out
