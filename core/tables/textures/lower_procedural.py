"""How procedural textures are computed (core/tables/textures/lower_math.py has the rest)."""

from __future__ import annotations

import numpy as np

from ...expression import Operand
from ...expression import procedural as p
from .lowering import Components, Lowering, colored, repeated, rule, vector
from .ops import Value


def _scaled(low: Lowering, position: Operand, scale: Operand) -> tuple[Value, Value, Value]:
    factor = low.number(scale)
    x, y, z = (low.mul(c, factor) for c in low.components(position)[:3])
    return x, y, z


@rule(p.Checker)
def _checker(low: Lowering, node: p.Checker) -> Components:
    first = low.build.emit("CHECKER", *_scaled(low, node.vector, node.scale))
    columns = zip(low.components(node.color1)[:3], low.components(node.color2)[:3], strict=True)
    out = [low.select(first, a, b) for a, b in columns]
    return colored(out)


@rule(p.Gradient)
def _gradient(low: Lowering, node: p.Gradient) -> Components:
    x, y, z = low.components(node.vector)[:3]
    if node.kind == "LINEAR":
        out = x
    elif node.kind == "QUADRATIC":
        r = low.build.emit("MAXIMUM", x, 0.0)
        out = low.mul(r, r)
    elif node.kind == "EASING":
        r = low.clamp(x)
        out = low.mul(low.mul(r, r), low.sub(3.0, low.mul(2.0, r)))
    elif node.kind == "DIAGONAL":
        out = low.mul(low.add(x, y), 0.5)
    elif node.kind == "RADIAL":
        out = low.mad(low.build.emit("ARCTAN2", y, x), 0.5 / np.pi, 0.5)
    else:
        # A little less than 1, so that unit vectors give exactly 0.
        length = low.build.emit("SQRT", low.dot((x, y, z), (x, y, z)))
        out = low.build.emit("MAXIMUM", low.sub(0.999999, length), 0.0)
        if node.kind == "QUADRATIC_SPHERE":
            out = low.mul(out, out)
    return repeated(low.clamp(out))


def _dimensions(node: p.WhiteNoise | p.Noise | p.Voronoi) -> int:
    return p.DIMENSIONS.index(node.dimensions)


def _used(v: Components, w: Value, dimensions: int) -> tuple[Value, Value, Value, Value]:
    """The coordinates that a texture of 1 + `dimensions` dimensions reads, others 0."""
    if dimensions == 0:
        return 0.0, 0.0, 0.0, w
    return v[0], v[1], v[2] if dimensions >= 2 else 0.0, w if dimensions == 3 else 0.0


@rule(p.WhiteNoise)
def _white_noise(low: Lowering, node: p.WhiteNoise) -> Components:
    dimensions = _dimensions(node)
    place = _used(low.components(node.vector)[:3], low.number(node.w), dimensions)
    if node.output == "VALUE":
        return repeated(low.build.emit("WHITE_NOISE", *place, data=dimensions))
    return vector(*low.build.emit_all("WHITE_NOISE", *place, data=dimensions | 4, count=3))


@rule(p.Noise)
def _noise(low: Lowering, node: p.Noise) -> Components:
    dimensions = _dimensions(node)
    w = low.mul(low.number(node.w), low.number(node.scale))
    place = _used(_scaled(low, node.vector, node.scale), w, dimensions)
    detail = low.clamp(low.number(node.detail), 0.0, 15.0)
    roughness = low.build.emit("MAXIMUM", low.number(node.roughness), 0.0)
    rest = (low.number(v) for v in (node.lacunarity, node.offset, node.gain, node.distortion))
    color = node.output == "COLOR"
    data = dimensions | p.NOISES.index(node.kind) << 2 | node.normalize << 5 | color << 6
    out = low.build.emit_all("NOISE", *place, detail, roughness, *rest, data=data, count=3)
    return vector(*out) if color else repeated(out[0])


# The native texture's output for each output of the node.
_VORONOI_OUTPUTS = {"DISTANCE": 0, "RADIUS": 0, "COLOR": 1, "POSITION": 2, "W": 2}


@rule(p.Voronoi)
def _voronoi(low: Lowering, node: p.Voronoi) -> Components:
    dimensions, scale = _dimensions(node), low.number(node.scale)
    place = _used(_scaled(low, node.vector, node.scale), low.mul(low.number(node.w), scale), dimensions)
    shape = (low.clamp(low.number(node.detail), 0.0, 15.0), low.clamp(low.number(node.roughness)),
             low.number(node.lacunarity), low.clamp(low.mul(low.number(node.smoothness), 0.5), 0.0, 0.5),
             low.number(node.exponent), low.clamp(low.number(node.randomness)))
    # Two features have one output of their own, and are the only ones that do; others are 0 in Blender.
    own = {"DISTANCE_TO_EDGE": ("DISTANCE",), "N_SPHERE_RADIUS": ("RADIUS",)}
    if node.output not in own.get(node.feature, ("DISTANCE", "COLOR", "POSITION", "W")):
        return repeated(0.0)
    data = (dimensions | p.VORONOI_FEATURES.index(node.feature) << 2 | p.VORONOI_METRICS.index(node.metric) << 5
            | node.normalize << 7 | _VORONOI_OUTPUTS[node.output] << 8)
    out = low.build.emit_all("VORONOI", *place, *shape, data=data)
    if _VORONOI_OUTPUTS[node.output] == 0:
        return repeated(out[0])
    if node.output == "COLOR":
        return vector(*out[:3])
    x, y, z, w = (low.div(c, scale) for c in out)
    return repeated(w) if node.output == "W" else vector(x, y, z)


@rule(p.Brick)
def _brick(low: Lowering, node: p.Brick) -> Components:
    for name in ("offset_frequency", "squash_frequency"):
        if not 1 <= getattr(node, name) <= 99:
            raise ValueError(f"expression Brick: {name} must be between 1 and 99, not {getattr(node, name)}")
    x, y, _ = _scaled(low, node.vector, node.scale)
    numbers = (low.number(v) for v in (node.mortar_size, node.mortar_smooth, node.bias, node.brick_width,
                                       node.row_height))
    tint, share = low.build.emit_all("BRICK", x, y, *numbers, node.offset, node.squash,
                                     data=node.offset_frequency | node.squash_frequency << 16, count=2)
    if node.output == "FAC":
        return repeated(share)
    columns = zip(*(low.components(v)[:3] for v in (node.color1, node.color2, node.mortar)), strict=True)
    return vector(*(low.lerp(low.lerp(a, b, tint), mortar, share) for a, b, mortar in columns))


@rule(p.Wave)
def _wave(low: Lowering, node: p.Wave) -> Components:
    # Slightly off the unit grid, where coordinates like to lie.
    q = tuple(low.mul(low.add(c, 1e-6), 0.999999) for c in _scaled(low, node.vector, node.scale))
    axis = "XYZ".find(node.direction)
    if node.kind == "BANDS":
        n = low.mul(low.add(low.add(q[0], q[1]), q[2]), 10.0) if axis < 0 else low.mul(q[axis], 20.0)
    else:
        r = tuple(0.0 if k == axis else c for k, c in enumerate(q))
        n = low.mul(low.build.emit("SQRT", low.dot(r, r)), 20.0)
    n = low.add(n, low.number(node.phase))
    distortion = low.number(node.distortion)
    if distortion != 0.0:
        place = (low.mul(c, low.number(node.detail_scale)) for c in q)
        shape = (low.number(node.detail), low.number(node.detail_roughness), 2.0, 0.0, 0.0, 0.0)
        noise = low.build.emit("NOISE", *place, 0.0, *shape, data=2 | p.NOISES.index("FBM") << 2 | 1 << 5)
        n = low.mad(distortion, low.mad(noise, 2.0, -1.0), n)
    if node.profile == "SIN":
        return repeated(low.mad(0.5, low.build.emit("SINE", low.sub(n, np.pi / 2.0)), 0.5))
    n = low.mul(n, 0.5 / np.pi)
    if node.profile == "SAW":
        return repeated(low.fract(n))
    return repeated(low.mul(low.build.emit("ABSOLUTE", low.sub(n, low.floor(low.add(n, 0.5)))), 2.0))


# Of each further iteration of Magic: the axis that is replaced, the sign of its wave, the wave, and the signs of
# x, y and z in the wave's argument.
_MAGIC = (
    (1, -1.0, "COSINE", (1.0, -1.0, 1.0)),
    (0, 1.0, "COSINE", (1.0, -1.0, -1.0)),
    (2, 1.0, "SINE", (-1.0, -1.0, -1.0)),
    (0, -1.0, "COSINE", (-1.0, 1.0, -1.0)),
    (1, -1.0, "SINE", (-1.0, 1.0, 1.0)),
    (1, -1.0, "COSINE", (-1.0, 1.0, 1.0)),
    (0, 1.0, "COSINE", (1.0, 1.0, 1.0)),
    (2, 1.0, "SINE", (1.0, 1.0, -1.0)),
    (0, -1.0, "COSINE", (-1.0, -1.0, 1.0)),
    (1, -1.0, "SINE", (1.0, -1.0, 1.0)),
)


@rule(p.Magic)
def _magic(low: Lowering, node: p.Magic) -> Components:
    scale = low.mul(low.number(node.scale), 5.0)
    distortion = low.number(node.distortion)
    # Reduced before they are added, for the precision of large coordinates.
    q = tuple(low.build.emit("MODULO", c, 2.0 * np.pi) for c in low.components(node.vector)[:3])
    signs = ((1.0, 1.0, 1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))
    angles = [low.mul(low.dot(q, s), scale) for s in signs]
    v = [low.build.emit("SINE", angles[0]), low.build.emit("COSINE", angles[1]),
         low.mul(-1.0, low.build.emit("COSINE", angles[2]))]
    for k, (axis, sign, wave, s) in enumerate(_MAGIC[: max(node.depth, 0)]):
        if k == 0:
            v = [low.mul(c, distortion) for c in v]
        v[axis] = low.mul(low.mul(sign, low.build.emit(wave, low.dot(tuple(v), s))), distortion)
    twice = low.mul(2.0, distortion)
    plain = low.build.emit("EQUAL", distortion, 0.0)
    return vector(*(low.sub(0.5, low.select(plain, c, low.div(c, twice))) for c in v))
